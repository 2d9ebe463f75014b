"""Remeshing of a liquid's surface while it stretches, merges and breaks up.

A film that spreads over a wall is soon thinner than the cells of any background grid, so every few steps long edges are
split, short ones collapse, and triangles are smoothed along the surface, which loses nothing of it. Three events
rebuild the whole surface from its signed distance: two sheets come closer than a particle spacing (the gap is filled by
morphological closing), a foot on the wall becomes thinner than its particles while the liquid moves up (a rebound), or
the triangles are worn.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.grid import Grid
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.core.surface_measure import triangle_areas
from reflowshock.particles.core.winding_numbers import WindingNumbers
from reflowshock.particles.surface.breakup import find_small_parts
from reflowshock.particles.surface.cloud_level_set import (
    CannotRebuild,
    area_within,
    boundary_loops,
    cut_at_walls,
    with_lids,
    with_mirror_image,
)
from reflowshock.particles.surface.edge_changes import NewSurface, collapse_short, split_long
from reflowshock.particles.surface.level_set import LevelSet, extract_surface, signed_distance, smooth_on_level_set
from reflowshock.particles.surface.morphological_closing import TopologyChange, close_gaps, count_parts, narrowest_gap
from reflowshock.particles.surface.surface_mesh import TOUCH, SurfaceMesh
from reflowshock.particles.surface.surface_quality import flip_to_delaunay, smoothing_offsets, vertex_normals

# Edge length of the triangles, in particle spacings.
EDGE = 1.2
# Edges longer than the first multiple of it are split, edges shorter than the second collapse.
LONGEST, SHORTEST = 1.7, 0.4
# Range of the mean area of triangles over that of equilateral ones, and lowest quality, outside which they are worn.
AREAS, LOWEST_QUALITY = (0.5, 2.0), 0.1
# Cosine of the turn of a contact line at a vertex beyond which it bends more sharply than the kernel, two edges wide,
# can move it.
SHARPEST_TURN = 0.5
# Node spacing of the search for sheets that have crossed, in particle spacings.
OVERLAP = 0.25
# Number of particles of the smallest part that has a surface: two across, a sphere has four, a cube eight.
FEWEST = 8
# Share of the wetted area that a rebuilt surface may lack; one that lacks more has lost a film thinner than its cells.
LOST_FILM = 0.03
# Steps between two passes over the triangles.
INTERVAL = 10
# Largest number of passes that are waited after rebuilding failed; it doubles with each failure.
LONGEST_WAIT = 4
# In particle spacings: gaps narrower than the first are filled; a foot narrower than the second may leave the wall.
MERGE_GAP, FOOT = 1.0, 2.0
# Gaps that are filled when the surface is rebuilt, by reason, in particle spacings; wider ones are tried if contact
# lines would meet in a point. A negative one removes liquid that is thinner.
GAPS = {"meets": (2.0, 2.4, 2.8), "leaves": (-3.0,), "worn": (0.0,)}
WALL = Plate.horizontal(0.0)


@dataclass(slots=True)
class SurfaceRemeshing:
    """Remeshing of one surface: what was done so far, and when a failed attempt is repeated.

    Attributes:
        steps: Number of time steps.
        rebuilds: Number of attempts to rebuild the surface.
        waits: For each reason in ``GAPS`` the step from which on it is tried again, and the last wait in passes.
        topology_changes: Merged and separated liquids.
        detachments: Number of events in which parts too small for particles lost their surface.
    """

    steps: int = 0
    rebuilds: int = 0
    waits: dict[str, tuple[int, int]] = field(default_factory=dict)
    topology_changes: list[TopologyChange] = field(default_factory=list)
    detachments: int = 0

    def saved(self) -> dict[str, Any]:
        """Return all attributes, for a checkpoint."""
        return {
            "steps": self.steps, "rebuilds": self.rebuilds, "waits": dict(self.waits),
            "topology_changes": list(self.topology_changes), "detachments": self.detachments,
        }  # fmt: skip

    def restore(self, saved: dict[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self.steps, self.rebuilds, self.waits = saved["steps"], saved["rebuilds"], dict(saved["waits"])
        self.topology_changes, self.detachments = saved["topology_changes"], saved["detachments"]

    @property
    def is_due_next(self) -> bool:
        """Whether the next time step ends with a pass over the triangles."""
        return (self.steps + 1) % INTERVAL == 0

    @property
    def is_due(self) -> bool:
        """Whether this time step ends with a pass over the triangles."""
        return self.steps % INTERVAL == 0

    def remesh(self, mesh: SurfaceMesh, is_rising: bool, energy: Callable[[SurfaceMesh], float]) -> None:
        """Smooth the triangles, and rebuild the surface if there is a reason.

        Args:
            mesh: Surface, changed in place.
            is_rising: Whether the liquid moves up on average.
            energy: Returns the surface energy of a mesh [J].
        """
        _improve(mesh)
        reasons: dict[str, Callable[[], bool]] = {
            "meets": partial(has_narrow_gap, mesh),
            "leaves": partial(_leaves_wall, mesh, is_rising),
            "worn": partial(is_worn, mesh.points, mesh.triangles, mesh.rings, mesh.spacing),
        }
        for reason, applies in reasons.items():
            if self.steps >= self.waits.get(reason, (0, 1))[0] and applies():
                self.rebuild(mesh, reason, energy)
                return

    def rebuild(self, mesh: SurfaceMesh, reason: str, energy: Callable[[SurfaceMesh], float]) -> None:
        """Triangulate the surface from its signed distance, for one of the reasons in ``GAPS``."""
        parts, energy_before, gaps = count_parts(mesh.triangles), energy(mesh), GAPS[reason]
        _, wait = self.waits.get(reason, (0, 1))
        new = rebuild_from_distance(mesh.points, mesh.triangles, mesh.has_wall, mesh.spacing, gaps)
        wait = 1 if new else min(2 * wait, LONGEST_WAIT)
        self.rebuilds, self.waits[reason] = self.rebuilds + 1, (self.steps + wait * INTERVAL, wait)
        if new:
            mesh.replace(*new)
            if any(gaps) or count_parts(mesh.triangles) != parts:
                change = TopologyChange(self.steps, parts, count_parts(mesh.triangles), energy(mesh) - energy_before)
                self.topology_changes.append(change)

    def detach_small_parts(self, mesh: SurfaceMesh) -> float:
        """Remove the surface of parts that are too small for particles; return the volume they enclosed [m^3]."""
        is_small, volume = find_small_parts(mesh.points, mesh.triangles, FEWEST * mesh.spacing**3)
        if is_small.any():
            mesh.replace(mesh.points, mesh.triangles[~is_small])
            self.detachments += 1
        return volume


def _improve(mesh: SurfaceMesh) -> None:
    """Close dry spots, split and collapse edges, and smooth the triangles."""
    if closed := cover_dry_spots(mesh.points, mesh.triangles, mesh.rings, mesh.spacing):
        mesh.replace(*closed)
    try:
        for change in edge_changes(mesh.spacing):
            new = change(mesh.points, mesh.triangles, mesh.rings + mesh.ground_lines())
            if len(new.triangles) != len(mesh.triangles):
                mesh.replace(0.5 * (mesh.points[new.first] + mesh.points[new.second]), new.triangles)
        lines = mesh.rings + mesh.ground_lines()
        mesh.points, mesh.triangles = smooth_surface(mesh.points, mesh.triangles, mesh.rings, lines)
    except CannotRebuild:  # contact lines meet in a point: uneven triangles serve until these have separated
        return


def has_narrow_gap(mesh: SurfaceMesh) -> bool:
    """Return whether parts of a surface are closer than a particle spacing, measured outside the liquid.

    Args:
        mesh: Triangulated surface of a liquid with its particle spacing, and solid ground if there is one.
    """
    gap = MERGE_GAP * mesh.spacing
    on_ground = mesh.ground is not None
    normals = vertex_normals(mesh.points, mesh.triangles, len(mesh.points)) if on_ground else mesh.normals()
    return narrowest_gap(mesh.points, mesh.triangles, normals, gap, mesh.spacing) < gap


def _leaves_wall(mesh: SurfaceMesh, is_rising: bool) -> bool:
    """Return whether liquid rises from the wall on a foot that is too thin for its particles."""
    is_thin = 0.0 < mesh.wetted_area < 0.25 * np.pi * (FOOT * mesh.spacing) ** 2
    return is_thin and mesh.ground is None and is_rising


def edge_changes(spacing: float) -> Sequence[Callable[[Floats, Indices, Sequence[Indices]], NewSurface]]:
    """Return two functions: one splits long edges, one collapses short edges; both include edges of contact lines.

    Each takes vertices (n, 3) [m], triangles (t, 3) and contact lines, and returns the changed triangulation:
    triangles, contact lines, and the two old vertices whose mean each new vertex is.

    Args:
        spacing: Particle spacing, to which the limits of the lengths are proportional [m].
    """
    long, short = LONGEST * EDGE * spacing, SHORTEST * EDGE * spacing
    return partial(split_long, longest=long, on_rings=True), partial(collapse_short, shortest=short, on_rings=True)


def cover_dry_spots(
    points: Floats, triangles: Indices, rings: Sequence[Indices], spacing: float
) -> tuple[Floats, Indices] | None:
    """Cover dry spots of the wall that are smaller than a particle with a film.

    Args:
        points: Vertices, shape (m, 3) [m].
        triangles: Triangles, shape (t, 3).
        rings: Contact lines as vertices in order, shape (k,) each, clockwise around dry spots.
        spacing: Particle spacing [m].

    Returns:
        New vertices, shape (k, 3) [m], and triangles, shape (s, 3); None without such spots.
    """
    spots = [ring for ring in rings if -(spacing**2) < area_within(points[ring]) < 0.0]
    if not spots:
        return None
    points, triangles = with_lids(points, triangles, spots)
    for middle, ring in enumerate(spots, len(points) - len(spots)):
        points[ring, 2] = points[middle, 2] = TOUCH * spacing
    return points, triangles


def triangulate(level: LevelSet, has_wall: bool) -> tuple[Floats, Indices, tuple[Indices, ...]]:
    """Triangulate the zero level of a level set, above the wall z = 0 if there is one.

    Args:
        level: Level set, negative in the liquid.
        has_wall: Whether the surface is cut at the wall.

    Returns:
        Vertices (m, 3) [m], outward oriented triangles (t, 3) and contact lines, shape (k,) each.

    Raises:
        CannotRebuild: Contact lines meet in a point.
    """
    points, triangles = extract_surface(level)
    if has_wall:
        points, triangles = cut_at_walls(points, triangles, (WALL,), 1e-6 * level.grid.spacing)
    return points, triangles, boundary_loops(triangles)


def rebuild_from_distance(
    points: Floats, triangles: Indices, has_wall: bool, spacing: float, gaps: Sequence[float]
) -> tuple[Floats, Indices] | None:
    """Rebuild a surface from its signed distance, with narrow gaps filled.

    Args:
        points: Vertices, shape (m, 3) [m].
        triangles: Triangles, shape (t, 3).
        has_wall: Whether the surface ends on the wall z = 0.
        spacing: Particle spacing [m].
        gaps: Widths in particle spacings, tried in turn: narrower gaps are filled; a negative width removes liquid that
            is thinner; 0 keeps the shape.

    Returns:
        New vertices, shape (k, 3) [m], and triangles, shape (s, 3), for the first width that works; None if none does.
    """
    closed = with_mirror_image(points, triangles) if has_wall else (points, triangles)
    distance = signed_distance(*closed, Grid.around(closed[0], EDGE * spacing))
    wetted = sum(area_within(points[ring]) for ring in boundary_loops(triangles))
    for gap in gaps:
        level = close_gaps(distance, gap * spacing) if gap else distance
        try:
            new_points, new_triangles, lines = triangulate(level, has_wall)
        except CannotRebuild:  # contact lines merge or separate: worn triangles serve until they have
            continue
        wet = sum(area_within(new_points[ring]) for ring in lines)
        if gap < 0.0 or wet >= (1.0 - LOST_FILM) * wetted:
            return smooth_on_level_set(level, new_points, new_triangles, lines)
    return None


def smooth_surface(
    points: Floats, triangles: Indices, rings: Sequence[Indices], lines: Sequence[Indices]
) -> tuple[Floats, Indices]:
    """Smooth the triangles along the surface and flip edges; return new vertices (m, 3) [m] and triangles (t, 3).

    Args:
        points: Vertices, shape (m, 3) [m].
        triangles: Triangles, shape (t, 3).
        rings: Contact lines on the wall z = 0, whose sharp bends are blunted, as vertices in order, shape (k,) each.
        lines: All lines along which the surface has a sharp edge, as vertices in order, shape (k,) each, the contact
            lines included; their vertices move along them.
    """
    points = points + smoothing_offsets(points, triangles, len(points), lines)
    for ring in rings:
        points[ring] += _blunting(points[ring])
        points[ring, 2] = 0.0
    return points, flip_to_delaunay(points, triangles, lines)[0]


def _blunting(line: Floats) -> Floats:
    """Return the displacement of each sharply bent vertex of a closed line, shape (k, 3) [m].

    It is half the way to the middle of the two neighbours.
    """
    before, after = line - np.roll(line, 1, axis=0), np.roll(line, -1, axis=0) - line
    lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    is_sharp = (before * after).sum(axis=1) < SHARPEST_TURN * lengths
    return np.where(is_sharp[:, None], 0.25 * (after - before), 0.0)


def is_folded(points: Floats, triangles: Indices, spacing: float) -> bool:
    """Return whether sheets of a closed surface have crossed: a winding number is larger than 1 or negative.

    Args:
        points: Vertices, shape (m, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
        spacing: Particle spacing, which sets the grid of the winding numbers [m].
    """
    least, most = WindingNumbers.of(points, triangles, OVERLAP * spacing).bounds
    return most > 1 or least < 0


def is_worn(points: Floats, triangles: Indices, rings: Sequence[Indices], spacing: float) -> bool:
    """Return whether triangles are too small, too large or slivers, or a surface without contact lines is folded.

    Args:
        points: Vertices, shape (m, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
        rings: Contact lines as vertices in order, shape (k,) each; empty for a closed surface.
        spacing: Particle spacing, to which the size of triangles is compared [m].
    """
    if not rings and is_folded(points, triangles, spacing):
        return True
    corner = points[triangles]
    square = ((corner - np.roll(corner, 1, axis=1)) ** 2).sum(axis=(1, 2))
    area = triangle_areas(points, triangles)
    equilateral = np.sqrt(3.0) / 4.0 * (EDGE * spacing) ** 2
    low, high = AREAS
    return not low * equilateral < area.mean() < high * equilateral or bool(
        (4.0 * np.sqrt(3.0) * area / square).min() < LOWEST_QUALITY
    )
