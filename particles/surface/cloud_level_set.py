"""Particle clouds built from a level set: new surface and new interior particles for liquids that merge or separate."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.cloud import Cloud, equal_area_radius
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.core.surface_measure import volume_and_gradient
from reflowshock.particles.surface.level_set import LevelSet, extract_surface, smooth_on_level_set

# Least depth of an interior particle below the surface, in spacings.
DEPTH = 0.75
# Distance from the edge of a pad, in spacings, within which a contact line is put on the edge. The triangulation rounds
# the edge between a surface and its mirror image by less.
SNAP_SPACINGS = 0.5
# Newton steps until the surface encloses the volume.
VOLUME_PASSES = 4


class CannotRebuild(ValueError):
    """A common surface of these bodies and walls cannot be triangulated."""


@dataclass(frozen=True, slots=True)
class _Contact:
    """Contact line on a plate.

    Attributes:
        ring: Vertices of the line, shape (k,).
        plate: Plate under the line.
    """

    ring: Indices
    plate: Plate


def cloud_from_level_set(level: LevelSet, volume: float, walls: Sequence[Plate]) -> Cloud:
    """Fill a level set with particles at the spacing of its nodes.

    Args:
        level: Level set, negative in the liquid and symmetric about each wall; only the space between the walls is
            filled. If the liquid wets a wall in several places, or leaves dry spots, each contact line has its own
            plate. Lines near the edge of a pad are put on it.
        volume: Volume of the liquid, kept exactly [m^3].
        walls: Horizontal plates that the liquid stands on or hangs from, the lower one first.

    Returns:
        Particles, with the triangles of the free surface, contact lines, and a plate for each line.

    Raises:
        CannotRebuild: Contact lines meet in a point.
    """
    points, triangles = extract_surface(level)
    points, triangles = cut_at_walls(points, triangles, walls, 1e-6 * level.grid.spacing)
    contacts = [_Contact(ring, plate) for plate in walls for ring in _loops(points, triangles, plate)]
    rings, plates = tuple(contact.ring for contact in contacts), tuple(contact.plate for contact in contacts)
    points, triangles = smooth_on_level_set(level, points, triangles, rings)
    on_edge = [_snap(points, contact, level.grid.spacing) for contact in contacts]
    points = _with_volume(points, triangles, contacts, on_edge, volume)
    below = _interior(level, walls)
    wall = np.full(len(points) + len(below), -1, np.int8)
    for number, contact in reversed(list(enumerate(contacts))):
        wall[len(points) :][below[:, 2] == contact.plate.origin[2]] = number
        wall[contact.ring] = number
    particles = np.concatenate((points, below))
    return Cloud(particles, len(points), triangles, rings, plates, wall, level.grid.spacing)


def cut_at_walls(
    points: Floats, triangles: Indices, walls: Sequence[Plate], tolerance: float
) -> tuple[Floats, Indices]:
    """Keep the part of a surface on the liquid's side of each wall.

    Args:
        points: Vertices of a surface that is symmetric about the walls, shape (n, 3) [m]; changed in place.
        triangles: Triangles, shape (t, 3).
        walls: Horizontal plates.
        tolerance: Distance from a wall within which vertices are put exactly into it [m].

    Returns:
        Vertices (m, 3) [m] and triangles (s, 3) of that part.
    """
    inside = np.ones(len(points), bool)
    for plate in walls:
        height = plate.side * (points[:, 2] - plate.origin[2])
        inside &= height < tolerance
        points[np.abs(height) <= tolerance, 2] = plate.origin[2]
    remaining = triangles[inside[triangles].all(axis=1)]
    used, renumbered = np.unique(remaining, return_inverse=True)
    return points[used], renumbered.reshape(-1, 3).astype(np.int32)


def with_mirror_image(points: Floats, triangles: Indices) -> tuple[Floats, Indices]:
    """Return a surface that ends on the wall z = 0, closed by its mirror image behind it.

    Args:
        points: Vertices, shape (n, 3) [m]; those of contact lines at z = 0 are shared with the image.
        triangles: Triangles, shape (t, 3).

    Returns:
        Vertices, the given ones first, shape (m, 3) [m], and triangles, shape (2 t, 3).
    """
    image = len(points) + np.arange(len(points), dtype=np.int32)
    for loop in boundary_loops(triangles):
        image[loop] = loop
    return np.concatenate((points, points * [1.0, 1.0, -1.0])), np.concatenate((triangles, image[triangles][:, ::-1]))


def _loops(points: Floats, triangles: Indices, plate: Plate) -> list[Indices]:
    """Return the contact lines on a plate, those around liquid counter-clockwise seen from +z."""
    loops = boundary_loops(triangles)
    on_plate = [loop for loop in loops if points[loop[0], 2] == plate.origin[2]]
    return [loop if plate.side < 0.0 else loop[::-1].copy() for loop in on_plate]


def boundary_loops(triangles: Indices) -> tuple[Indices, ...]:
    """Return the closed loops of edges that belong to one triangle only.

    Args:
        triangles: Consistently oriented triangles, shape (t, 3).

    Returns:
        Vertices of each loop, shape (k,), in the sense of the edges of their triangles, the first one not repeated.

    Raises:
        CannotRebuild: Loops meet in a vertex.
    """
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)]).astype(np.int64)
    size = edges.max(initial=0) + 1
    forward, backward = edges @ (size, 1), edges @ (1, size)
    outer = edges[~np.isin(forward, backward)].tolist()
    after = dict(outer)
    if len(after) < len(outer) or set(after) != set(after.values()):
        raise CannotRebuild("contact lines of a new surface meet in a point; refine the spacing")
    loops = []
    while after:
        loop = [next(iter(sorted(after)))]
        while (following := after.pop(loop[-1])) != loop[0]:
            loop.append(following)
        loops.append(np.array(loop, np.int32))
    return tuple(loops)


def with_lids(points: Floats, triangles: Indices, rings: Sequence[Indices]) -> tuple[Floats, Indices]:
    """Close boundary loops of a surface by fans of triangles about their mean points.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).
        rings: Loops to close as vertices in order, shape (k,) each, as ``boundary_loops`` returns them.

    Returns:
        Vertices, shape (m, 3) [m], of which the last ones are the mean points, and triangles, shape (s, 3).
    """
    if not rings:
        return points, triangles
    middles = [points[ring].mean(axis=0) for ring in rings]
    lids = [
        np.stack((np.roll(ring, -1), ring, np.full_like(ring, middle)), axis=1)
        for middle, ring in enumerate(rings, len(points))
    ]
    return np.concatenate((points, middles)), np.concatenate((triangles, *lids)).astype(np.int32)


def _snap(points: Floats, contact: _Contact, spacing: float) -> Indices:
    """Move vertices of a contact line that are near the edge of a pad onto it; return these vertices."""
    ring, plate = contact.ring, contact.plate
    local, is_on_edge = plate.local(points[ring]), np.zeros(len(ring), bool)
    for pad in plate.pads:
        edge = equal_area_radius(pad.radius, pad.corners(spacing))
        offset = local[:, :2] - pad.centre
        radius = np.linalg.norm(offset, axis=1)
        near = np.abs(radius - edge) < SNAP_SPACINGS * spacing
        local[near, :2] = pad.centre + (edge / radius[near])[:, None] * offset[near]
        is_on_edge |= near
    points[ring] = plate.place(local)
    return ring[is_on_edge]


def _with_volume(
    points: Floats,
    triangles: Indices,
    contacts: Sequence[_Contact],
    on_edge: Sequence[Indices],
    volume: float,
) -> Floats:
    """Move the surface along its normals by one distance until it encloses the volume; vertices on edges stay."""
    rings, plates = [contact.ring for contact in contacts], [contact.plate for contact in contacts]
    for _ in range(VOLUME_PASSES):
        enclosed, gradient = volume_and_gradient(points, triangles, rings, plates)
        for ring in rings:
            gradient[ring, 2] = 0.0
        normal = gradient / np.linalg.norm(gradient, axis=1)[:, None]
        for fixed in on_edge:
            normal[fixed] = 0.0
        points = points + (volume - enclosed) / (gradient * normal).sum() * normal
    return points


def _interior(level: LevelSet, walls: Sequence[Plate]) -> Floats:
    """Return the lattice points deeper than ``DEPTH`` spacings, with layers on the walls, shape (m, 3) [m]."""
    axes, spacing = level.grid.axes(), level.grid.spacing
    heights = [plate.origin[2] for plate in walls]
    if len(walls) == 1:
        axes[2] = heights[0] - walls[0].side * spacing * np.arange(len(axes[2]))
    elif len(walls) == 2:
        axes[2] = np.linspace(heights[0], heights[1], 1 + round((heights[1] - heights[0]) / spacing))
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return lattice[level.at(lattice) < -DEPTH * spacing]


def area_within(line: Floats) -> float:
    """Return the area within a closed line (k, 3) [m] in a horizontal plane [m^2], negative if it runs clockwise."""
    x, y = line[:, 0], line[:, 1]
    return 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
