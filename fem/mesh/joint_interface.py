"""The upper interface of joints as a table in input numbers: the facets between their solder and the package's pads."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.mesh.mesh import MeshData, cells_of_facets
from reflowshock.fem.mesh.watch_table import joint_names

SIDE = "pad_package@"


@dataclass(frozen=True, slots=True)
class JointInterfaceTable:
    """The facets of all joints, alike in all models of a run but for the cells.

    Attributes:
        joints: Names of the joints.
        joint: ``(q,)`` joint of each facet.
        nodes: ``(q, 4)`` its nodes in the whole mesh, in cyclic order.
        corners: ``(q, 4, 3)`` [m].
        cells: ``(q,)`` its solder element, -1 where another model has that.
    """

    joints: tuple[str, ...]
    joint: NDArray[np.int64]
    nodes: NDArray[np.int32]
    corners: NDArray[np.float64]
    cells: NDArray[np.integer]

    def within(self, cell_number: NDArray[np.int32]) -> "JointInterfaceTable":
        """Return the table of a model, in its numbers of cells ``(ne,)``: -1 for what it has not."""
        return replace(self, cells=cell_number[self.cells])

    def surfaces(self) -> dict[str, NDArray]:
        """Return ``points@<joint> (n, 3)`` [m] and ``quads@<joint> (m, 4)`` of each joint."""
        found: dict[str, NDArray] = {}
        for number, name in enumerate(self.joints):
            here = self.joint == number
            _, first, quads = np.unique(self.nodes[here], return_index=True, return_inverse=True)
            found[f"points@{name}"] = self.corners[here].reshape(-1, 3)[first]
            found[f"quads@{name}"] = quads.reshape(-1, 4).astype(np.int32)
        return found


def whole_joint_interface(mesh: MeshData) -> JointInterfaceTable:
    """Return the table of a mesh before it is divided; ``watch_table`` refuses facets that belong to no solder."""
    joints = joint_names(mesh)
    facets = [mesh.facets_of(f"{SIDE}{name}") for name in joints]
    cells = []
    for name, some in zip(joints, facets, strict=True):
        solder = mesh.in_parts(f"solder@{name}".__eq__).nonzero()[0]
        cells.append(solder[cells_of_facets(mesh.cells[solder], some)])
    nodes = np.concatenate([*facets, np.empty((0, 4), np.int32)])
    return JointInterfaceTable(
        joints=joints,
        joint=np.repeat(np.arange(len(joints)), [len(some) for some in facets]),
        nodes=nodes,
        corners=mesh.points[nodes],
        cells=np.concatenate([*cells, np.empty(0, np.int64)]),
    )
