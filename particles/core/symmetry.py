"""Planes of symmetry x = 0 and y = 0: the part of a body where x >= 0, y >= 0 stands for the whole.

Such a plane is a wall that is slid on freely and wetted at 90 degrees, where adhesion gives no force. It goes through
the origin, so that its part of the volume integral of x . n vanishes.

Clouds are cut there, what is on a plane stays on it, and contact lines are completed by their images. Results are those
of the whole body.
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
        cloud: with one contact line or none; particles where the planes are, and no triangle across one.
        axes: 0 for the plane x = 0, 1 for y = 0; both in this order; none leave the cloud whole.
    """
    if not axes:
        return cloud
    kept = (cloud.points[:, list(axes)] >= 0.0).all(axis=1)
    number = np.cumsum(kept, dtype=np.int32) - np.int32(1)
    triangles = cloud.triangles[kept[cloud.triangles].all(axis=1)]
    rings = tuple(number[_arc(ring, kept)] for ring in cloud.rings)
    return replace(
        cloud,
        points=cloud.points[kept],
        surface_count=int(kept[: cloud.surface_count].sum()),
        triangles=number[triangles],
        rings=rings,
        wall=cloud.wall[kept],
        symmetry=tuple(axes),
    )


def _arc(ring: NDArray[np.int32], kept: NDArray[np.bool_]) -> NDArray[np.int32]:
    """The kept vertices of a closed line, from end to end."""
    inside = kept[ring]
    first = int(np.flatnonzero(inside & ~np.roll(inside, 1))[0])
    return np.roll(ring, -first)[np.roll(inside, -first)]


def on_plane(cloud: Cloud, axis: int) -> NDArray[np.bool_]:
    """The particles on a plane of symmetry `(n,)`: they stay there exactly."""
    return cloud.points[:, axis] == 0.0


def surface_planes(cloud: Cloud) -> list[tuple[int, NDArray[np.int32]]]:
    """Axis of each plane of symmetry, and the vertices of the free surface on it."""
    surface = {axis: on_plane(cloud, axis)[: cloud.surface_count] for axis in cloud.symmetry}
    return [(axis, np.flatnonzero(on).astype(np.int32)) for axis, on in surface.items()]


def share(cloud: Cloud) -> Floats:
    """How much of each particle belongs to the part `(n,)`: half of one on a plane, a quarter of one on both."""
    result = np.ones(len(cloud.points))
    for axis in cloud.symmetry:
        result[on_plane(cloud, axis)] *= 0.5
    return result


def fold(cloud: Cloud, field: Floats, first: int = 0) -> Floats:
    """The part of a vector field `(k, 3)` along the planes of symmetry; it begins at a particle `first`."""
    result = field.copy()
    for axis in cloud.symmetry:
        result[on_plane(cloud, axis)[first : first + len(field)], axis] = 0.0
    return result


def unit(field: Floats) -> Floats:
    """Vectors `(k, 3)` of length one."""
    return field / np.linalg.norm(field, axis=1)[:, None]


def whole_points(cloud: Cloud, points: Floats, wall: int) -> tuple[Floats, Indices]:
    """The contact line of a wall around the whole body, and which vertex of the part each of its points is an image of.

    Args:
        cloud: of the part.
        points: `(n, 3)` where its particles are [m].
        wall: index of the contact line.
    """
    ring = cloud.rings[wall]
    index, signs = whole_line(cloud, len(ring))
    return points[ring][index] * signs, index


def whole_line(cloud: Cloud, count: int) -> tuple[Indices, Floats]:
    """The closed contact line around the whole body, of which the part has an arc of `count` vertices.

    Returns:
        For each of its vertices the one of the arc that it is or is an image of, `(m,)`, and the signs `(m, 3)` of the
        coordinates. The arc comes first.
    """
    index, signs = np.arange(count), np.ones((count, 3))
    for number, axis in enumerate(cloud.symmetry):
        last = number == len(cloud.symmetry) - 1
        back = slice(-2, 0, -1) if last else slice(-2, None, -1)
        image = signs[back].copy()
        image[:, axis] *= -1.0
        index, signs = np.concatenate((index, index[back])), np.concatenate((signs, image))
    return index, signs
