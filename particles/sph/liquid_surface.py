"""Surface tension and wetting: a triangulated surface that the particles carry, and the forces of its energy on them.

E = gamma (A_free - cos(theta) A_wet). Vertices move with the particles beside them and hand their forces -dE/dx on to
them by the same weights (`surface_loops.py`): what the surface loses, the particles gain, so that a drop comes to rest.
The contact angle is nowhere set: it is the balance of the forces on the contact line.

The tension of a surface at rest is balanced by a pressure, and a uniform one does nothing else. So it is taken out of
both: vertices bear the forces of E - p V, with the pressure p of the whole surface, and particles what is left of their
pressure, which is none at rest. So it does not matter that particles lack neighbours at a free surface, where their
sums carry too little of a pressure, nor that a lattice of particles under pressure is stiff; and nothing is fitted.
Particles that no pressure spreads draw together where it is negative: they are shifted to where there are fewer
(`simulation.py`). Beside the surface it is itself what lacks in their sums, so that they fill it evenly.

A part that comes down on the wall becomes wet. Triangles are split, joined and evened out every few steps
(`surface_care.py`); where they are worn all the same, the surface is made anew from its distance, and may then part.
Parts that come as near to each other as particles stand, of two drops or of one, become one: the gap between them is
closed (`surface/closing.py`), volume is restored, particles and their momentum are not touched. A foot on the wall that
has become thinner than particles fill leaves it where the liquid moves away: a drop that rebounds.

On a solid body (`ground`) the surface stays closed: where it lies on it its tension is -gamma cos(theta) in place of
gamma, along the ground, which makes the contact angle there as on the wall.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.neighbours import have_moved
from reflowshock.particles.core.surface_measure import area_gradient, surface_area, triangle_areas, volume_and_gradient
from reflowshock.particles.sph import grounds, surface_care, surface_loops
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.smoothing import SUPPORT
from reflowshock.particles.sph.thin_films import hold_films
from reflowshock.particles.surface.breakup import are_outside, small_parts, with_contact_lines
from reflowshock.particles.surface.closing import Meeting, narrowest_gap, parts_of
from reflowshock.particles.surface.cloud_level_set import CannotRebuild, area_within, boundary_loops
from reflowshock.particles.surface.level_set import LevelSet
from reflowshock.particles.surface.surface_quality import vertex_normals

# In spacings of the particles: the skin of the lists.
SKIN = 0.5
# The same: gaps narrower than the first close, a foot narrower than the second leaves the wall where liquid moves away.
MEETING, FOOT = 1.0, 2.0
# The same: which gaps close where the surface is made anew for a reason; wider ones are tried where contact lines would
# meet in a point. Negative: liquid that is thinner goes.
GAPS = {"meets": (2.0, 2.4, 2.8), "leaves": (-3.0,), "worn": (0.0,)}
# Steps after which triangles are evened out.
CARE = 10


@dataclass(slots=True)
class LiquidSurface:
    """The free surface of a liquid, closed by the wall z = 0 where there is one.

    Attributes:
        points: `(m, 3)` [m].
        triangles: `(t, 3)`, outward oriented.
        tension: gamma [N/m].
        cosine: of the contact angle.
        bounds: cosines of the advancing and the receding contact angle on the wall.
        law: of the particles.
        rings: contact lines, anticlockwise about liquid, as vertices `(k,)`; found where triangles end.
        moves: number of steps.
        rebuilds: how often it was tried to make it anew.
        waits: for each reason in `GAPS`, the step from which on it is tried again, and the last wait, in cares.
        ground: distance to solid bodies on which it may lie, negative in them; None where there are none.
        wetness: `(m,)` how much of each vertex is on them, 0 to 1; and their normals there, `(m, 3)`.
        meetings: liquids that merged or parted.
        pressure: that of the liquid over that of its particles [Pa].
        shed: events in which parts too small for particles were given up, which fly on as particles without a surface.
        spray: what is outside all of it [m^3].
    """

    points: Floats
    triangles: Indices
    tension: float
    cosine: float
    law: Law
    bounds: tuple[float, float] | None = None
    rings: tuple[Indices, ...] = field(init=False)
    moves: int = 0
    rebuilds: int = 0
    waits: dict[str, tuple[int, int]] = field(default_factory=dict)
    ground: LevelSet | None = None
    wetness: tuple[Floats, Floats] = field(default_factory=lambda: (np.empty(0), np.empty((0, 3))))
    meetings: list[Meeting] = field(default_factory=list)
    pressure: float = 0.0
    shed: int = 0
    spray: float = 0.0
    _built_at: Floats = field(default_factory=lambda: np.empty((3, 0)))
    _lists: tuple[Indices, Indices] = field(default_factory=lambda: (np.zeros(1, np.int32), np.empty(0, np.int32)))
    _shares: Floats = field(default_factory=lambda: np.empty((2, 0)))

    def __post_init__(self) -> None:
        self.rings = boundary_loops(self.triangles)

    def saved(self) -> dict[str, Any]:
        """All of it, for a checkpoint."""
        return {
            "points": self.points, "triangles": self.triangles, "rings": list(self.rings), "moves": self.moves,
            "rebuilds": self.rebuilds, "waits": dict(self.waits), "built_at": self._built_at, "shares": self._shares,
            "meetings": list(self.meetings), "pressure": self.pressure, "shed": self.shed, "spray": self.spray,
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        self.points, self.triangles, self.rings = saved["points"], saved["triangles"], tuple(saved["rings"])
        self.moves, self.rebuilds, self.waits = saved["moves"], saved["rebuilds"], dict(saved["waits"])
        self._built_at, self._shares = saved["built_at"], saved["shares"]
        self.meetings, self.pressure = saved["meetings"], saved["pressure"]
        self.shed, self.spray = saved["shed"], saved["spray"]
        self._find_wetness()
        if len(self.points):
            self._list(self._built_at)

    @property
    def needs_volume(self) -> bool:
        """Whether it will be evened out in its next move."""
        return (self.moves + 1) % CARE == 0

    @property
    def volume(self) -> float:
        """What it encloses with the wall [m^3]."""
        return volume_and_gradient(self.points, self.triangles, (), ())[0]

    @property
    def wetted_area(self) -> float:
        """Area within the contact lines [m^2]."""
        return sum(area_within(self.points[ring]) for ring in self.rings)

    @property
    def energy(self) -> float:
        """E [J], of the triangles themselves."""
        area, wet = surface_area(self.points, self.triangles), self.wetted_area
        if self.ground is not None:
            grounded = float(triangle_areas(self.points, self.triangles) @ self._wet_shares())
            area, wet = area - grounded, wet + grounded
        return self.tension * (area - self.cosine * wet)

    def _wet_shares(self) -> Floats:
        """How much of each triangle lies on the ground `(t,)`: what its highest vertex does."""
        return self.wetness[0][self.triangles].min(axis=1)

    def _find_wetness(self) -> None:
        """Find what lies on the ground, none of it below."""
        if self.ground is None or not len(self.points):
            return
        normals = vertex_normals(self.points, self.triangles, len(self.points))
        self.wetness = grounds.settle(self.ground, self.points, normals, surface_care.TOUCH * self.law.spacing)

    def add(self, points: Floats, triangles: Indices) -> None:
        """Add the surface of more liquid, apart from this one: `(k, 3)` [m], `(t, 3)`."""
        triangles = np.concatenate((self.triangles, triangles + len(self.points)))
        self._take(np.concatenate((self.points, points)), triangles)

    def take_out(self, vertices: NDArray[np.bool_]) -> tuple[Floats, Indices]:
        """Give away connected parts, those of vertices `(m,)`: points and triangles."""
        theirs = vertices[self.triangles[:, 0]]
        used, numbers = np.unique(self.triangles[theirs], return_inverse=True)
        found = self.points[used], numbers.reshape(-1, 3).astype(np.int32)
        self._take(self.points, self.triangles[~theirs])
        return found

    def lie_on(self, ground: LevelSet | None) -> None:
        """Lie from now on on this ground; the particles that carry it may be others, too."""
        self.ground, self.spray = ground, 0.0
        self._take(self.points, self.triangles)

    def add_to(self, rates: Floats, fields: Fields, carriers: int) -> None:
        """Add the accelerations that it gives particles to rows 1 to 3 of their rates `(10, n)`, and itself to 7 to 9.

        These, the gradient of concentration, are then zero beside it, too, where particles are spread evenly. Where
        it stands on the ground its image counts, too, as that of the liquid does, for which particles of walls stand.

        Args:
            rates: of the liquid.
            fields: of all particles.
            carriers: how many of them, the liquid's the first, carry the surface.

        Raises:
            SurfaceLost: there are no particles beside much of it.
        """
        self._update_lists([place[:carriers] for place in fields[:3]])
        self._cover(fields)
        weights = np.empty((2, 2, len(self._lists[1])))
        levels = surface_loops.find_weights(self.points, self._lists, fields, self.law, weights)
        if (alone := float((levels == 0.0).mean())) > surface_care.MOST_ALONE:
            raise surface_care.SurfaceLost(f"the liquid has left its surface, {alone:.0%} of it")
        self._shares = weights[0]
        outward = self._outward()
        found = np.zeros((2, 3, carriers))
        surface_loops.share_out(self._lists, weights, np.array((self.forces(self._drift(fields)), outward)), found)
        if self.law.mirror and self.law.no_slip:
            hold_films((self.points, self._normals(), self._lists, weights[1]), fields, self.law, rates)
        if self.ground is not None:
            images, outward = grounds.reflected(self.ground, self.points, outward, SUPPORT * self.law.length)
            weights = np.empty_like(weights)
            surface_loops.find_weights(images, self._lists, fields, self.law, weights)
            surface_loops.share_out(self._lists, weights[1:], outward[None], found[1:])
        fluids = rates.shape[1]
        rates[1:4] += found[0, :, :fluids] / fields.mass[:fluids]
        rates[7:10] += found[1, :, :fluids]

    def _cover(self, fields: Fields) -> None:
        """Move vertices that particles pass, or leave behind, at the rim of a film. The volume stays."""
        normals = self._normals()
        offset = surface_care.strays((self.points, normals), self._lists, fields, self.law.spacing)
        if self.ground is not None:
            offset[self.wetness[0] > 0.0] = 0.0
        if offset.any():
            volume = self.volume
            self.points += offset[:, None] * normals
            self.enclose(volume)
            self._find_wetness()

    def _outward(self) -> Floats:
        """Areas about the vertices times their outward normals `(m, 3)` [m^2], of what lies on the ground along it."""
        area = volume_and_gradient(self.points, self.triangles, (), ())[1]
        for ring in self.rings:
            area[ring, 2] = 0.0
        return area if self.ground is None else grounds.along(area, *self.wetness)

    def _normals(self) -> Floats:
        """Outward unit normals `(m, 3)`, of contact lines along the wall; none on the ground."""
        outward = self._outward() * (1.0 if self.ground is None else (self.wetness[0] < 1.0)[:, None])
        return outward / np.maximum(np.linalg.norm(outward, axis=1), 1e-300)[:, None]

    def forces(self, drift: Floats | None = None) -> Floats:
        """Forces -d(E - p V)/dx on vertices `(m, 3)` [N], p from all of the surface; contact lines have none across.

        With a ``drift``, as `_drift` returns it, contact lines have two angles.
        """
        wet = None if self.ground is None else self._wet_shares()
        result = -self.tension * area_gradient(self.points, self.triangles, None if wet is None else 1.0 - wet)
        self.pressure = self._balance(result)
        result += self.pressure * volume_and_gradient(self.points, self.triangles, (), ())[1]
        if wet is not None:
            result += self.tension * self.cosine * area_gradient(self.points, self.triangles, wet)
            result = grounds.along(result, *self.wetness)
        for ring in self.rings:
            outward = surface_care.outward_along(self.points[ring])
            cosines: Floats | float = self.cosine
            if self.bounds is not None and drift is not None:
                cosines = surface_care.cosines_of(self.bounds, outward, result[ring, :2] / self.tension, drift[ring])
            result[ring, :2] += self.tension * cosines * outward
            result[ring, 2] = 0.0
        return result

    def _balance(self, forces: Floats) -> float:
        """Return the pressure that balances forces of tension `(m, 3)` on the free surface in the mean [Pa]."""
        area = self._outward()
        for ring in self.rings:
            area[ring] = 0.0
        if self.ground is not None:
            area *= 1.0 - self.wetness[0][:, None]
        square = float((area**2).sum())
        return -float((forces * area).sum()) / square if square else 0.0

    def _drift(self, fields: Fields) -> Floats | None:
        """Velocities of vertices; see `surface_care.sliding`. None where contact lines have one angle."""
        if self.bounds is None or not self.tension:
            return None
        return surface_care.sliding(surface_loops.velocities(self._lists, self._shares, fields), self.tension, self.law)

    def move(self, velocity: Floats, time_step: float, volume: float) -> None:
        """Move with the velocities of the particles `(3, n)` [m/s] over a time step [s].

        Args:
            velocity: of the particles.
            time_step: over which.
            volume: of the liquid within it before [m^3], which it encloses after its triangles were evened out.
        """
        surface_loops.carry(self._lists, self._shares, velocity, time_step, self.points)
        self.moves += 1
        if self.law.mirror:
            self._wet()
        if self.moves % CARE == 0:
            self._care()
            self._renew(velocity)
            self.enclose(volume - self._shed())
        self._find_wetness()

    def _update_lists(self, liquid: Sequence[Floats]) -> None:
        """Find the particles, at x, y and z `(3, n)` [m], beside each vertex again when some have moved by the skin."""
        together = np.concatenate((self.points.T, liquid), axis=1)
        if together.shape != self._built_at.shape or have_moved(together, self._built_at, SKIN * self.law.spacing):
            self._list(together)

    def _list(self, together: Floats) -> None:
        self._built_at, vertices = together, len(self.points)
        reach, places = SUPPORT * self.law.length + SKIN * self.law.spacing, np.ascontiguousarray(together.T)
        self._lists = surface_care.beside(places[:vertices], places[vertices:], reach)

    def _wet(self) -> None:
        """Keep vertices above the wall, contact lines on it; triangles that have come down on it are wet."""
        for ring in self.rings:
            self.points[ring, 2] = 0.0
        np.maximum(self.points[:, 2], 0.0, out=self.points[:, 2])
        flat = np.flatnonzero(surface_care.on_wall(self.points, self.triangles, self.law.spacing))
        if len(flat):
            self._take(self.points, np.delete(self.triangles, flat, axis=0))

    def _take(self, points: Floats, triangles: Indices) -> None:
        """Become these triangles, with the vertices that they have; contact lines that meet in a point part there."""
        try:
            used, triangles, rings = with_contact_lines(triangles)
        except CannotRebuild as error:
            raise surface_care.SurfaceLost("more than two sheets of the liquid's surface meet in an edge") from error
        self.points, self.triangles, self.rings = points[used], triangles, rings
        for ring in self.rings:
            self.points[ring, 2] = 0.0
        self._built_at = np.empty((3, 0))
        self._lists = np.zeros(len(self.points) + 1, np.int32), np.empty(0, np.int32)
        self._find_wetness()

    def _care(self) -> None:
        """Close dry spots, split and collapse edges, and even out triangles."""
        if lidded := surface_care.without_dry_spots(self.points, self.triangles, self.rings, self.law.spacing):
            self._take(*lidded)
        try:
            for change in surface_care.changes(self.law.spacing):
                new = change(self.points, self.triangles, self.rings + self._lines_on_ground())
                if len(new.triangles) != len(self.triangles):
                    self._take(0.5 * (self.points[new.first] + self.points[new.second]), new.triangles)
            lines = self.rings + self._lines_on_ground()
            self.points, self.triangles = surface_care.evened_out(self.points, self.triangles, self.rings, lines)
        except CannotRebuild:  # contact lines meet in a point: uneven triangles serve until they have parted
            return

    def _shed(self) -> float:
        """Follow parts that are too small for particles no more; return what they enclosed [m^3]."""
        least = surface_care.FEWEST * self.law.spacing**3
        is_small, volume = small_parts(self.points, self.triangles, least)
        if is_small.any():
            self._take(self.points, self.triangles[~is_small])
            self.shed, self.spray = self.shed + 1, self.spray + volume
        return volume

    def find_spray(self, liquid: Sequence[Floats], volumes: Floats) -> None:
        """Find how much of the particles, at x, y, z `(3, n)` [m], of volumes `(n,)` [m^3], is outside all of it."""
        surface, outside = (self.points, self.triangles), surface_care.OWN * self.law.spacing
        self.spray = float(volumes[are_outside(np.stack(liquid, 1), surface, self._normals(), outside)].sum())

    def _lines_on_ground(self) -> tuple[Indices, ...]:
        """Contact lines on the ground: the surface has an edge there, which evening out would round off.

        Raises:
            CannotRebuild: they meet in a point.
        """
        if self.ground is None:
            return ()
        return boundary_loops(self.triangles[self._wet_shares() > 0.5])

    def _meets(self) -> bool:
        """Whether parts of it have come as near to each other as particles stand; across the wall none meet."""
        on_ground, gap = self.ground is not None, MEETING * self.law.spacing
        normals = vertex_normals(self.points, self.triangles, len(self.points)) if on_ground else self._normals()
        return narrowest_gap(self.points, self.triangles, normals, gap, self.law.spacing) < gap

    def _leaves(self, velocity: Floats) -> bool:
        """Whether liquid moves away from the wall on a foot that is too thin for its particles."""
        is_thin = 0.0 < self.wetted_area < 0.25 * np.pi * (FOOT * self.law.spacing) ** 2
        return is_thin and self.ground is None and bool(velocity[2].mean() > 0.0)

    def _renew(self, velocity: Floats) -> None:
        """Make it anew for the first reason that holds, of those that were not tried in vain of late."""
        reasons: dict[str, Callable[[], bool]] = {
            "meets": self._meets, "leaves": partial(self._leaves, velocity),
            "worn": partial(surface_care.is_worn, self.points, self.triangles, self.rings, self.law.spacing),
        }  # fmt: skip
        for reason, holds in reasons.items():
            if self.moves >= self.waits.get(reason, (0, 1))[0] and holds():
                self._make_anew(reason)
                return

    def _make_anew(self, reason: str) -> None:
        """Triangulate the same surface anew, for one of the reasons in `GAPS`."""
        before, energy, gaps = parts_of(self.triangles), self.energy, GAPS[reason]
        _, wait = self.waits.get(reason, (0, 1))
        new = surface_care.made_anew(self.points, self.triangles, bool(self.law.mirror), self.law.spacing, gaps)
        wait = 1 if new else min(2 * wait, surface_care.LONGEST_WAIT)
        self.rebuilds, self.waits[reason] = self.rebuilds + 1, (self.moves + wait * CARE, wait)
        if new:
            self._take(*new)
            if any(gaps) or parts_of(self.triangles) != before:
                self._note(before, energy)

    def _note(self, before: int, energy: float) -> None:
        """Keep what a change of the surface, which had so many parts and so much energy [J], has made of them."""
        self.meetings.append(Meeting(self.moves, before, parts_of(self.triangles), self.energy - energy))

    def enclose(self, volume: float) -> None:
        """Move along the normals by one distance, contact lines along the wall, to enclose a volume [m^3]."""
        self.points += surface_care.swelling(self.points, self.triangles, self.rings, volume)
        np.maximum(self.points[:, 2], 0.0 if self.law.mirror else -np.inf, out=self.points[:, 2])
