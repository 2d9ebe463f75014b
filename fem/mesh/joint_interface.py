"""Upper interface of joints in input numbers: the facets between solder and the package's pads."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.mesh.mesh import MeshData, cells_of_facets
from reflowshock.fem.mesh.watch_table import joint_names

SIDE = "pad_package@"


@dataclass(frozen=True, slots=True)
class JointInterfaceTable:
    """Interface facets of all joints; only ``cells`` differs between the models of a run.

    Attributes:
        joints: Names of the joints.
        joint: Joint of each facet, shape (q,).
        nodes: Nodes of the facets in the whole mesh, in cyclic order, shape (q, 4).
        corners: Coordinates of these nodes, shape (q, 4, 3) [m].
        cells: Solder element of each facet, -1 if it belongs to another model, shape (q,).
    """

    joints: tuple[str, ...]
    joint: NDArray[np.int64]
    nodes: NDArray[np.int32]
    corners: NDArray[np.float64]
    cells: NDArray[np.integer]

    def within(self, cell_number: NDArray[np.int32]) -> "JointInterfaceTable":
        """Return the table of one model.

        Args:
            cell_number: Cell number in the model of each input cell, -1 if it belongs to another, shape (ne,).
        """
        return replace(self, cells=cell_number[self.cells])

    def surfaces(self) -> dict[str, NDArray]:
        """Return ``points@<joint>``, shape (n, 3) [m], and ``quads@<joint>``, shape (m, 4), of each joint."""
        arrays: dict[str, NDArray] = {}
        for number, name in enumerate(self.joints):
            here = self.joint == number
            _, first, quads = np.unique(self.nodes[here], return_index=True, return_inverse=True)
            arrays[f"points@{name}"] = self.corners[here].reshape(-1, 3)[first]
            arrays[f"quads@{name}"] = quads.reshape(-1, 4).astype(np.int32)
        return arrays


def whole_joint_interface(mesh: MeshData) -> JointInterfaceTable:
    """Return the facets on the package pads of all joints of an undivided mesh, in the numbers of this mesh.

    Facets without a solder element are not checked here; ``watch_table`` raises an error for them.

    Args:
        mesh: Mesh of board, package and joints.

    Returns:
        Joint, nodes, corners and solder element of each facet; empty arrays if the mesh has no joints.
    """
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
