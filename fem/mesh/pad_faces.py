"""Faces between pads and solder of joints in input numbers: nodes, area, frame and section modulus."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.mesh import MeshData, cells_of_facets

ENDS = ("board", "package")


@dataclass(frozen=True, slots=True)
class PadFaces:
    """Pad faces of all joints; slot = end * joints + joint, where end 0 is the board and end 1 the package.

    Attributes:
        nodes: Nodes of the faces, shape (p,).
        node_slot: Slot of each node, shape (p,).
        cells: Solder elements with a node on a face, shape (c,).
        facets: Nodes of the facets in cyclic order, shape (f, 4).
        facet_cell: Solder element of each facet, shape (f,).
        facet_slot: Slot of each facet, shape (f,).
        facet_sign: 1 if the nodes of a facet are ordered by the right-hand rule about the joint's axis, else -1, (f,).
        centre: Centroids of the faces, shape (2 joints, 3) [m].
        frame: Orthonormal frames of the faces, shape (2 joints, 3, 3); rows are two directions in the face and the
            axis of the joint, the normal from the board's pad towards the package's.
        area: Areas of the faces, shape (2 joints,) [m^2].
        modulus: Section moduli, mean second moment of area over the largest radius, shape (2 joints,) [m^3].
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
        """Return the part of one model in its own numbers.

        Args:
            node_number: Node number in the model of each input node, -1 if it belongs to another, shape (n,).
            cell_number: Cell number in the model of each input cell, -1 if it belongs to another, shape (ne,).
        """
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
    """Return the pad faces of joints, at which solder meets the pads of board and package.

    Args:
        mesh: Whole mesh.
        joints: Names of the joints.
        solder: Numbers of the solder elements of each joint, one array of shape (s,) per joint in the order of
            ``joints``.

    Returns:
        Faces at the board and package end of each joint: nodes, facets with their solder elements, centroids [m],
        orthonormal frames, areas [m^2] and section moduli [m^3].

    Raises:
        MeshError: A facet of a pad belongs to no solder element of its joint, or a pad has no facet.
    """
    faces = [
        _pad_face(mesh, f"pad_{end}@{name}", cells, (1.0, -1.0)[ENDS.index(end)])
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


def _pad_face(mesh: MeshData, name: str, solder: NDArray[np.intp], inward: float) -> tuple[Any, ...]:
    """Return nodes, adjacent cells, facets, their cells and signs, and (centre, frame, area, modulus) of one face."""
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
    adjacent = solder[np.isin(mesh.cells[solder], nodes).any(axis=1)]
    area = np.linalg.norm(normal, axis=1)
    middle = centre.sum(axis=0) / area.sum()
    frame = section_frame(sign @ normal)
    radius = np.linalg.norm((mesh.points[nodes] - middle) @ frame[:2].T, axis=1).max()
    modulus = 0.5 * polar_moment((corners - middle) @ frame[:2].T) / radius
    return nodes, adjacent, facets, owner, sign, (middle, frame, area.sum(), modulus)


def facet_sums(
    corners: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return area vectors and first moments of quadrilateral facets.

    Args:
        corners: Corners of the facets in cyclic order, shape (f, 4, 3) [m].

    Returns:
        Area vectors, shape (f, 3) [m^2], with the normal by the right-hand rule; areas times centroids, shape (f, 3)
        [m^3]; and areas, shape (f,) [m^2].
    """
    normal = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    area = np.linalg.norm(normal, axis=1)
    first = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    second = np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 0]), axis=1)
    centres = corners[:, [0, 1, 2]].mean(axis=1), corners[:, [0, 2, 3]].mean(axis=1)
    share = (first / (first + second))[:, None]
    return normal, area[:, None] * (share * centres[0] + (1.0 - share) * centres[1]), area


def polar_moment(corners: NDArray[np.float64]) -> float:
    """Return the polar second moment of area of all facets together about the origin [m^4].

    Args:
        corners: Corners of plane facets in cyclic order, in coordinates of the plane, shape (f, 4, 2) [m].
    """
    total = 0.0
    for triangle in (corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]):
        first, second = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
        area = 0.5 * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
        squares = (triangle**2).sum(axis=(1, 2)) + (triangle.sum(axis=1) ** 2).sum(axis=1)
        total += float(area @ squares) / 12.0
    return total


def section_frame(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return right-handed orthonormal frames of faces, shape (..., 3, 3).

    Their rows are two directions in the face, and the normal. The first direction is the projection of x into the face,
    or of y if the normal is nearly along x.

    Args:
        normal: Normals of any length above zero, shape (..., 3).
    """
    axis = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    along = np.where(np.abs(axis[..., :1]) < 0.9, np.eye(3)[0], np.eye(3)[1])
    first = along - np.sum(along * axis, axis=-1, keepdims=True) * axis
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return np.stack([first, np.cross(axis, first), axis], axis=-2)
