"""Area and volume of a triangulated free surface that ends on flat walls, and their gradients.

The liquid body is closed by the polygons of its contact lines, each of which lies in the plane of its wall.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.plate import Plate

# Isotropic share of the stiffness in ``area_stiffness``; the rest acts across each triangle.
ALL_WAYS = 0.7


@njit(cache=True)
def area_vector(points, i, j, k):
    """Return the normal (x, y, z) of a triangle, a tuple of scalars, with twice its area as length [m^2].

    Args:
        points: Positions, shape (n, 3) [m].
        i: Number of the first vertex, a scalar.
        j: Number of the second vertex; seen from the tip of the normal, vertices run counter-clockwise.
        k: Number of the third vertex.
    """
    ux, uy, uz = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    vx, vy, vz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@njit(cache=True)
def surface_area(points, triangles):
    """Return the total area of triangles, a scalar [m^2].

    Args:
        points: Positions, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).
    """
    total = 0.0
    for t in range(triangles.shape[0]):
        x, y, z = area_vector(points, triangles[t, 0], triangles[t, 1], triangles[t, 2])
        total += np.sqrt(x * x + y * y + z * z)
    return 0.5 * total


@njit(cache=True)
def triangle_areas(points, triangles):
    """Return the area of each triangle, shape (t,) [m^2].

    Args:
        points: Positions, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).
    """
    result = np.empty(triangles.shape[0])
    for t in range(triangles.shape[0]):
        x, y, z = area_vector(points, triangles[t, 0], triangles[t, 1], triangles[t, 2])
        result[t] = 0.5 * np.sqrt(x * x + y * y + z * z)
    return result


def area_gradient(points: Floats, triangles: Indices, weights: Floats | None = None) -> Floats:
    """Return the gradient of ``surface_area`` with respect to each point, shape (n, 3) [m].

    It equals K x with the stiffness matrix of ``cotangent_laplacian``; degenerate triangles contribute nothing.

    Args:
        points: Positions, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).
        weights: Factors of the areas of triangles, shape (t,); None for 1.
    """
    return _area_gradient(points, triangles, np.ones(len(triangles)) if weights is None else weights)


@njit(cache=True)
def _area_gradient(points, triangles, weights):
    """Return ``area_gradient`` with explicit weights, so that numba compiles one signature."""
    result = np.zeros_like(points)
    for t in range(triangles.shape[0]):
        x, y, z = area_vector(points, triangles[t, 0], triangles[t, 1], triangles[t, 2])
        size = np.sqrt(x * x + y * y + z * z)
        if size == 0.0:
            continue
        x, y, z = weights[t] * (0.5 * x / size), weights[t] * (0.5 * y / size), weights[t] * (0.5 * z / size)
        for k in range(3):
            i, j, m = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            ex, ey, ez = points[m, 0] - points[j, 0], points[m, 1] - points[j, 1], points[m, 2] - points[j, 2]
            result[i, 0] += y * ez - z * ey
            result[i, 1] += z * ex - x * ez
            result[i, 2] += x * ey - y * ex
    return result


@njit(cache=True)
def _volume_and_gradient(points, triangles, gradient):
    """Return the volume of the tetrahedra (origin, triangle) [m^3] and add its gradient to ``gradient``."""
    total = 0.0
    for t in range(triangles.shape[0]):
        for k in range(3):
            i, j, m = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            cx = points[j, 1] * points[m, 2] - points[j, 2] * points[m, 1]
            cy = points[j, 2] * points[m, 0] - points[j, 0] * points[m, 2]
            cz = points[j, 0] * points[m, 1] - points[j, 1] * points[m, 0]
            gradient[i, 0] += cx / 6.0
            gradient[i, 1] += cy / 6.0
            gradient[i, 2] += cz / 6.0
            if k == 0:
                total += (points[i, 0] * cx + points[i, 1] * cy + points[i, 2] * cz) / 6.0
    return total


@njit(cache=True)
def _wall_volume_and_gradient(points, ring, sixth, gradient):
    """Return the volume between the origin and the polygon of a ring [m^3] and add its gradient to ``gradient``.

    The tetrahedra span the origin, the mean of the ring and a segment. ``sixth`` is 1/6 with the sign of the side.
    """
    count = ring.shape[0]
    centre, normals = np.zeros(3), np.zeros(3)
    for k in range(count):
        a, b = points[ring[k]], points[ring[(k + 1) % count]]
        for d in range(3):
            centre[d] += a[d] / count
            normals[d] += a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3]
    for k in range(count):
        before, after = points[ring[k - 1]], points[ring[(k + 1) % count]]
        for d in range(3):
            e, f = (d + 1) % 3, (d + 2) % 3
            across = (after[e] - before[e]) * centre[f] - (after[f] - before[f]) * centre[e]
            gradient[ring[k], d] += sixth * (across + normals[d] / count)
    return sixth * (centre[0] * normals[0] + centre[1] * normals[1] + centre[2] * normals[2])


def ahead(values: NDArray[Any]) -> NDArray[Any]:
    """Return the values at the next vertices of a closed line, shape (k, ...) in and out; faster than ``np.roll``."""
    return np.concatenate((values[1:], values[:1]))


def behind(values: NDArray[Any]) -> NDArray[Any]:
    """Return the values at the previous vertices of a closed line, in order along it, shape (k, ...) in and out."""
    return np.concatenate((values[-1:], values[:-1]))


def _area_vector(points: Floats, ring: Indices) -> Floats:
    """Return the area vector of the polygon of a contact line, shape (3,) [m^2] (shoelace formula in space)."""
    x = points[ring] - points[ring].mean(axis=0)
    return 0.5 * np.cross(x, ahead(x)).sum(axis=0)


def ring_area(points: Floats, ring: Indices) -> float:
    """Return the area of the plane polygon that a contact line encloses, in a plane of any orientation [m^2].

    Args:
        points: Positions, shape (n, 3) [m].
        ring: Vertices of the contact line in order, counter-clockwise seen from +z, shape (k,).
    """
    return float(np.linalg.norm(_area_vector(points, ring)))


def ring_area_gradient(points: Floats, ring: Indices) -> Floats:
    """Return the gradient of ``ring_area`` with respect to the vertices of the ring, shape (k, 3) [m].

    Args:
        points: Positions, shape (n, 3) [m].
        ring: Vertices of the contact line in order, counter-clockwise seen from +z, shape (k,).
    """
    x, normal = points[ring], _area_vector(points, ring)
    normal /= np.linalg.norm(normal)
    return 0.5 * np.cross(ahead(x) - behind(x), normal)


def wall_corners(points: Floats, ring: Indices, plate: Plate) -> Floats:
    """Return the corners of outward triangles that close the body on a wall, shape (k, 3, 3) [m].

    The axes of the result are triangle, corner and coordinate.

    The triangles form a fan around the mean of the contact line.

    Args:
        points: Positions, shape (n, 3) [m].
        ring: Vertices of the contact line, shape (k,).
        plate: Wall of the contact line.
    """
    x = points[ring]
    after = ahead(x)
    centre = np.broadcast_to(x.mean(axis=0), x.shape)
    return np.stack((centre, x, after) if plate.side > 0.0 else (centre, after, x), axis=1)


def volume_and_gradient(
    points: Floats, triangles: Indices, rings: Sequence[Indices], plates: Sequence[Plate]
) -> tuple[float, Floats]:
    """Return the volume enclosed by the surface and the polygons of the contact lines, and its gradient.

    Divergence theorem: 3 V = integral of x . n over the free surface and over the walls. A wall has the position of its
    contact line, so the normal component of the gradient is the work of the pressure on a moving wall.

    Args:
        points: Positions, shape (n, 3) [m].
        triangles: Outward triangles of the free surface, shape (t, 3).
        rings: Vertices of each contact line in order, shape (k,) each; empty for a closed surface.
        plates: Wall of each contact line.

    Returns:
        Volume [m^3] and its gradient with respect to the points, shape (n, 3) [m^2].
    """
    gradient = np.zeros_like(points)
    volume = _volume_and_gradient(points, triangles, gradient)
    for ring, plate in zip(rings, plates, strict=True):
        volume += _wall_volume_and_gradient(points, ring, plate.side / 6.0, gradient)
    return volume, gradient


def centre_of_volume(points: Floats, triangles: Indices) -> Floats:
    """Return the centre of the volume in a closed surface, shape (3,) [m], by tetrahedra with the origin.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
    """
    corner = points[triangles]
    volumes = np.einsum("td,td->t", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) / 6.0
    return (volumes @ corner.sum(axis=1)) / (4.0 * volumes.sum())


@njit(cache=True)
def surface_flux(points, triangles, velocity):
    """Return the rate of the volume that each vertex of the surface sweeps, positive outwards, shape (k,) [m^3/s].

    It is a third of the area vectors of the vertex's triangles times its velocity; over a closed surface the sum is
    dV/dt.

    Args:
        points: Positions, shape (n, 3) [m].
        triangles: Outward triangles, shape (t, 3).
        velocity: Velocities of the first k points, shape (k, 3) [m/s].
    """
    flux = np.zeros(velocity.shape[0])
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t]
        x, y, z = area_vector(points, a, b, c)
        for v in (a, b, c):
            flux[v] += (x * velocity[v, 0] + y * velocity[v, 1] + z * velocity[v, 2]) / 6.0
    return flux


def enclosed_volume(points: Floats, triangles: Indices, rings: Sequence[Indices], plates: Sequence[Plate]) -> float:
    """Return the volume enclosed by the surface and the walls [m^3].

    Args:
        points: Positions, shape (n, 3) [m].
        triangles: Outward triangles of the free surface, shape (t, 3).
        rings: Vertices of each contact line, shape (k,) each; empty for a closed surface.
        plates: Wall of each contact line.
    """
    return volume_and_gradient(points, triangles, rings, plates)[0]


@njit(cache=True)
def cotangents(points, triangles):
    """Return the cotangent of the angle at each corner of each triangle, shape (t, 3).

    Args:
        points: Positions, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3); column c of the result belongs to corner c.
    """
    result = np.empty(triangles.shape)
    for t in range(triangles.shape[0]):
        for k in range(3):
            a, b, c = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            along = 0.0
            for d in range(3):
                along += (points[b, d] - points[a, d]) * (points[c, d] - points[a, d])
            x, y, z = area_vector(points, a, b, c)
            result[t, k] = along / np.sqrt(x * x + y * y + z * z)
    return result


def cotangent_laplacian(points: Floats, triangles: Indices, size: int) -> sparse.csr_matrix:
    """Return the dimensionless stiffness matrix K of the surface Laplacian, shape (size, size).

    K is symmetric and positive semidefinite; K x is exactly the gradient of the area of the triangulation
    (Pinkall & Polthier 1993).

    Args:
        points: Positions, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).
        size: Number of rows, larger than the largest vertex number; rows of other points are empty.
    """
    half = 0.5 * cotangents(points, triangles)
    i, j = np.roll(triangles, -1, axis=1).ravel(), np.roll(triangles, -2, axis=1).ravel()
    weight = half.ravel()
    rows = np.concatenate((i, j, i, j))
    columns = np.concatenate((j, i, i, j))
    values = np.concatenate((-weight, -weight, weight, weight))
    return sparse.csr_matrix((values, (rows, columns)), shape=(size, size))


def area_stiffness(points: Floats, triangles: Indices, count: int) -> sparse.bsr_matrix:
    """Return a positive approximation of the second derivative of the area, shape (3 count, 3 count), ordered by point.

    A share of ``cotangent_laplacian`` acts in all directions, the rest across each triangle: the area of a flat surface
    does not resist tangential motion, but edges resist in all directions. For oscillations of a ball at constant volume
    in mode n = 2, the stiffness is 0.99 times the second derivative (1.25 with the isotropic part alone, 0.38 without
    it); it is 1.14 times for n = 3 and 1 for waves of the grid.

    Args:
        points: Positions, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).
        count: Number of points on the surface, which come first.
    """
    starts, columns = _links(triangles, count)
    blocks = _resisting_blocks(points, triangles, 0.5 * cotangents(points, triangles), starts, columns)
    return sparse.bsr_matrix((blocks, columns, starts), shape=(3 * count, 3 * count))


@njit(cache=True)
def _links(triangles, count):
    """Return the points that share a triangle with each of ``count`` points, itself included, in ascending order.

    The result has the form of sparse rows: starts, shape (count + 1,), and columns.
    """
    room = np.ones(count + 1, np.int64)
    room[0] = 0
    for t in range(triangles.shape[0]):
        for k in range(3):
            room[triangles[t, k] + 1] += 2
    room = np.cumsum(room)
    found, ends = np.empty(room[count], np.int32), room[:-1] + 1
    for i in range(count):
        found[room[i]] = i
    for t in range(triangles.shape[0]):
        for k in range(3):
            own = triangles[t, k]
            for other in (triangles[t, k - 1], triangles[t, k - 2]):
                ends[own] = _inserted(found, room[own], ends[own], other)
    starts = np.zeros(count + 1, np.int32)
    starts[1:] = np.cumsum(ends - room[:-1])
    columns = np.empty(starts[count], np.int32)
    for i in range(count):
        columns[starts[i] : starts[i + 1]] = found[room[i] : ends[i]]
    return starts, columns


@njit(cache=True)
def _inserted(values, first, end, value):
    """Insert a value into the ascending values from ``first`` to ``end`` unless present; return the new end."""
    at = end
    while at > first and values[at - 1] > value:
        at -= 1
    if at > first and values[at - 1] == value:
        return end
    for m in range(end, at, -1):
        values[m] = values[m - 1]
    values[at] = value
    return end + 1


@njit(cache=True)
def _resisting_blocks(points, triangles, weights, starts, columns):
    """Return the blocks of ``area_stiffness`` at the entries (starts, columns) of its sparse rows, shape (k, 3, 3)."""
    blocks, own = np.zeros((columns.shape[0], 3, 3)), np.empty((3, 3))
    for t in range(triangles.shape[0]):
        x, y, z = area_vector(points, triangles[t, 0], triangles[t, 1], triangles[t, 2])
        size = np.sqrt(x * x + y * y + z * z)
        normal = (x / size, y / size, z / size)
        for c in range(3):
            for d in range(3):
                own[c, d] = (1.0 - ALL_WAYS) * normal[c] * normal[d]
            own[c, c] += ALL_WAYS
        for k in range(3):
            pair = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            for row in pair:
                for column in pair:
                    at = starts[row]
                    while columns[at] != column:
                        at += 1
                    sign = weights[t, k] if row == column else -weights[t, k]
                    for c in range(3):
                        for d in range(3):
                            blocks[at, c, d] += sign * own[c, d]
    return blocks
