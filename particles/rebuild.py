"""Bodies made anew: two that touch become one, one whose triangles have collapsed gets even ones."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from particles.body import Body
from particles.cloud_level_set import cloud_from_level_set
from particles.level_set import Grid, LevelSet, signed_distance, smooth_union

Floats = NDArray[np.float64]
Indices = NDArray[np.int32]

CONTACT_SPACINGS = 1.0
NECK_SPACINGS = 2.5  # a gap narrower than half of this closes: wider than the contact distance, so a neck always forms
CLOSING_SPACINGS = 0.5
VELOCITY_NEIGHBOURS = 4
SHORTEST_EDGE = 0.25
LOWEST_QUALITY = 0.25


class CannotRebuild(ValueError):
    """Bodies on walls that a new surface cannot meet."""


def touch(first: Body, second: Body) -> bool:
    """Whether vertices of the two free surfaces are within a spacing of each other."""
    reach = CONTACT_SPACINGS * min(first.cloud.spacing, second.cloud.spacing)
    surfaces = [body.points[: body.cloud.surface_count] for body in (first, second)]
    distance, _ = cKDTree(surfaces[0]).query(surfaces[1], distance_upper_bound=reach)
    return bool(np.isfinite(distance).any())


def collapsing(body: Body) -> bool:
    """Whether triangles shrink to slivers (vertices crowd where liquid sinks), or contact lines of a body meet."""
    corner = body.points[body.triangles]
    square = ((corner - np.roll(corner, 1, axis=1)) ** 2).sum(axis=2)
    twice_area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    quality = 2.0 * np.sqrt(3.0) * twice_area / square.sum(axis=1)
    slivers = square.min() < (SHORTEST_EDGE * body.cloud.spacing) ** 2 or quality.min() < LOWEST_QUALITY
    return bool(slivers) or _contact_lines_meet(body)


def _contact_lines_meet(body: Body) -> bool:
    """Whether two contact lines of one body are within the closing distance."""
    points = [body.points[ring] for ring in body.cloud.rings]
    reach = CLOSING_SPACINGS * body.cloud.spacing
    pairs = combinations(points, 2)
    return any(np.isfinite(cKDTree(a).query(b, distance_upper_bound=reach)[0]).any() for a, b in pairs)


def rebuild(*bodies: Body) -> Body:
    """Make bodies one, with new particles, their volume and momentum; the pressures are those of a body at rest.

    Args:
        bodies: one body, or some that touch, all free or all on the wall z = 0.

    Raises:
        CannotRebuild: a body between two walls, on a wall elsewhere, or some free and some on a wall.
    """
    places = {_on_wall(body) for body in bodies}
    if len(places) > 1:
        raise CannotRebuild("a free drop and a drop on a wall cannot merge")
    spacing = min(body.cloud.spacing for body in bodies)
    surfaces = [closed_surface(body) for body in bodies]
    grid = Grid.around(np.concatenate([points for points, _ in surfaces]), spacing)
    union = smooth_union([signed_distance(*surface, grid) for surface in surfaces], NECK_SPACINGS * spacing)
    if any(_contact_lines_meet(body) for body in bodies):
        union = LevelSet(grid, union.values - CLOSING_SPACINGS * spacing)
    volume = sum(body.volume()[0] for body in bodies)
    result = Body.at_rest(cloud_from_level_set(union, volume, places.pop()))
    result.velocity = _common_velocity(result, bodies)
    return result


def closed_surface(body: Body) -> tuple[Floats, Indices]:
    """Closed surface of a body: points `(n, 3)` [m] and triangles; on a wall with its mirror image below."""
    count, triangles = body.cloud.surface_count, body.triangles
    points = body.points[:count]
    if not body.cloud.rings:
        return points.copy(), triangles
    image = count + np.arange(count, dtype=np.int32)
    for ring in body.cloud.rings:
        image[ring] = ring
    mirrored = points * np.array([1.0, 1.0, -1.0])
    return np.concatenate((points, mirrored)), np.concatenate((triangles, image[triangles][:, ::-1]))


def _on_wall(body: Body) -> bool:
    """Whether a body stands on the wall z = 0; else it is free."""
    if not body.plates:
        return False
    if any(plate.origin[2] != 0.0 or plate.normal[2] != 1.0 for plate in body.plates):
        raise CannotRebuild("only free drops and drops on the wall z = 0 can be rebuilt, not joints")
    return True


def _common_velocity(body: Body, parts: Sequence[Body]) -> Floats:
    """Velocities `(n, 3)` [m/s] of the nearest old particles, weighed by inverse distance, with the old momentum."""
    points = np.concatenate([part.points for part in parts])
    velocity = np.concatenate([part.velocity for part in parts])
    distance, nearest = cKDTree(points).query(body.points, VELOCITY_NEIGHBOURS)
    weight = 1.0 / np.maximum(distance, 1e-6 * body.cloud.spacing)
    new = (weight[..., None] * velocity[nearest]).sum(axis=1) / weight.sum(axis=1)[:, None]
    momentum = sum((part.volumes[:, None] * part.velocity).sum(axis=0) for part in parts)
    new += (momentum - (body.volumes[:, None] * new).sum(axis=0)) / body.volumes.sum()
    new[body.cloud.wall >= 0, 2] = 0.0
    return new
