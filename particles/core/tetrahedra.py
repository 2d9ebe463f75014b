"""Tetrahedra between particles: connectivity, volumes and area vectors of linear shape functions."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from reflowshock.arrays import Floats, Indices

JITTER = 1e-5
# Flat tetrahedra have no gradient worth the name.
SMALLEST_VOLUME = 0.1
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def tetrahedralise(points: Floats, spacing: float) -> Indices:
    """Delaunay tetrahedra of a convex cloud, `(t, 4)`, positively oriented.

    Regular clouds hold cospherical particles, whose flat tetrahedra have no orientation of their own; a jitter that is
    forgotten afterwards gives them one that fits their neighbours', so that inner faces cancel.

    Args:
        points: `(n, 3)` [m].
        spacing: mean distance of neighbours [m].
    """
    shift = np.random.default_rng(0).uniform(-JITTER * spacing, JITTER * spacing, points.shape)
    cells = Delaunay(points + shift).simplices.astype(np.int32)
    inverted = cell_volumes(points + shift, cells) < 0.0
    cells[inverted] = cells[inverted][:, [0, 2, 1, 3]]
    return cells


def boundary_triangles(cells: Indices) -> Indices:
    """Faces that belong to one tetrahedron only, `(f, 3)`, outward oriented."""
    faces = cells[:, FACES].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


def cell_volumes(points: Floats, cells: Indices) -> Floats:
    """Signed volumes of the tetrahedra, `(t,)` [m^3]."""
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    return np.einsum("td,td->t", edges[:, 0], np.cross(edges[:, 1], edges[:, 2])) / 6.0


def volume_gradients(points: Floats, cells: Indices) -> Floats:
    """Gradients of the volumes with respect to the corners, `(t, 4, 3)` [m^2]: volume times shape gradient."""
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    inner = np.cross(np.roll(edges, -1, axis=1), np.roll(edges, -2, axis=1)) / 6.0
    return np.concatenate((-inner.sum(axis=1, keepdims=True), inner), axis=1)


def thick_cells(volumes: Floats) -> NDArray[np.int64]:
    """The tetrahedra, by their volumes `(t,)`, in which a gradient can be taken."""
    return np.flatnonzero(volumes > SMALLEST_VOLUME * volumes.mean())
