"""The triangles of a liquid's surface, kept fit to carry it while it stretches: long edges are split, short ones go.

A film that spreads over a wall is soon thinner than the cells of any grid that would serve to triangulate it anew; so
its triangles are changed one by one, which loses nothing of it.
"""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.grid import Grid
from reflowshock.particles.core.neighbours import find_near
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.core.surface_measure import triangle_areas, volume_and_gradient
from reflowshock.particles.core.windings import Windings
from reflowshock.particles.sph import surface_loops
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.surface.closing import closed_level
from reflowshock.particles.surface.cloud_level_set import (
    CannotRebuild,
    area_within,
    between,
    boundary_loops,
    lidded,
    mirrored,
)
from reflowshock.particles.surface.edge_changes import NewSurface, collapse_short, split_long
from reflowshock.particles.surface.level_set import LevelSet, extract_surface, relax, signed_distance
from reflowshock.particles.surface.surface_quality import flip_to_delaunay, smoothing_offsets

# In spacings of the particles: edges of triangles.
EDGE = 1.2
# Of that: longer edges are split, shorter ones collapse.
LONGEST, SHORTEST = 1.7, 0.4
# Triangles are made anew where their mean area has left this range, over that at the start, or their quality this.
AREAS, LOWEST_QUALITY = (0.5, 2.0), 0.1
# Contact lines that turn by more at a vertex (the cosine) bend more sharply than what moves them can: the kernel is
# two edges wide.
SHARPEST_TURN = 0.5
# In spacings: triangles lower than the first above the wall are on it where they face it; a film thinner than the
# second is none.
TOUCH, DRY = 0.3, 0.1
# The same: how far beyond its particles the surface is at least (they may be a bit outside) and at most, its radius
# about one that it follows, and how far outside a vertex one is still its own, not one of other liquid before it.
COVER, CREST, OWN = (-0.25, 2.0), 1.5, 0.75
# The same: distance of the nodes at which sheets that have crossed are looked for.
OVERLAP = 0.25
# In particles: smaller parts are no liquid with a surface; two particles across, a sphere has four, a cube eight.
FEWEST = 8
# Of the vertices: with more that have no particle in reach, and follow the nearest one, it is not the liquid's surface
# any more. An impact of Weber number 1000 whose rim breaks up has 0.003 of them at most.
MOST_ALONE = 0.1
# Of the wetted area: a surface made anew on a grid, which lacks more of it, has lost a film thinner than its cells.
LOST_FILM = 0.03
# Cares that are let go, at most, after attempts at that in vain: their number doubles.
LONGEST_WAIT = 4
WALL = Plate.horizontal(0.0)


class SurfaceLost(ArithmeticError):
    """The liquid has left its surface, or that is none any more."""


def changes(spacing: float) -> Sequence[Callable[[Floats, Indices, Sequence[Indices]], NewSurface]]:
    """Return what splits edges that are too long and what collapses those that are too short, for a spacing [m]."""
    long, short = LONGEST * EDGE * spacing, SHORTEST * EDGE * spacing
    return partial(split_long, longest=long, on_rings=True), partial(collapse_short, shortest=short, on_rings=True)


def without_dry_spots(
    points: Floats, triangles: Indices, rings: Sequence[Indices], spacing: float
) -> tuple[Floats, Indices] | None:
    """Return points and triangles with a film over dry spots of the wall that are smaller than a particle; else None.

    Args: as `evened_out`; contact lines run clockwise about dry spots.
    """
    spots = [ring for ring in rings if -(spacing**2) < area_within(points[ring]) < 0.0]
    if not spots:
        return None
    points, triangles = lidded(points, triangles, spots)
    for middle, ring in enumerate(spots, len(points) - len(spots)):
        points[ring, 2] = points[middle, 2] = TOUCH * spacing
    return points, triangles


def triangulated(level: LevelSet, mirror: bool) -> tuple[Floats, Indices, tuple[Indices, ...]]:
    """Return points `(m, 3)` [m], triangles `(t, 3)` and contact lines of a level set, above a mirror in z = 0 or not.

    Raises:
        CannotRebuild: contact lines meet in a point.
    """
    points, triangles = extract_surface(level)
    if mirror:
        points, triangles = between(points, triangles, (WALL,), 1e-6 * level.grid.spacing)
    return points, triangles, boundary_loops(triangles)


