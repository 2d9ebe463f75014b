"""The faces at which pads hold the solder of a joint, in input numbers: nodes, area, frame of the section."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.mesh import MeshData, cells_of_facets

ENDS = ("board", "package")


@dataclass(frozen=True, slots=True)
class PadFaces:
    """The faces of all joints; a slot is end times joints plus joint, end 0 is at the board, 1 at the package.

    Attributes:
        nodes: ``(p,)`` nodes of the faces.
        node_slot: ``(p,)``.
        cells: ``(c,)`` solder elements with such a node: all that bear on them.
        facets: ``(f, 4)`` nodes of the facets, in cyclic order.
        facet_cell: ``(f,)`` the solder element of each.
        facet_slot: ``(f,)``.
        facet_sign: ``(f,)`` 1 where their order turns about the joint's axis, else -1.
        centre: ``(2 joints, 3)`` [m] centroids.
        frame: ``(2 joints, 3, 3)`` rows: the x axis along the face, the third direction, the axis: the normal from the
            board's pad towards the package's.
        area: ``(2 joints,)`` [m^2].
        modulus: ``(2 joints,)`` [m^3] section modulus: mean second moment of area over the largest radius.
    """

    nodes: NDArray[np.integer]
    node_slot: NDArray[np.int64]
    cells: NDArray[np.integer]
    facets: NDArray[np.integer]
    facet_cell: NDArray[np.integer]
    facet_slot: NDArray[np.int64]
    facet_sign: NDArray[np.float64]
    centre: NDArray[np.float64]
    frame: NDArray[np.float64]
    area: NDArray[np.float64]
    modulus: NDArray[np.float64]

    def within(self, node_number: NDArray[np.int32], cell_number: NDArray[np.int32]) -> "PadFaces":
        """Return what a model has, in its numbers of nodes ``(n,)`` and cells ``(ne,)``, -1 for those of another."""
        nodes, cells, owners = node_number[self.nodes], cell_number[self.cells], cell_number[self.facet_cell]
        return replace(
            self,
            nodes=nodes[nodes >= 0],
            node_slot=self.node_slot[nodes >= 0],
            cells=cells[cells >= 0],
            facets=node_number[self.facets[owners >= 0]],
            facet_cell=owners[owners >= 0],
            facet_slot=self.facet_slot[owners >= 0],
            facet_sign=self.facet_sign[owners >= 0],
        )


def pad_faces(mesh: MeshData, joints: tuple[str, ...], solder: list[NDArray[np.intp]]) -> PadFaces:
    """Return the faces of joints whose solder elements are given.

    Raises:
        MeshError: A facet of a pad belongs to no solder element of its joint, or a pad has no facet.
    """
    faces = [
        pad_face(mesh, f"pad_{end}@{name}", cells, (1.0, -1.0)[ENDS.index(end)])
        for end in ENDS
        for name, cells in zip(joints, solder, strict=True)
    ]
    nodes, cells, facets, owners, signs, shapes = zip(*faces, strict=True) if faces else ((),) * 6
    slots, empty = np.arange(len(faces)), np.empty(0, np.int64)
    return PadFaces(
        nodes=np.concatenate([empty, *nodes]),
        node_slot=np.repeat(slots, [len(some) for some in nodes]),
        cells=np.concatenate([empty, *cells]),
        facets=np.concatenate([np.empty((0, 4), np.int32), *facets]),
        facet_cell=np.concatenate([empty, *owners]),
        facet_slot=np.repeat(slots, [len(some) for some in facets]),
        facet_sign=np.concatenate([np.empty(0), *signs]),
        centre=np.array([shape[0] for shape in shapes]).reshape(-1, 3),
        frame=np.array([shape[1] for shape in shapes]).reshape(-1, 3, 3),
        area=np.array([shape[2] for shape in shapes]),
        modulus=np.array([shape[3] for shape in shapes]),
    )


def pad_face(mesh: MeshData, name: str, solder: NDArray[np.intp], inward: float) -> tuple[Any, ...]:
    """Return nodes, bearing cells, facets, their cells and signs, and centre, frame, area, modulus of one face."""
    facets = mesh.facets_of(name)
    owner = cells_of_facets(mesh.cells[solder], facets)
    if not len(facets) or (owner < 0).any():
        joint = name.split("@")[1]
        raise MeshError(f"{name}: {np.sum(owner < 0)} of {len(facets)} facets belong to no element of solder@{joint}")
    nodes, owner = np.unique(facets), solder[owner]
    corners = mesh.points[facets]
    normal, centre, _ = facet_sums(corners)
    towards = mesh.points[mesh.cells[owner]].mean(axis=1) - corners.mean(axis=1)
    sign = inward * np.sign(np.einsum("fi,fi->f", normal, towards))
    bearing = solder[np.isin(mesh.cells[solder], nodes).any(axis=1)]
    area = np.linalg.norm(normal, axis=1)
    middle = centre.sum(axis=0) / area.sum()
    frame = section_frame(sign @ normal)
    radius = np.linalg.norm((mesh.points[nodes] - middle) @ frame[:2].T, axis=1).max()
    modulus = 0.5 * polar_moment((corners - middle) @ frame[:2].T) / radius
    return nodes, bearing, facets, owner, sign, (middle, frame, area.sum(), modulus)


def facet_sums(
    corners: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return area vector ``(f, 3)`` [m^2], area times centre ``(f, 3)`` [m^3] and area ``(f,)`` of facets."""
    normal = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    area = np.linalg.norm(normal, axis=1)
    first = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    second = np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 0]), axis=1)
    centres = corners[:, [0, 1, 2]].mean(axis=1), corners[:, [0, 2, 3]].mean(axis=1)
    share = (first / (first + second))[:, None]
    return normal, area[:, None] * (share * centres[0] + (1.0 - share) * centres[1]), area


def polar_moment(corners: NDArray[np.float64]) -> float:
    """Return the polar second moment of area [m^4] of plane facets ``(f, 4, 2)`` [m] about the origin."""
    total = 0.0
    for triangle in (corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]):
        first, second = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
        area = 0.5 * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
        squares = (triangle**2).sum(axis=(1, 2)) + (triangle.sum(axis=1) ** 2).sum(axis=1)
        total += float(area @ squares) / 12.0
    return total


def section_frame(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the frames ``(..., 3, 3)`` of faces with normals ``(..., 3)`` of any length; rows as in ``PadFaces``."""
    axis = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    along = np.where(np.abs(axis[..., :1]) < 0.9, np.eye(3)[0], np.eye(3)[1])
    first = along - np.sum(along * axis, axis=-1, keepdims=True) * axis
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return np.stack([first, np.cross(axis, first), axis], axis=-2)
