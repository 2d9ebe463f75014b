"""Watch points of a drop test in input numbers: centres of board and die, joints, board strain."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.mesh import MeshData, cells_of_facets
from reflowshock.fem.mesh.pad_faces import PadFaces, pad_faces
from reflowshock.fem.mesh.pad_layer import PadLayer, octant_volumes

SLIVER = 1e-9  # of a layer's volume: a smaller intersection with an element is rounding


@dataclass(frozen=True, slots=True)
class WatchTable:
    """Watch points in input numbers, of a whole mesh or of one model.

    Attributes:
        joints: Names of the joints, the same for all models of a run.
        centres: Nodes at the centres of board and die, -1 if in another model, shape (2,).
        faces: Faces between pads and solder.
        layer: Layers of solder at the pads.
        thickness: Thickness of these layers [m].
        solder_cells: All solder elements, shape (s,).
        solder_joint: Joint of each solder element, shape (s,).
        strain_facets: Facets of the board's lower face around the package, shape (f, 4).
        strain_cells: Element of each of these facets, shape (f,).
    """

    joints: tuple[str, ...]
    centres: NDArray[np.integer]
    faces: PadFaces
    layer: PadLayer
    thickness: float
    solder_cells: NDArray[np.integer]
    solder_joint: NDArray[np.int64]
    strain_facets: NDArray[np.int32]
    strain_cells: NDArray[np.integer]

    def within(
        self, node_number: NDArray[np.int32], cell_number: NDArray[np.int32], every_node: NDArray[np.int32]
    ) -> "WatchTable":
        """Return the part of one model in its own numbers.

        Args:
            node_number: Node number in the model of each input node, -1 if it counts in another, shape (n,); an
                interface node counts in one model.
            cell_number: Cell number in the model of each input cell, -1 if it belongs to another, shape (ne,).
            every_node: As ``node_number``, with interface nodes in both models, for the facets of their cells.
        """
        solder, strain = cell_number[self.solder_cells], cell_number[self.strain_cells]
        return WatchTable(
            joints=self.joints,
            centres=np.where(self.centres >= 0, node_number[self.centres], -1),
            faces=self.faces.within(every_node, cell_number),
            layer=self.layer.within(cell_number),
            thickness=self.thickness,
            solder_cells=solder[solder >= 0],
            solder_joint=self.solder_joint[solder >= 0],
            strain_facets=every_node[self.strain_facets[strain >= 0]],
            strain_cells=strain[strain >= 0],
        )


def joint_names(mesh: MeshData) -> tuple[str, ...]:
    """Return the names of the joints in the order of the mesh's part names; empty without joints.

    Args:
        mesh: Mesh in which the solder of a joint is the part ``solder@<joint>``.
    """
    return tuple(name.split("@")[1] for name in mesh.part_names if name.startswith("solder@"))


def _footprint(mesh: MeshData) -> NDArray[np.float64]:
    """Return the lower and upper corner in plan of the board patch, or of the mesh if it has none, (2, 2) [m]."""
    patch = mesh.in_parts("board_patch".__eq__)
    points = mesh.points[mesh.cells[patch if patch.any() else slice(None)]][:, :, :2]
    return np.array([points.min(axis=(0, 1)), points.max(axis=(0, 1))])


def centre_nodes(mesh: MeshData) -> NDArray[np.int64]:
    """Return the nodes nearest to the axis x = y = 0 on the board's lower face and the die's upper face, shape (2,).

    Args:
        mesh: Mesh of package and board; a node is -1 if the mesh has no such part.
    """
    board = mesh.facet_nodes("board_bottom")
    die = np.unique(mesh.cells[mesh.in_parts("die".__eq__)])
    if len(die):
        height = mesh.points[die, 2]
        die = die[height > height.max() - 1e-6 * np.ptp(mesh.points[die], axis=0).max()]
    return np.array([_nearest_to_axis(mesh.points, nodes) for nodes in (board, die)])


def _nearest_to_axis(points: NDArray[np.float64], nodes: NDArray[np.integer]) -> int:
    """Return the node nearest to the axis x = y = 0, or -1 if ``nodes`` is empty."""
    return int(nodes[np.argmin(np.sum(points[nodes, :2] ** 2, axis=1))]) if len(nodes) else -1


def whole_watch(mesh: MeshData, thickness: float) -> WatchTable:
    """Return the watch table of a whole mesh: nodes, pad faces and layers whose histories are recorded.

    Args:
        mesh: Whole mesh of board, package and joints.
        thickness: Thickness of the layers at the pads over which stress and plastic flow are averaged [m].

    Returns:
        Names of the joints; nodes at the centres of board and die; pad faces; solder layers at the pads; facets of the
        board under the package, where its strain is recorded. All numbers are numbers of the mesh.

    Raises:
        MeshError: A pad of a joint has no solder element, or the layer is thicker than a joint.
    """
    joints = joint_names(mesh)
    solder = [mesh.in_parts(f"solder@{name}".__eq__).nonzero()[0] for name in joints]
    faces = pad_faces(mesh, joints, solder)
    facets = mesh.facets_of("board_bottom")
    low, high = _footprint(mesh)
    facets = facets[((mesh.points[facets][:, :, :2] >= low) & (mesh.points[facets][:, :, :2] <= high)).all(axis=(1, 2))]
    return WatchTable(
        joints=joints,
        centres=centre_nodes(mesh),
        faces=faces,
        layer=_pad_layers(mesh, joints, solder, faces, thickness),
        thickness=thickness,
        solder_cells=np.concatenate([*solder, np.empty(0, np.int64)]),
        solder_joint=np.repeat(np.arange(len(joints)), [len(cells) for cells in solder]),
        strain_facets=facets,
        strain_cells=cells_of_facets(mesh.cells, facets),
    )


def _pad_layers(
    mesh: MeshData, joints: tuple[str, ...], solder: list[NDArray[np.intp]], faces: PadFaces, thickness: float
) -> PadLayer:
    """Return the solder within a distance ``thickness`` [m] of the pads; errors as in ``whole_watch``."""
    height = np.einsum("ji,ji->j", np.subtract(*faces.centre.reshape(2, -1, 3)[::-1]), faces.frame[: len(joints), 2])
    for name, joint_height in zip(joints, height, strict=True):
        if thickness > joint_height:
            raise MeshError(
                f"shock.joint_layer = {1e6 * thickness:.4g} um is thicker than the solder of joint {name},"
                f" {1e6 * joint_height:.4g} um from pad to pad; allowed: up to {1e6 * height.min():.4g} um"
            )
    cells, slots, weights = [np.empty(0, np.int64)], [np.empty(0, np.int64)], [np.empty((0, 8))]
    for k, centre in enumerate(faces.centre):
        elements = solder[k % len(joints)]
        inward = faces.frame[k, 2] * (1.0 if k < len(joints) else -1.0)
        weight = octant_volumes(mesh.points[mesh.cells[elements]], centre, inward, thickness)
        inside = weight.sum(axis=1) > SLIVER * weight.sum()
        cells.append(elements[inside])
        slots.append(np.full(np.sum(inside), k))
        weights.append(weight[inside])
    slot, weight = np.concatenate(slots), np.concatenate(weights)
    volume = np.bincount(slot, weight.sum(axis=1), len(faces.centre)).astype(float)
    return PadLayer(np.concatenate(cells), slot, weight, volume)