def made_anew(
    points: Floats, triangles: Indices, mirror: bool, spacing: float, gaps: Sequence[float]
) -> tuple[Floats, Indices] | None:
    """Return points and triangles of the same surface from its distance, without gaps; None where it cannot be.

    Args:
        points: `(m, 3)` [m].
        triangles: `(t, 3)`.
        mirror: whether it ends on the wall z = 0.
        spacing: [m].
        gaps: in spacings; those narrower than the first of these that it can are closed. Negative: what is thinner
            goes. 0: the surface as it is.
    """
    closed = mirrored(points, triangles) if mirror else (points, triangles)
    distance = signed_distance(*closed, Grid.around(closed[0], EDGE * spacing))
    wetted = sum(area_within(points[ring]) for ring in boundary_loops(triangles))
    for gap in gaps:
        level = closed_level(distance, gap * spacing) if gap else distance
        try:
            new_points, new_triangles, lines = triangulated(level, mirror)
        except CannotRebuild:  # contact lines about to meet or to part: worn triangles serve until they have
            continue
        wet = sum(area_within(new_points[ring]) for ring in lines)
        if gap < 0.0 or wet >= (1.0 - LOST_FILM) * wetted:
            return relax(level, new_points, new_triangles, lines)
    return None


def outward_along(line: Floats) -> Floats:
    """Outward normals in the wall along a contact line `(k, 3)`, as long as the line about each vertex `(k, 2)` [m]."""
    along = np.roll(line, -1, axis=0) - np.roll(line, 1, axis=0)
    return 0.5 * np.stack((along[:, 1], -along[:, 0]), axis=1)


def cosines_of(bounds: tuple[float, float], outward: Floats, push: Floats, drift: Floats) -> Floats:
    """Cosines of the contact angle along a contact line `(k, 1)`, between those of advancing and receding angle.

    As dry friction does, the wall holds a line at rest against what pulls at it, the free surface and the pressure of a
    liquid at rest below it. A line that the liquid below drives on has the advancing or the receding angle, whatever
    pulls, if it is fast enough: times the velocity of `sliding` as the cosine of that angle is off balance, which is
    half of it for a line that has 90 degrees at rest and advances with 120. A slower one has an angle between.

    Args:
        bounds: both cosines.
        outward: `(k, 2)` normal in the wall, as long as the line about each vertex [m].
        push: `(k, 2)` forces on its vertices without that of the wall, over the surface tension [m].
        drift: `(k, 2)` velocities of its vertices, over that of `sliding`.
    """
    length = np.hypot(outward[:, 0], outward[:, 1])
    needed = -((push * outward).sum(axis=1) / length + (drift * outward).sum(axis=1)) / length
    return np.clip(needed, *bounds)[:, None]


def sliding(velocities: Floats, tension: float, law: Law) -> Floats:
    """Velocities along the wall `(m, 2)` of vertices `(m, 3)` [m/s], over that at which a line no longer is at rest.

    With this one, gamma / (rho h c), friction would stop the mass of a support, rho h^2 a unit of length, while sound
    crosses it: a step of a quarter of that takes a third of the velocity, and with more than all of it friction would
    not be stable. So it is of the spacing and of the speed of sound, and doubles where the spacing is halved: over that
    of an impact 0.38 at a Weber number of 1 with 10 particles a diameter, 0.026 at 30 with 10, 0.051 with 20.
    """
    return velocities[:, :2] * (law.rest_density * law.length * law.sound / tension)


def evened_out(
    points: Floats, triangles: Indices, rings: Sequence[Indices], lines: Sequence[Indices]
) -> tuple[Floats, Indices]:
    """Return points and triangles evened out along the surface.

    Args:
        points: `(m, 3)` [m].
        triangles: `(t, 3)`.
        rings: contact lines on the wall z = 0, whose sharp bends are blunted.
        lines: these and others along which the surface has an edge.
    """
    points = points + smoothing_offsets(points, triangles, len(points), lines)
    for ring in rings:
        points[ring] += _blunting(points[ring])
        points[ring, 2] = 0.0
    return points, flip_to_delaunay(points, triangles, lines)[0]


