"""Clouds built from a level set: where liquids merge, the surface and the particles below it are made anew."""

from collections.abc import Sequence

import numpy as np

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.cloud import Cloud, equal_area_radius
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.core.surface_measure import volume_and_gradient
from reflowshock.particles.surface.level_set import LevelSet, extract_surface, relax

DEPTH = 0.75
SNAP_SPACINGS = 0.5  # the net rounds the edge between a surface and its mirror image by less
VOLUME_PASSES = 4


class CannotRebuild(ValueError):
    """Bodies on walls that a common surface cannot meet."""


def cloud_from_level_set(level: LevelSet, volume: float, walls: Sequence[Plate]) -> Cloud:
    """Fill a level set with particles a node spacing apart.

    Args:
        level: negative in the liquid, symmetric about each wall; only what is between the walls is filled. Where the
            liquid wets a wall in several places, or leaves dry spots, each of their contact lines has a plate. Lines
            near the edge of a pad are put on it.
        volume: volume of the liquid, kept exactly [m^3].
        walls: horizontal plates that the liquid stands on, hangs from, or both, the lower one first.
    """
    points, triangles = extract_surface(level)
    points, triangles = between(points, triangles, walls, 1e-6 * level.grid.spacing)
    contacts = [(ring, plate) for plate in walls for ring in _loops(points, triangles, plate)]
    rings, plates = tuple(ring for ring, _ in contacts), tuple(plate for _, plate in contacts)
    points, triangles = relax(level, points, triangles, rings)
    on_edge = [_snap(points, ring, plate, level.grid.spacing) for ring, plate in contacts]
    points = _with_volume(points, triangles, (rings, plates, on_edge), volume)
    below = _interior(level, walls)
    wall = np.full(len(points) + len(below), -1, np.int8)
    for number, (ring, plate) in reversed(list(enumerate(contacts))):
        wall[len(points) :][below[:, 2] == plate.origin[2]] = number
        wall[ring] = number
    everything = np.concatenate((points, below))
    return Cloud(everything, len(points), triangles, rings, plates, wall, level.grid.spacing)


def between(points: Floats, triangles: Indices, walls: Sequence[Plate], tolerance: float) -> tuple[Floats, Indices]:
    """Keep the part of a symmetric surface on the liquid's side of each wall, its edges exactly in the wall."""
    inside = np.ones(len(points), bool)
    for plate in walls:
        height = plate.side * (points[:, 2] - plate.origin[2])
        inside &= height < tolerance
        points[np.abs(height) <= tolerance, 2] = plate.origin[2]
    kept = triangles[inside[triangles].all(axis=1)]
    used, renumbered = np.unique(kept, return_inverse=True)
    return points[used], renumbered.reshape(-1, 3).astype(np.int32)


def mirrored(points: Floats, triangles: Indices) -> tuple[Floats, Indices]:
    """Return a surface that ends on the wall z = 0 with its image behind it: a closed one."""
    image = len(points) + np.arange(len(points), dtype=np.int32)
    for loop in boundary_loops(triangles):
        image[loop] = loop
    return np.concatenate((points, points * [1.0, 1.0, -1.0])), np.concatenate((triangles, image[triangles][:, ::-1]))


def _loops(points: Floats, triangles: Indices, plate: Plate) -> list[Indices]:
    """The contact lines on a plate, those around liquid counter-clockwise seen from +z."""
    loops = boundary_loops(triangles)
    on_plate = [loop for loop in loops if points[loop[0], 2] == plate.origin[2]]
    return [loop if plate.side < 0.0 else loop[::-1].copy() for loop in on_plate]


def boundary_loops(triangles: Indices) -> tuple[Indices, ...]:
    """Loops of the edges that belong to one triangle, in the sense of these triangles' edges, `(k,)` each.

    Raises:
        CannotRebuild: loops meet in a vertex.
    """
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)]).astype(np.int64)
    size = edges.max(initial=0) + 1
    there, back = edges @ (size, 1), edges @ (1, size)
    outer = edges[~np.isin(there, back)].tolist()
    after = dict(outer)
    if len(after) < len(outer) or set(after) != set(after.values()):
        raise CannotRebuild("contact lines of a new surface meet in a point: too coarse for its shape")
    loops = []
    while after:
        loop = [next(iter(sorted(after)))]
        while (following := after.pop(loop[-1])) != loop[0]:
            loop.append(following)
        loops.append(np.array(loop, np.int32))
    return tuple(loops)


def lidded(points: Floats, triangles: Indices, rings: Sequence[Indices]) -> tuple[Floats, Indices]:
    """Return points and triangles of a surface with lids on rings, as `boundary_loops` has them: fans about middles."""
    if not rings:
        return points, triangles
    middles = [points[ring].mean(axis=0) for ring in rings]
    lids = [
        np.stack((np.roll(ring, -1), ring, np.full_like(ring, middle)), axis=1)
        for middle, ring in enumerate(rings, len(points))
    ]
    return np.concatenate((points, middles)), np.concatenate((triangles, *lids)).astype(np.int32)


def _snap(points: Floats, ring: Indices, plate: Plate, spacing: float) -> Indices:
    """Put vertices of a contact line that are near the edge of a pad on it; return them."""
    local, caught = plate.local(points[ring]), np.zeros(len(ring), bool)
    for pad in plate.pads:
        edge = equal_area_radius(pad.radius, pad.corners(spacing))
        offset = local[:, :2] - pad.centre
        radius = np.linalg.norm(offset, axis=1)
        near = np.abs(radius - edge) < SNAP_SPACINGS * spacing
        local[near, :2] = pad.centre + (edge / radius[near])[:, None] * offset[near]
        caught |= near
    points[ring] = plate.place(local)
    return ring[caught]


def _with_volume(
    points: Floats,
    triangles: Indices,
    walls: tuple[tuple[Indices, ...], tuple[Plate, ...], list[Indices]],
    volume: float,
) -> Floats:
    """Move the surface along its normals by one distance until it encloses the volume, but not what is on an edge."""
    rings, plates, on_edge = walls
    for _ in range(VOLUME_PASSES):
        enclosed, gradient = volume_and_gradient(points, triangles, rings, plates)
        for ring in rings:
            gradient[ring, 2] = 0.0
        normal = gradient / np.linalg.norm(gradient, axis=1)[:, None]
        for held in on_edge:
            normal[held] = 0.0
        points = points + (volume - enclosed) / (gradient * normal).sum() * normal
    return points


def _interior(level: LevelSet, walls: Sequence[Plate]) -> Floats:
    """Points of a cubic lattice deeper than three quarters of a spacing, `(m, 3)` [m]; with walls, some are on them."""
    axes, spacing = level.grid.axes(), level.grid.spacing
    heights = [plate.origin[2] for plate in walls]
    if len(walls) == 1:
        axes[2] = heights[0] - walls[0].side * spacing * np.arange(len(axes[2]))
    elif len(walls) == 2:
        axes[2] = np.linspace(heights[0], heights[1], 1 + round((heights[1] - heights[0]) / spacing))
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return lattice[level.at(lattice) < -DEPTH * spacing]


def area_within(line: Floats) -> float:
    """Area within a closed line `(k, 3)` in a plane z = const. [m^2], negative where it runs clockwise."""
    x, y = line[:, 0], line[:, 1]
    return 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
