"""Tetrahedra between particles: connectivity, volumes and area vectors of linear shape functions."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from reflowshock.arrays import Floats, Indices

# Random displacement of the particles before tetrahedralisation, in spacings.
JITTER = 1e-5
# Volume over the mean volume below which a tetrahedron is too flat for a gradient.
SMALLEST_VOLUME = 0.1
# Faces of a tetrahedron, outward oriented.
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def tetrahedralise(points: Floats, spacing: float) -> Indices:
    """Return the Delaunay tetrahedra of a convex cloud, positively oriented, shape (t, 4).

    Regular clouds contain cospherical particles, whose flat tetrahedra have no orientation. Points are displaced at
    random for the tetrahedralisation only, which orients flat tetrahedra consistently with their neighbours, so that
    inner faces cancel.

    Args:
        points: Points, shape (n, 3) [m].
        spacing: Mean distance of neighbours [m].
    """
    shift = np.random.default_rng(0).uniform(-JITTER * spacing, JITTER * spacing, points.shape)
    cells = Delaunay(points + shift).simplices.astype(np.int32)
    inverted = cell_volumes(points + shift, cells) < 0.0
    cells[inverted] = cells[inverted][:, [0, 2, 1, 3]]
    return cells


def boundary_triangles(cells: Indices) -> Indices:
    """Return the faces that belong to one tetrahedron only, outward oriented, as vertex numbers, shape (f, 3).

    Args:
        cells: Vertex numbers of positively oriented tetrahedra, shape (t, 4).
    """
    faces = cells[:, FACES].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


def cell_volumes(points: Floats, cells: Indices) -> Floats:
    """Return the signed volumes of tetrahedra, shape (t,) [m^3].

    Args:
        points: Corners, shape (n, 3) [m].
        cells: Tetrahedra, shape (t, 4); negative orientation gives a negative volume.
    """
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    return np.einsum("td,td->t", edges[:, 0], np.cross(edges[:, 1], edges[:, 2])) / 6.0


def volume_gradients(points: Floats, cells: Indices) -> Floats:
    """Return the gradients of the volumes of tetrahedra with respect to their corners, shape (t, 4, 3) [m^2].

    They are the volume times the gradients of the linear shape functions.

    Args:
        points: Corners, shape (n, 3) [m].
        cells: Tetrahedra, shape (t, 4).
    """
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    inner = np.cross(np.roll(edges, -1, axis=1), np.roll(edges, -2, axis=1)) / 6.0
    return np.concatenate((-inner.sum(axis=1, keepdims=True), inner), axis=1)


def thick_cells(volumes: Floats) -> NDArray[np.int64]:
    """Return the numbers of the tetrahedra that are large enough for a gradient, shape (k,).

    Args:
        volumes: Volumes, shape (t,) [m^3]; small ones are so in relation to their mean.
    """
    return np.flatnonzero(volumes > SMALLEST_VOLUME * volumes.mean())
