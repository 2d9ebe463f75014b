"""Bodies made anew: two that touch become one, one whose triangles have collapsed gets even ones."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.core.surface_measure import centre_of_volume
from reflowshock.particles.surface.cloud_level_set import CannotRebuild, cloud_from_level_set
from reflowshock.particles.surface.level_set import Grid, LevelSet, depths, signed_distance, smooth_union

CONTACT_SPACINGS = 1.0
NECK_SPACINGS = 2.5  # a gap narrower than half of this closes: wider than the contact distance, so a neck always forms
CLOSING_SPACINGS = 0.5
VELOCITY_NEIGHBOURS = 4
SHORTEST_EDGE = 0.25
LOWEST_QUALITY = 0.25


def touch(first: Body, second: Body) -> bool:
    """Whether vertices of the two free surfaces are within a spacing of each other."""
    reach = CONTACT_SPACINGS * min(first.cloud.spacing, second.cloud.spacing)
    surfaces = [body.points[: body.cloud.surface_count] for body in (first, second)]
    distance, _ = cKDTree(surfaces[0]).query(surfaces[1], distance_upper_bound=reach)
    return bool(np.isfinite(distance).any())


def overlap(first: Body, second: Body) -> float:
    """How deep particles of the second body are inside the first [m]; negative where none are."""
    return float(depths(second.points, closed_surface(first)).max())


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
        bodies: one body, or some that touch, all free, on the same wall, or between the same two walls.

    Raises:
        CannotRebuild: a wall is not horizontal, or the bodies are not on the same walls.
    """
    walls = _common_walls(bodies)
    spacing = min(body.cloud.spacing for body in bodies)
    inside = np.concatenate([body.points for body in bodies])
    grid = Grid.around(inside, spacing, [plate.origin[2] for plate in walls] or (0.0,))
    surfaces = [closed_surface(body) for body in bodies]
    union = smooth_union([signed_distance(*surface, grid) for surface in surfaces], NECK_SPACINGS * spacing)
    if any(_contact_lines_meet(body) for body in bodies):
        union = LevelSet(grid, union.values - CLOSING_SPACINGS * spacing)
    volume = sum(body.volume()[0] for body in bodies)
    result = Body.at_rest(cloud_from_level_set(union, volume, walls))
    if not walls:
        # A neck that is closed on one side shifts the centre; no force does.
        centres = [body.volume()[0] * centre_of_volume(body.points, body.triangles) for body in bodies]
        result.points += sum(centres) / volume - centre_of_volume(result.points, result.triangles)
    result.velocity = _common_velocity(result, bodies)
    return result


def closed_surface(body: Body) -> tuple[Floats, Indices]:
    """Surface of a body, with its mirror image behind each wall: points `(n, 3)` [m] and triangles.

    It is closed on one wall; between two it ends far behind them.
    """
    count, triangles = body.cloud.surface_count, body.triangles
    points, faces = [body.points[:count]], [triangles]
    for plate in _walls(body):
        image = count * len(points) + np.arange(count, dtype=np.int32)
        for ring, under in zip(body.cloud.rings, body.plates, strict=True):
            if under.side == plate.side:
                image[ring] = ring
        mirrored = points[0] * np.array([1.0, 1.0, -1.0]) + 2.0 * plate.origin * np.array([0.0, 0.0, 1.0])
        points.append(mirrored)
        faces.append(image[triangles][:, ::-1])
    return np.concatenate(points), np.concatenate(faces)


def _walls(body: Body) -> tuple[Plate, ...]:
    """The walls that a body is on, the lower one first; contact lines on the same wall have plates of their own."""
    if any(plate.normal[2] != 1.0 for plate in body.plates):
        raise CannotRebuild("only bodies on horizontal walls can be rebuilt")
    by_side = {plate.side: plate for plate in reversed(body.plates)}
    return tuple(by_side[side] for side in sorted(by_side))


def _common_walls(bodies: Sequence[Body]) -> tuple[Plate, ...]:
    """The walls of bodies that are to become one."""
    first, *others = [_walls(body) for body in bodies]
    places = [[(plate.side, plate.origin[2]) for plate in walls] for walls in (first, *others)]
    if any(place != places[0] for place in places[1:]):
        raise CannotRebuild("only bodies that are free, or on the same walls, can become one")
    return first


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
