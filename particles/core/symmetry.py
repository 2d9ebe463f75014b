"""Planes of symmetry x = 0 and y = 0: only the part of a body with x >= 0 and y >= 0 is computed.

A plane of symmetry is a free-slip wall with a contact angle of 90 degrees, where adhesion gives no force. It contains
the origin, so its contribution to the volume integral of x . n vanishes. Clouds are cut at the planes, particles on a
plane stay on it, and contact lines are completed by their mirror images. Results refer to the whole body.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.particles.core.cloud import Cloud

Indices = NDArray[np.int64]


def cut(cloud: Cloud, axes: Sequence[int]) -> Cloud:
    """Keep the part of a cloud where the coordinates of some axes are not negative.

    Args:
        cloud: Cloud with at most one contact line, with particles on the planes and no triangle across one.
        axes: 0 for the plane x = 0, 1 for y = 0, or both in this order; without axes the cloud is returned whole.

    Returns:
        Cloud of the part, which lists the axes as its planes of symmetry; contact lines become arcs.
    """
    if not axes:
        return cloud
    is_inside = (cloud.points[:, list(axes)] >= 0.0).all(axis=1)
    number = np.cumsum(is_inside, dtype=np.int32) - np.int32(1)
    triangles = cloud.triangles[is_inside[cloud.triangles].all(axis=1)]
    rings = tuple(number[_arc(ring, is_inside)] for ring in cloud.rings)
    return replace(
        cloud,
        points=cloud.points[is_inside],
        surface_count=int(is_inside[: cloud.surface_count].sum()),
        triangles=number[triangles],
        rings=rings,
        wall=cloud.wall[is_inside],
        symmetry=tuple(axes),
    )


def _arc(ring: NDArray[np.int32], is_inside: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return the vertices of a closed line on the positive side of the planes, from end to end."""
    inside = is_inside[ring]
    first = int(np.flatnonzero(inside & ~np.roll(inside, 1))[0])
    return np.roll(ring, -first)[np.roll(inside, -first)]


def on_plane(cloud: Cloud, axis: int) -> NDArray[np.bool_]:
    """Return whether each particle of a cloud is on a plane of symmetry, shape (n,); it then stays there exactly.

    Args:
        cloud: Particles of the computed part of a body, cut off at the planes of symmetry that it lists.
        axis: 0 for the plane x = 0, 1 for y = 0.
    """
    return cloud.points[:, axis] == 0.0


def surface_planes(cloud: Cloud) -> list[tuple[int, NDArray[np.int32]]]:
    """Return the vertices of the free surface on each plane of symmetry.

    Args:
        cloud: Particles of the computed part of a body; an empty list is returned without planes of symmetry.

    Returns:
        For each plane: its axis (0 for x = 0, 1 for y = 0) and vertex numbers, shape (k,).
    """
    surface = {axis: on_plane(cloud, axis)[: cloud.surface_count] for axis in cloud.symmetry}
    return [(axis, np.flatnonzero(on).astype(np.int32)) for axis, on in surface.items()]


def share(cloud: Cloud) -> Floats:
    """Return the share of each particle in the computed part: 1/2 on a plane, 1/4 on both, else 1; shape (n,).

    The computed part is cut off at the planes of symmetry of the cloud; without planes all shares are 1.

    Args:
        cloud: Particles of the computed part.
    """
    result = np.ones(len(cloud.points))
    for axis in cloud.symmetry:
        result[on_plane(cloud, axis)] *= 0.5
    return result


def fold(cloud: Cloud, field: Floats, first: int = 0) -> Floats:
    """Return vectors without their normal components at particles on planes of symmetry, shape (k, 3).

    Args:
        cloud: Particles of the computed part of a body, cut off at the planes of symmetry that it lists.
        field: Vectors of any unit at consecutive particles, shape (k, 3); not changed.
        first: Number of the particle of the first vector.
    """
    result = field.copy()
    for axis in cloud.symmetry:
        result[on_plane(cloud, axis)[first : first + len(field)], axis] = 0.0
    return result


def unit(field: Floats) -> Floats:
    """Return vectors, shape (k, 3), each divided by its length; the argument is not changed."""
    return field / np.linalg.norm(field, axis=1)[:, None]


def whole_points(cloud: Cloud, points: Floats, wall: int) -> tuple[Floats, Indices]:
    """Return the points of the contact line of a wall around the whole body, and the vertex of each.

    Args:
        cloud: Particles of the computed part of a body, cut off at the planes of symmetry that it lists.
        points: Positions of its particles, shape (n, 3) [m].
        wall: Index of the contact line.

    Returns:
        Positions along the closed line, shape (m, 3) [m], and the index of each in the ring of the cloud, shape (m,).
    """
    ring = cloud.rings[wall]
    index, signs = whole_line(cloud, len(ring))
    return points[ring][index] * signs, index


def whole_line(cloud: Cloud, count: int) -> tuple[Indices, Floats]:
    """Return the closed contact line around the whole body as images of an arc with ``count`` vertices.

    Args:
        cloud: Particles of the computed part of a body, cut off at the planes of symmetry that it lists.
        count: Number of vertices of the arc; the line is the arc itself without planes of symmetry.

    Returns:
        Vertex of the arc for each vertex of the line, shape (m,), the arc first, and the signs of its coordinates,
        shape (m, 3).
    """
    index, signs = np.arange(count), np.ones((count, 3))
    for number, axis in enumerate(cloud.symmetry):
        last = number == len(cloud.symmetry) - 1
        back = slice(-2, 0, -1) if last else slice(-2, None, -1)
        image = signs[back].copy()
        image[:, axis] *= -1.0
        index, signs = np.concatenate((index, index[back])), np.concatenate((signs, image))
    return index, signs
