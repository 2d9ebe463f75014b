"""Steps with time: velocity Verlet, one loop over the pairs a step."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numba import njit, prange

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.neighbours import find_beside, have_moved
from reflowshock.particles.parameters.flows import largest_time_step
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.liquid_surface import LiquidSurface
from reflowshock.particles.sph.smoothing import SUPPORT
from reflowshock.particles.sph.threads import ThreadLoops

# Of the smoothing length: how far beyond their support particles are listed.
SKIN = 0.3
# What is found of a particle of the liquid, and of one of a wall.
RATES, WALL_VALUES = 10, 5


@njit(cache=True, parallel=True)
def _liquid_first(offsets, indices, fluids):
    """Put the particles of the liquid to the front of each row."""
    for i in prange(offsets.shape[0] - 1):
        front = offsets[i]
        for k in range(offsets[i], offsets[i + 1]):
            if indices[k] < fluids:
                indices[front], indices[k] = indices[k], indices[front]
                front += 1


@dataclass(slots=True)
class Rows:
    """Neighbours of every particle, those of the liquid first, found again when some have moved by the skin.

    Attributes:
        law: says support and periods.
        fluids: number of particles that are liquid; those of walls list them alone.
        built_at: `(n, 3)` positions when they were found [m].
        lists: offsets `(n + 1,)`, indices; a particle of the liquid is in its own row.
        builds: how often they were found.
    """

    law: Law
    fluids: int
    built_at: Floats = field(default_factory=lambda: np.empty((0, 3)))
    lists: tuple[Indices, Indices] = field(default_factory=lambda: (np.zeros(1, np.int32), np.empty(0, np.int32)))
    builds: int = 0

    def update(self, points: Floats) -> None:
        """Make the lists valid for points `(n, 3)` [m]."""
        skin = SKIN * self.law.length
        if points.shape == self.built_at.shape and not have_moved(points, self.built_at, skin):
            return
        reach = SUPPORT * self.law.length + skin
        images, source = self._images(points, reach)
        alone = len(images) == len(points)  # images are numbered behind the walls
        offsets, indices = find_beside(images[: len(points)], images, reach, self.fluids if alone else None)
        self.lists = offsets, indices if alone else source[indices]
        if len(points) > self.fluids:
            _liquid_first(*self.lists, self.fluids)
        self.built_at = points.copy()
        self.builds += 1

    def _images(self, points: Floats, reach: float) -> tuple[Floats, Indices]:
        """Points with their images beyond the periods `(n + g, 3)`, and whose each is."""
        source = np.arange(len(points), dtype=np.int32)
        for axis, period in enumerate((self.law.period_x, self.law.period_y, self.law.period_z)):
            if not period:
                continue
            place = points[:, axis] - period * np.floor(points[:, axis] / period)
            points = points.copy()
            points[:, axis] = place
            shift = np.zeros(3)
            shift[axis] = period
            low, high = place < reach, place > period - reach
            points = np.concatenate((points, points[low] + shift, points[high] - shift))
            source = np.concatenate((source, source[low], source[high]))
        return points, source


class Loops(Protocol):
    """The loops over particles of a law, on some device; see `threads.ThreadLoops`."""

    def find_rates(self, fluids: int, lists: tuple[Indices, Indices], fields: Fields, rates: Floats, /) -> None:
        """Write the rates `(10, n)` of the liquid."""

    def find_wall_values(self, fluids: int, lists: tuple[Indices, Indices], fields: Fields, found: Floats, /) -> None:
        """Write pressures, velocities and shares `(5, m)` of walls."""

    def find_viscosities(self, fluids: int, lists: tuple[Indices, Indices], fields: Fields, found: Floats, /) -> None:
        """Write the viscosities `(1, n)` of the liquid, where they depend on the rate of shear."""

    def find_drifts(self, fluids: int, lists: tuple[Indices, Indices], fields: Fields, found: Floats, /) -> None:
        """Write the velocities `(3, n)` by which XSPH moves the liquid."""


@dataclass(slots=True)
class Simulation:
    """A fluid between walls that moves.

    Attributes:
        fields: its quantities; positions, velocities and densities are those at `time`.
        fluids: number of particles that are liquid.
        law: what acts between two particles.
        surface: with tension; None where none acts.
        device: makes the loops of a law.
        held: how many particles next to the liquid's stand still as walls do, but carry its surface.
        rows: neighbours.
        rates: `(10, n)` of the last positions, as `rates_of` returns them.
        time: [s].
        steps: number of them.
    """

    fields: Fields
    fluids: int
    law: Law
    surface: LiquidSurface | None = None
    device: Callable[[Law], Loops] = ThreadLoops
    held: int = 0
    rows: Rows = field(init=False)
    rates: Floats = field(init=False)
    loops: Loops = field(init=False)
    time: float = 0.0
    steps: int = 0

    def __post_init__(self) -> None:
        self.rows = Rows(self.law, self.fluids)
        self.rates = np.zeros((RATES, self.fluids))
        self.loops = self.device(self.law)
        self._find_rates()

    @property
    def kinetic_energy(self) -> float:
        """Of the liquid [J]."""
        u, v, w = (speed[: self.fluids] for speed in (self.fields.u, self.fields.v, self.fields.w))
        return 0.5 * float(self.fields.mass[: self.fluids] @ (u * u + v * v + w * w))

    @property
    def fastest(self) -> float:
        """The largest speed of the liquid [m/s]."""
        u, v, w = (speed[: self.fluids] for speed in (self.fields.u, self.fields.v, self.fields.w))
        return float(np.sqrt((u * u + v * v + w * w).max()))

    @property
    def pressures(self) -> Floats:
        """Of the particles of the liquid `(fluids,)` [Pa], with that of its surface."""
        return self.fields.pressure[: self.fluids] + (self.surface.pressure if self.surface else 0.0)

    def saved(self) -> dict[str, Any]:
        """All of it, for a checkpoint."""
        return {
            "fields": self.fields._asdict(), "rates": self.rates, "built_at": self.rows.built_at,
            "builds": self.rows.builds, "time": self.time, "steps": self.steps,
            "surface": self.surface.saved() if self.surface else None,
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        self.fields, self.rates = Fields(**saved["fields"]), saved["rates"]
        self.time, self.steps = saved["time"], saved["steps"]
        self.rows = Rows(self.law, self.fluids)
        self.rows.update(saved["built_at"])
        self.rows.builds = saved["builds"]
        if self.surface:
            self.surface.restore(saved["surface"])

    def time_step(self) -> float:
        """The largest stable step [s]."""
        law, tension = self.law, self.surface.tension if self.surface else 0.0
        viscosity = float(self.fields.viscosity[: self.fluids].max()) if law.rheology else law.viscosity
        return largest_time_step(law.length, law.sound + self.fastest, law.rest_density, viscosity, tension)

    def step(self, time_step: float) -> None:
        """Go on by a time step [s].

        Rates need velocities and densities of the new time, which depend on them: those that the last rates predict
        stand in, which keeps the order.
        """
        liquid, half = slice(self.fluids), 0.5 * time_step
        fields, rates = self.fields, self.rates
        middle, drift = [], np.zeros((3, self.fluids))
        if self.law.xsph:
            self.loops.find_drifts(self.fluids, self.rows.lists, fields, drift)
        for axis in range(3):
            place, speed = fields[axis][liquid], fields[3 + axis][liquid]
            middle.append(speed + half * rates[1 + axis])
            place += time_step * (middle[axis] + drift[axis])
            speed += time_step * rates[1 + axis]
        if self.surface:
            carriers = slice(self.fluids + self.held)
            volume = float((fields.mass[carriers] / fields.density[carriers]).sum())
            velocity = np.pad(np.array(middle) + drift, ((0, 0), (0, self.held)))
            self.surface.move(velocity, time_step, volume)
        self._reflect(middle[2])
        density = fields.density[liquid] + half * rates[0]
        fields.density[liquid] += time_step * rates[0]
        self._find_rates()
        for axis in range(3):
            fields[3 + axis][liquid] = middle[axis] + half * rates[1 + axis]
        fields.density[liquid] = density + half * rates[0]
        self._shift(time_step)
        self.time += time_step
        self.steps += 1

    def _reflect(self, *speeds: Floats) -> None:
        """Let a particle that has passed through the mirror change places with its image, whose motion is its own."""
        if not self.law.mirror:
            return
        through = np.flatnonzero(self.fields.z[: self.fluids] < 0.0)
        for across in (self.fields.z, self.fields.w, self.fields.slope_z, *speeds):
            across[through] *= -1.0

    def _find_rates(self) -> None:
        """Find the rates of the present fields."""
        fields, law, liquid = self.fields, self.law, slice(self.fluids)
        self.rows.update(np.stack(fields[:3], axis=1))
        fields.pressure[liquid] = law.sound**2 * (fields.density[liquid] - law.rest_density)
        self._extend_to_walls()
        if law.rheology:
            self.loops.find_viscosities(self.fluids, self.rows.lists, fields, fields.viscosity[None, liquid])
        self.loops.find_rates(self.fluids, self.rows.lists, fields, self.rates)
        self.rates[1:4] += np.array([[law.gravity_x], [law.gravity_y], [law.gravity_z]])
        if self.surface:
            self.surface.add_to(self.rates, fields, self.fluids + self.held)
        for axis in range(3):
            fields[9 + axis][liquid] = self.rates[4 + axis]

    def _extend_to_walls(self) -> None:
        """Give walls the pressure of the liquid beside them, the velocity that viscosity sees, and their shares."""
        fields, law, walls = self.fields, self.law, slice(self.fluids, None)
        found = np.empty((WALL_VALUES, len(fields.x) - self.fluids))
        self.loops.find_wall_values(self.fluids, self.rows.lists, fields, found)
        fields.pressure[walls], fields.u[walls], fields.v[walls], fields.w[walls], fields.wall_share[:] = found
        fields.density[walls] = law.rest_density + found[0] / law.sound**2

    def _shift(self, time_step: float) -> None:
        """Move particles to where there are fewer (Sun et al. 2017)."""
        law = self.law
        if not law.shifting:
            return
        factor = 4.0 * law.shifting * self.fastest * law.length * time_step
        for axis in range(3):
            self.fields[axis][: self.fluids] -= factor * self.rates[7 + axis]
        self._reflect()
