"""Watch points as tables in input numbers: centres, joints, board strain."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import element_geometry
from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.mesh import MeshData, cells_of_facets


@dataclass(frozen=True, slots=True)
class WatchTable:
    """Watch points in input numbers, of a whole mesh or of one model.

    Attributes:
        joints: Names of the joints, the same for all models of a run.
        centres: ``(2,)`` node of the board's and of the die's centre, -1 where another model has it.
        layer_cells: ``(k,)`` solder elements at the pads.
        layer_end: ``(k,)`` 0 at the board, 1 at the package.
        layer_joint: ``(k,)`` joint of each.
        layer_volume: ``(k,)`` share of the layer's volume.
        layer_area: ``(k,)`` share of the layer's pad area.
        solder_cells: ``(s,)`` all solder elements.
        solder_joint: ``(s,)`` joint of each.
        strain_facets: ``(f, 4)`` nodes of the board's lower face around the package.
        strain_cells: ``(f,)`` the element of each.
    """

    joints: tuple[str, ...]
    centres: NDArray[np.integer]
    layer_cells: NDArray[np.integer]
    layer_end: NDArray[np.int64]
    layer_joint: NDArray[np.int64]
    layer_volume: NDArray[np.float64]
    layer_area: NDArray[np.float64]
    solder_cells: NDArray[np.integer]
    solder_joint: NDArray[np.int64]
    strain_facets: NDArray[np.int32]
    strain_cells: NDArray[np.integer]

    def within(
        self, node_number: NDArray[np.int32], cell_number: NDArray[np.int32], every_node: NDArray[np.int32]
    ) -> "WatchTable":
        """Return the part of a model, in its numbers of nodes ``(n,)`` and cells ``(ne,)``: -1 for what it has not.

        A node at the interface counts in one model; ``every_node (n,)`` has it in both, for the facets of their cells.
        """
        layer, solder = cell_number[self.layer_cells], cell_number[self.solder_cells]
        strain = cell_number[self.strain_cells]
        return WatchTable(
            joints=self.joints,
            centres=np.where(self.centres >= 0, node_number[self.centres], -1),
            layer_cells=layer[layer >= 0],
            layer_end=self.layer_end[layer >= 0],
            layer_joint=self.layer_joint[layer >= 0],
            layer_volume=self.layer_volume[layer >= 0],
            layer_area=self.layer_area[layer >= 0],
            solder_cells=solder[solder >= 0],
            solder_joint=self.solder_joint[solder >= 0],
            strain_facets=every_node[self.strain_facets[strain >= 0]],
            strain_cells=strain[strain >= 0],
        )


def joint_names(mesh: MeshData) -> tuple[str, ...]:
    """Return the names of the joints, in the order of the mesh."""
    return tuple(name.split("@")[1] for name in mesh.part_names if name.startswith("solder@"))


def footprint(mesh: MeshData) -> NDArray[np.float64]:
    """Return the corners ``(2, 2)`` [m] in x, y of the package and its margin: the patch, or all where none is."""
    patch = mesh.in_parts("board_patch".__eq__)
    points = mesh.points[mesh.cells[patch if patch.any() else slice(None)]][:, :, :2]
    return np.array([points.min(axis=(0, 1)), points.max(axis=(0, 1))])


def centre_nodes(mesh: MeshData) -> NDArray[np.int64]:
    """Return the nodes nearest to the axis x = y = 0 on the board's lower face and on the die's upper face, or -1."""
    board = mesh.facet_nodes("board_bottom")
    die = np.unique(mesh.cells[mesh.in_parts("die".__eq__)])
    if len(die):
        height = mesh.points[die, 2]
        die = die[height > height.max() - 1e-6 * np.ptp(mesh.points[die], axis=0).max()]
    return np.array([nearest_to_axis(mesh.points, nodes) for nodes in (board, die)])


def nearest_to_axis(points: NDArray[np.float64], nodes: NDArray[np.integer]) -> int:
    """Return the one of some nodes that is nearest to x = y = 0, -1 where there is none."""
    return int(nodes[np.argmin(np.sum(points[nodes, :2] ** 2, axis=1))]) if len(nodes) else -1


def whole_watch(mesh: MeshData) -> WatchTable:
    """Return the table of all that is watched in a mesh, before it is divided.

    Raises:
        MeshError: A pad of a joint has no solder element.
    """
    joints = joint_names(mesh)
    solder = [mesh.in_parts(f"solder@{name}".__eq__).nonzero()[0] for name in joints]
    layers = [pad_layer(mesh, joint, cells, end) for joint, cells in zip(joints, solder, strict=True) for end in (0, 1)]
    facets = mesh.facets_of("board_bottom")
    low, high = footprint(mesh)
    facets = facets[((mesh.points[facets][:, :, :2] >= low) & (mesh.points[facets][:, :, :2] <= high)).all(axis=(1, 2))]
    empty, lengths = np.empty(0, np.int64), [len(layer[0]) for layer in layers]
    number = np.arange(len(joints))
    return WatchTable(
        joints=joints,
        centres=centre_nodes(mesh),
        layer_cells=np.concatenate([layer[0] for layer in layers] or [empty]),
        layer_end=np.repeat(np.tile([0, 1], len(joints)), lengths),
        layer_joint=np.repeat(np.repeat(number, 2), lengths),
        layer_volume=np.concatenate([layer[1] for layer in layers] or [np.empty(0)]),
        layer_area=np.concatenate([layer[2] for layer in layers] or [np.empty(0)]),
        solder_cells=np.concatenate([*solder, empty]),
        solder_joint=np.repeat(number, [len(cells) for cells in solder]),
        strain_facets=facets,
        strain_cells=cells_of_facets(mesh.cells, facets),
    )


def pad_layer(
    mesh: MeshData, joint: str, solder: NDArray[np.int64], end: int
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the solder elements at one pad of a joint with their shares of the layer's volume and pad area."""
    name = (f"pad_board@{joint}", f"pad_package@{joint}")[end]
    facets = mesh.facets_of(name)
    owner = cells_of_facets(mesh.cells[solder], facets)
    if not len(facets) or (owner < 0).any():
        raise MeshError(f"{name}: {np.sum(owner < 0)} of {len(facets)} facets belong to no element of solder@{joint}")
    corners = mesh.points[facets]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1)
    cells, index = np.unique(solder[owner], return_inverse=True)
    area = np.bincount(index.reshape(-1), area)
    volume = element_geometry(mesh.points, mesh.cells[cells]).volume
    return cells, volume / volume.sum(), area / area.sum()