def _blunting(line: Floats) -> Floats:
    """Half the way to the middle of its neighbours for each vertex of a closed line `(k, 3)` that bends sharply [m]."""
    before, after = line - np.roll(line, 1, axis=0), np.roll(line, -1, axis=0) - line
    lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    is_sharp = (before * after).sum(axis=1) < SHARPEST_TURN * lengths
    return np.where(is_sharp[:, None], 0.25 * (after - before), 0.0)


def is_folded(points: Floats, triangles: Indices, spacing: float) -> bool:
    """Whether sheets of a surface have crossed: it winds round some liquid twice, or round air inside out."""
    least, most = Windings.of(points, triangles, OVERLAP * spacing).bounds
    return most > 1 or least < 0


def is_worn(points: Floats, triangles: Indices, rings: Sequence[Indices], spacing: float) -> bool:
    """Whether triangles are too small, too large or slivers; or folded, where they do not end on a wall."""
    if not rings and is_folded(points, triangles, spacing):
        return True
    corner = points[triangles]
    square = ((corner - np.roll(corner, 1, axis=1)) ** 2).sum(axis=(1, 2))
    area = triangle_areas(points, triangles)
    even = np.sqrt(3.0) / 4.0 * (EDGE * spacing) ** 2
    low, high = AREAS
    return not low * even < area.mean() < high * even or bool(
        (4.0 * np.sqrt(3.0) * area / square).min() < LOWEST_QUALITY
    )


def swelling(points: Floats, triangles: Indices, rings: Sequence[Indices], volume: float) -> Floats:
    """Return how vertices are to move `(m, 3)` [m], all as far along their normals, to enclose a volume [m^3].

    Args: as `evened_out`; contact lines move along the wall.
    """
    enclosed, gradient = volume_and_gradient(points, triangles, (), ())
    for ring in rings:
        gradient[ring, 2] = 0.0
    size = np.linalg.norm(gradient, axis=1)
    return (volume - enclosed) / size.sum() * gradient / np.maximum(size, 1e-300)[:, None]


def on_wall(points: Floats, triangles: Indices, spacing: float) -> NDArray[np.bool_]:
    """Whether each triangle has come down on the wall z = 0 `(t,)`.

    Liquid that faces the wall wets it. What faces away from it is a film, thin as it may be, until it is dry.
    """
    corner = points[triangles]
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    faces_wall = first[:, 0] * second[:, 1] < first[:, 1] * second[:, 0]
    return corner[:, :, 2].max(axis=1) <= np.where(faces_wall, TOUCH, DRY) * spacing


def strays(vertices: tuple[Floats, Floats], lists: tuple[Indices, Indices], fields: Fields, spacing: float) -> Floats:
    """Return how far vertices have to move outward to lie beyond their particles, and not far beyond them, `(m,)` [m].

    Args:
        vertices: points `(m, 3)` [m] and outward normals `(m, 3)`.
        lists: particles beside each vertex.
        fields: of the particles.
        spacing: of the particles [m].
    """
    cover = COVER[0] * spacing, COVER[1] * spacing, 0.5 / (CREST * spacing), OWN * spacing
    found = np.empty(len(vertices[0]))
    surface_loops.find_strays(vertices, lists, fields, cover, found)
    return found


def beside(vertices: Floats, particles: Floats, reach: float) -> tuple[Indices, Indices]:
    """Return offsets and indices of the particles within a reach [m] of each vertex, the nearest one where none is.

    Args:
        vertices: `(m, 3)` [m].
        particles: `(n, 3)` [m].
        reach: [m].
    """
    offsets, indices = find_near(vertices, particles, reach)
    is_alone = np.diff(offsets) == 0
    if is_alone.any():
        nearest = cKDTree(particles).query(vertices[is_alone])[1]
        indices = np.insert(indices, offsets[:-1][is_alone], nearest.astype(indices.dtype))
        offsets = offsets + np.concatenate(([0], np.cumsum(is_alone))).astype(offsets.dtype)
    return offsets, indices
