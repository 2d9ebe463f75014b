"""Surface tension and wetting: a triangulated surface that the particles carry, and the forces of its energy on them.

E = gamma (A_free - cos(theta) A_wet). Vertices move with the particles beside them and hand their forces -dE/dx on to
them by the same weights (`surface_loops.py`): what the surface loses, the particles gain, so that a drop comes to rest.
The contact angle is nowhere set: it is the balance of the forces on the contact line.

Particles at a free surface lack neighbours, and what their pressure transmits ends below the surface, by a depth of
`DEPTH` smoothing lengths: in a sphere it balances tension on the surface only if it is too high by 2 x depth / R, at
any resolution. The tension that acts is therefore gamma (1 - depth x mean curvature), of the whole surface; wetting
acts as it is, which the balance of a cap asks for. DEPTH was found once, with spheres of 12 particles an edge of the
cube of their volume and the cubic spline; it is no parameter of a case, and the depth vanishes with the spacing.

A part that comes down on the wall becomes wet. Triangles are evened out along the surface every few steps; where they
have shrunk or grown too much, the surface is made anew from its distance, and then it may also part or leave the wall.
Parts that come as near to each other as particles stand, of two drops or of one, become one: the gap between them is
closed (`surface/closing.py`), volume is restored, particles and their momentum are not touched.

On solid particles (`solids`) the surface stays closed: where it lies on them its tension is -gamma cos(theta) in place
of gamma, which makes the contact angle there. How much that is of a vertex is renewed when triangles are evened out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.neighbours import find_neighbours
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.core.surface_measure import area_gradient, surface_area, triangle_areas, volume_and_gradient
from reflowshock.particles.sph import surface_loops
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.smoothing import SUPPORT
from reflowshock.particles.surface.closing import closed_level, narrowest_gap, parts_of
from reflowshock.particles.surface.cloud_level_set import CannotRebuild, between, boundary_loops
from reflowshock.particles.surface.level_set import Grid, extract_surface, relax, signed_distance
from reflowshock.particles.surface.surface_quality import flip_to_delaunay, smoothing_offsets, vertex_normals

# Of the smoothing length: how far below the surface pressure ends.
DEPTH = 0.187
# In spacings of the particles: edges of triangles, the skin of the lists.
EDGE, SKIN = 1.2, 0.5
# The same: triangles lower than this above the wall are on it; no air is followed that would have to leave.
TOUCH = 0.3
# The same: gaps narrower than the first close, and with them all that are narrower than the second; wider ones are
# tried where contact lines would meet in a point.
MEETING, CLOSED = 1.0, (2.0, 2.4, 2.8)
# The same: from this distance to a solid particle on a vertex starts to be wet, and is nearer than that.
DRY, WET = 1.3, 0.7
# Steps after which triangles are evened out.
CARE = 10
# Triangles are made anew where their mean area has left this range, over that at the start, or their quality this.
AREAS, LOWEST_QUALITY = (0.5, 2.0), 0.1
WALL = Plate.horizontal(0.0)


@dataclass(frozen=True, slots=True)
class Meeting:
    """Liquids that merged or parted: the step, parts of the surface before and after, change of surface energy [J]."""

    step: int
    before: int
    after: int
    energy: float


class SurfaceLost(ArithmeticError):
    """Vertices of the surface have no particles beside them: the liquid has left it."""


@dataclass(slots=True)
class LiquidSurface:
    """The free surface of a liquid, closed by the wall z = 0 where there is one.

    Attributes:
        points: `(m, 3)` [m].
        triangles: `(t, 3)`, outward oriented.
        tension: gamma [N/m].
        cosine: of the contact angle.
        law: of the particles.
        rings: contact lines, anticlockwise about liquid, as vertices `(k,)`; found where triangles end.
        moves: number of steps.
        rebuilds: how often it was made anew.
        solids: `(k, 3)` particles that do not move and are not the liquid's, on which it may lie [m].
        wetness: `(m,)` how much of each vertex is on them, 0 to 1.
        meetings: liquids that merged or parted.
    """

    points: Floats
    triangles: Indices
    tension: float
    cosine: float
    law: Law
    rings: tuple[Indices, ...] = field(init=False)
    moves: int = 0
    rebuilds: int = 0
    solids: Floats = field(default_factory=lambda: np.empty((0, 3)))
    wetness: Floats = field(default_factory=lambda: np.empty(0))
    meetings: list[Meeting] = field(default_factory=list)
    _built_at: Floats = field(default_factory=lambda: np.empty((0, 3)))
    _lists: tuple[Indices, Indices] = field(default_factory=lambda: (np.zeros(1, np.int32), np.empty(0, np.int32)))
    _shares: Floats = field(default_factory=lambda: np.empty((2, 0)))

    def __post_init__(self) -> None:
        self.rings = boundary_loops(self.triangles)
        self._find_wetness()

    def saved(self) -> dict[str, Any]:
        """All of it, for a checkpoint."""
        return {
            "points": self.points, "triangles": self.triangles, "rings": list(self.rings), "moves": self.moves,
            "rebuilds": self.rebuilds, "built_at": self._built_at, "shares": self._shares, "solids": self.solids,
            "wetness": self.wetness, "meetings": list(self.meetings),
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        self.points, self.triangles, self.rings = saved["points"], saved["triangles"], tuple(saved["rings"])
        self.moves, self.rebuilds = saved["moves"], saved["rebuilds"]
        self._built_at, self._shares = saved["built_at"], saved["shares"]
        self.solids, self.wetness, self.meetings = saved["solids"], saved["wetness"], saved["meetings"]
        self._list(self._built_at)

    @property
    def volume(self) -> float:
        """What it encloses with the wall [m^3]."""
        return volume_and_gradient(self.points, self.triangles, (), ())[0]

    @property
    def wetted_area(self) -> float:
        """Area within the contact lines [m^2]."""
        return sum(_area_within(self.points[ring]) for ring in self.rings)

    @property
    def energy(self) -> float:
        """E [J], of the triangles themselves."""
        if not len(self.solids):
            return self.tension * (surface_area(self.points, self.triangles) - self.cosine * self.wetted_area)
        areas = triangle_areas(self.points, self.triangles)
        return self.tension * float(areas @ self._shares_of_tension() - self.cosine * self.wetted_area)

    def _shares_of_tension(self) -> Floats:
        """What acts of the tension in each triangle `(t,)`: all where it is free, -cos(theta) on solids."""
        return 1.0 - (1.0 + self.cosine) * self.wetness[self.triangles].mean(axis=1)

    def _find_wetness(self) -> None:
        if not len(self.solids):
            self.wetness = np.zeros(len(self.points))
            return
        distance, _ = cKDTree(self.solids).query(self.points, distance_upper_bound=DRY * self.law.spacing)
        self.wetness = np.clip((DRY - distance / self.law.spacing) / (DRY - WET), 0.0, 1.0)

    def add_to(self, rates: Floats, fields: Fields, fluids: int) -> None:
        """Add the accelerations that it gives the particles to rows 1 to 3 of their rates `(10, n)`.

        Raises:
            SurfaceLost: there are no particles beside a vertex.
        """
        self._update_lists(np.array(fields[:3])[:, :fluids])
        self._shares = np.empty((2, len(self._lists[1])))
        surface_loops.find_shares(self.points, self._lists, fields, self.law, self._shares)
        starts = self._lists[0][:-1]
        if (np.diff(self._lists[0]) == 0).any() or not np.add.reduceat(self._shares[0], starts).all():
            raise SurfaceLost("the liquid has left its surface")
        surface_loops.share_forces(self._lists, self._shares, self.forces(), fields.mass, rates)

    def forces(self) -> Floats:
        """Forces -dE/dx on the vertices `(m, 3)` [N]; those of contact lines along the wall, which holds them."""
        weights = self._shares_of_tension() if len(self.solids) else None
        steep = area_gradient(self.points, self.triangles, weights)
        tension = self.tension * (1.0 - DEPTH * self.law.length * self._mean_curvature(steep))
        result = -tension * steep
        for ring in self.rings:
            along = np.roll(self.points[ring], -1, axis=0) - np.roll(self.points[ring], 1, axis=0)
            pull = 0.5 * self.tension * self.cosine
            result[ring, 0] += pull * along[:, 1]
            result[ring, 1] -= pull * along[:, 0]
            result[ring, 2] = 0.0
        return result

    def _mean_curvature(self, steep: Floats) -> float:
        """Mean over the surface of the sum of its curvatures [1/m]; ``steep`` is the gradient of the area."""
        _, outward = volume_and_gradient(self.points, self.triangles, (), ())
        for ring in self.rings:
            outward[ring] = 0.0
        area = np.linalg.norm(outward, axis=1)
        normals = outward / np.maximum(area, 1e-300)[:, None]
        return float((steep * normals).sum() / area.sum())

    def move(self, velocity: Floats, time_step: float, volume: float) -> None:
        """Move with the velocities of the particles `(3, n)` [m/s] over a time step [s].

        Args:
            velocity: of the particles.
            time_step: over which.
            volume: of the liquid [m^3], which the surface encloses after its triangles were evened out.
        """
        surface_loops.carry(self._lists, self._shares, velocity, time_step, self.points)
        self.moves += 1
        if self.law.mirror:
            self._wet()
        if self.moves % CARE == 0:
            self._even_out()
            if self._meets():
                self._make_anew(CLOSED)
            elif self._is_worn():
                self._make_anew()
            self.enclose(volume)
            self._find_wetness()

    def _update_lists(self, liquid: Floats) -> None:
        """Find the particles beside each vertex again when either has moved half the skin."""
        together = np.concatenate((liquid.T, self.points))
        if len(together) == len(self._built_at):
            moved = ((together - self._built_at) ** 2).sum(axis=1).max()
            if moved <= (0.5 * SKIN * self.law.spacing) ** 2:
                return
        self._list(together)

    def _list(self, together: Floats) -> None:
        self._built_at = together
        reach = SUPPORT * self.law.length + SKIN * self.law.spacing
        self._lists = surface_loops.rows_of_vertices(
            *find_neighbours(together, reach), len(together) - len(self.points)
        )

    def _wet(self) -> None:
        """Keep vertices above the wall, contact lines on it; triangles that have come down on it are wet."""
        for ring in self.rings:
            self.points[ring, 2] = 0.0
        np.maximum(self.points[:, 2], 0.0, out=self.points[:, 2])
        flat = np.flatnonzero((self.points[self.triangles, 2] <= TOUCH * self.law.spacing).all(axis=1))
        if len(flat) and not self._take(self.points, np.delete(self.triangles, flat, axis=0)):
            for triangle in flat[::-1]:
                self._take(self.points, np.delete(self.triangles, triangle, axis=0))

    def _take(self, points: Floats, triangles: Indices) -> bool:
        """Become these triangles, with the vertices that they have; stay as it is where contact lines would meet."""
        used, numbers = np.unique(triangles, return_inverse=True)
        triangles = numbers.reshape(-1, 3).astype(np.int32)
        try:
            rings = boundary_loops(triangles)
        except CannotRebuild:
            return False
        self.points, self.triangles, self.rings = points[used], triangles, rings
        for ring in self.rings:
            self.points[ring, 2] = 0.0
        self._built_at = np.empty((0, 3))
        self._lists = np.zeros(len(self.points) + 1, np.int32), np.empty(0, np.int32)
        self._find_wetness()
        return True

    def _even_out(self) -> None:
        self.points += smoothing_offsets(self.points, self.triangles, len(self.points), self.rings)
        for ring in self.rings:
            self.points[ring, 2] = 0.0
        self.triangles, _ = flip_to_delaunay(self.points, self.triangles, self.rings)

    def _is_worn(self) -> bool:
        """Whether triangles are too small, too large or slivers."""
        corner = self.points[self.triangles]
        square = ((corner - np.roll(corner, 1, axis=1)) ** 2).sum(axis=(1, 2))
        area = triangle_areas(self.points, self.triangles)
        even = np.sqrt(3.0) / 4.0 * (EDGE * self.law.spacing) ** 2
        low, high = AREAS
        return not low * even < area.mean() < high * even or bool(
            (4.0 * np.sqrt(3.0) * area / square).min() < LOWEST_QUALITY
        )

    def _meets(self) -> bool:
        """Whether parts of it have come as near to each other as particles stand; across the wall none meet."""
        spacing, normals = self.law.spacing, vertex_normals(self.points, self.triangles, len(self.points))
        for ring in self.rings:  # where it meets its image
            normals[ring, 2] = 0.0
            normals[ring] /= np.linalg.norm(normals[ring], axis=1)[:, None]
        return narrowest_gap(self.points, normals, MEETING * spacing, spacing) < MEETING * spacing

    def _make_anew(self, gaps: Sequence[float] = (0.0,)) -> None:
        """Triangulate the same surface anew, without gaps narrower than the first of `gaps` [spacings] that it can."""
        self.rebuilds += 1
        before, energy, closed = parts_of(self.triangles), self.energy, self._closed()
        grid = Grid.around(closed[0], EDGE * self.law.spacing)
        for gap in gaps:
            level = closed_level(*closed, grid, gap * self.law.spacing) if gap else signed_distance(*closed, grid)
            points, triangles = extract_surface(level)
            if self.law.mirror:
                points, triangles = between(points, triangles, (WALL,), 1e-6 * self.law.spacing)
            try:
                rings = boundary_loops(triangles)
            except CannotRebuild:  # contact lines about to meet or to part: worn triangles serve until they have
                continue
            self._take(*relax(level, points, triangles, rings))
            after = parts_of(self.triangles)
            if gap or after != before:
                self.meetings.append(Meeting(self.moves, before, after, self.energy - energy))
            return

    def _closed(self) -> tuple[Floats, Indices]:
        """The surface with its image behind the wall."""
        if not self.law.mirror:
            return self.points, self.triangles
        image = len(self.points) + np.arange(len(self.points), dtype=np.int32)
        for ring in self.rings:
            image[ring] = ring
        points = np.concatenate((self.points, self.points * np.array([1.0, 1.0, -1.0])))
        return points, np.concatenate((self.triangles, image[self.triangles][:, ::-1]))

    def enclose(self, volume: float) -> None:
        """Move along the normals by one distance, contact lines along the wall, to enclose a volume [m^3]."""
        enclosed, gradient = volume_and_gradient(self.points, self.triangles, (), ())
        for ring in self.rings:
            gradient[ring, 2] = 0.0
        size = np.linalg.norm(gradient, axis=1)
        normals = gradient / np.maximum(size, 1e-300)[:, None]
        self.points += (volume - enclosed) / size.sum() * normals
        np.maximum(self.points[:, 2], 0.0 if self.law.mirror else -np.inf, out=self.points[:, 2])


def _area_within(line: Floats) -> float:
    """Area within a closed line `(k, 3)` in a plane z = const. [m^2], negative where it runs clockwise."""
    x, y = line[:, 0], line[:, 1]
    return 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
