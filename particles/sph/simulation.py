"""Steps with time: velocity Verlet, one loop over the pairs a step.

A step is a short sequence of loops over particles, which threads or a GPU run (`threads.py`, `cuda_particles.py`); the
surface stays with the processor.
"""

from collections.abc import Callable, Mapping
from dataclasses import InitVar, dataclass, field
from typing import Any, Protocol

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.flows.sph_numerics import CENTRAL, largest_time_step
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.liquid_surface import LiquidSurface
from reflowshock.particles.sph.threads import ThreadParticles


class Particles(Protocol):
    """The particles of a simulation on some device, and the loops over them; see `threads.ThreadParticles`."""

    @property
    def fields(self) -> Fields:
        """Their quantities, on the host; those of a GPU are copies."""

    @property
    def rates(self) -> Floats:
        """`(10, n)` of the liquid at the last positions, as `rates_of` returns them; likewise."""

    @property
    def built_at(self) -> Floats:
        """Positions when neighbours were found `(3, n)` [m]; likewise."""

    @property
    def builds(self) -> int:
        """How often they were found."""

    @property
    def neighbours(self) -> float:
        """How many a particle of the liquid has in its row, on average."""

    @property
    def fastest(self) -> float:
        """The largest speed of the liquid [m/s]."""

    @property
    def largest_viscosity(self) -> float:
        """Of the liquid [Pa s], where it depends on the rate of shear."""

    @property
    def velocity(self) -> Floats:
        """What the liquid has just been moved with `(3, n)` [m/s]."""

    def restore(self, fields: Fields, rates: Floats, built_at: Floats, builds: int, /) -> None:
        """Go on from what was saved."""

    def predict(self, time_step: float, /) -> None:
        """Move the liquid over a time step [s]."""

    def settle(self) -> None:
        """Reflect what has passed through the mirror; find pressures and neighbours."""

    def find_rates(self) -> None:
        """Find the rates of the present fields."""

    def add(self, act: Callable[[Floats, Fields], None], /) -> None:
        """Let what the host computes add to the rates."""

    def take_slopes(self) -> None:
        """Keep the gradients of density."""

    def correct(self, time_step: float, /) -> None:
        """End a time step [s]."""

    def shift(self, factor: float, /) -> None:
        """Move particles down the gradient of their concentration times a factor [m^2]."""


@dataclass(slots=True)
class Simulation:
    """A fluid between walls that moves.

    Attributes:
        start: its quantities at the start; a device may take the arrays as they are.
        fluids: number of particles that are liquid.
        law: what acts between two particles.
        surface: with tension; None where none acts.
        device: takes fields, the number that is liquid, and the law.
        held: how many particles next to the liquid's stand still as walls do, but carry its surface.
        particles: positions, velocities and densities are those at `time`.
        time: [s].
        steps: number of them.
    """

    start: InitVar[Fields]
    fluids: int
    law: Law
    surface: LiquidSurface | None = None
    device: Callable[[Fields, int, Law], Particles] = ThreadParticles
    held: int = 0
    particles: Particles = field(init=False)
    time: float = 0.0
    steps: int = 0

    def __post_init__(self, start: Fields) -> None:
        self.particles = self.device(start, self.fluids, self.law)
        self.particles.settle()
        self._find_rates()
        self.particles.take_slopes()

    @property
    def fields(self) -> Fields:
        """Quantities of the particles."""
        return self.particles.fields

    @property
    def rates(self) -> Floats:
        """`(10, n)` of the last positions, as `rates_of` returns them."""
        return self.particles.rates

    @property
    def kinetic_energy(self) -> float:
        """Of the liquid [J]."""
        fields = self.fields
        u, v, w = (speed[: self.fluids] for speed in (fields.u, fields.v, fields.w))
        return 0.5 * float(fields.mass[: self.fluids] @ (u * u + v * v + w * w))

    @property
    def volume(self) -> float:
        """Of the particles of the liquid [m^3]."""
        return float((self.fields.mass[: self.fluids] / self.fields.density[: self.fluids]).sum())

    @property
    def elastic_energy(self) -> float:
        """Of the compression of the liquid [J]: the work of pressure from the density at rest on."""
        density, mass = (one[: self.fluids] for one in (self.fields.density, self.fields.mass))
        squeezed = density / self.law.rest_density
        return self.law.sound**2 * float(mass @ (np.log(squeezed) + 1.0 / squeezed - 1.0))

    @property
    def fastest(self) -> float:
        """The largest speed of the liquid [m/s]."""
        return self.particles.fastest

    @property
    def pressures(self) -> Floats:
        """Of the particles of the liquid `(fluids,)` [Pa], with that of its surface."""
        return self.fields.pressure[: self.fluids] + (self.surface.pressure if self.surface else 0.0)

    def saved(self) -> dict[str, Any]:
        """All of it, for a checkpoint."""
        return {
            "fields": self.fields._asdict(), "rates": self.rates, "built_at": self.particles.built_at,
            "builds": self.particles.builds, "time": self.time, "steps": self.steps,
            "surface": self.surface.saved() if self.surface else None,
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        self.particles.restore(Fields(**saved["fields"]), saved["rates"], saved["built_at"], saved["builds"])
        self.time, self.steps = saved["time"], saved["steps"]
        if self.surface:
            self.surface.restore(saved["surface"])

    def time_step(self) -> float:
        """The largest stable step [s]."""
        law, tension = self.law, self.surface.tension if self.surface else 0.0
        viscosity = self.particles.largest_viscosity if law.rheology else law.viscosity
        viscosity *= CENTRAL if law.has_surface else 1.0
        return largest_time_step(law.length, law.sound + self.fastest, law.rest_density, viscosity, tension)

    def step(self, time_step: float) -> None:
        """Go on by a time step [s].

        Rates need velocities and densities of the new time, which depend on them: those that the last rates predict
        stand in, which keeps the order.
        """
        particles, law = self.particles, self.law
        volume = self._volume_within() if self.surface and self.surface.needs_volume else 0.0
        particles.predict(time_step)
        if self.surface:
            velocity = particles.velocity
            self.surface.move(np.pad(velocity, ((0, 0), (0, self.held))) if self.held else velocity, time_step, volume)
        particles.settle()
        self._find_rates()
        particles.correct(time_step)
        if law.shifting:
            particles.shift(4.0 * law.shifting * self.fastest * law.length * time_step)
        self.time += time_step
        self.steps += 1

    def _volume_within(self) -> float:
        """Of the particles that carry the surface, but of those outside it [m^3]."""
        carriers, fields, surface = slice(self.fluids + self.held), self.fields, self.surface
        assert surface is not None
        volumes = fields.mass[carriers] / fields.density[carriers]
        surface.find_spray([place[carriers] for place in fields[:3]], volumes)
        return float(volumes.sum()) - surface.spray

    def _find_rates(self) -> None:
        """Find the rates of the present fields."""
        self.particles.find_rates()
        if self.surface:
            carriers, surface = self.fluids + self.held, self.surface
            self.particles.add(lambda rates, fields: surface.add_to(rates, fields, carriers))
