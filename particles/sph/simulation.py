"""Time integration of delta-SPH: velocity Verlet with one loop over the pairs in each step.

A step is a short sequence of loops over particles, which run on threads or on a GPU (``threads.py``,
``cuda_particles.py``); a tracked surface stays on the processor. Density follows the continuity equation with diffusion
along its renormalised gradient (delta-SPH), and pressure is linear in density. Particles are shifted towards lower
concentration (Sun et al. 2017) unless the free surface is untracked; without shifting vortices decay twice
too fast.
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
    """Interface of the particles on a device and of the loops over them; see ``threads.ThreadParticles``."""

    @property
    def fields(self) -> Fields:
        """Fields of all particles on the host; copies if they are on a GPU."""

    @property
    def rates(self) -> Floats:
        """Rates of the liquid at the last positions, as ``rates_of`` returns them, shape (10, n)."""

    @property
    def built_at(self) -> Floats:
        """Positions for which neighbours were listed, shape (3, n) [m]."""

    @property
    def builds(self) -> int:
        """Number of times neighbours were listed."""

    @property
    def neighbours(self) -> float:
        """Mean number of listed neighbours of a liquid particle."""

    @property
    def fastest(self) -> float:
        """Largest speed of the liquid [m/s]."""

    @property
    def largest_viscosity(self) -> float:
        """Largest viscosity of the liquid [Pa s], where it depends on the shear rate."""

    @property
    def velocity(self) -> Floats:
        """Velocities by which ``predict`` moved the liquid, shape (3, n) [m/s]."""

    def restore(self, fields: Fields, rates: Floats, built_at: Floats, builds: int, /) -> None:
        """Continue from saved fields, rates and positions of the neighbour lists."""

    def predict(self, time_step: float, /) -> None:
        """Move the liquid over a time step [s]."""

    def settle(self) -> None:
        """Reflect particles that crossed the mirror; update pressures and neighbours."""

    def find_rates(self) -> None:
        """Compute the rates for the present fields."""

    def add(self, act: Callable[[Floats, Fields], None], /) -> None:
        """Let a function on the host add to the rates."""

    def take_slopes(self) -> None:
        """Store the density gradients for the next step."""

    def correct(self, time_step: float, /) -> None:
        """Complete a time step [s] with the rates at its end."""

    def shift(self, factor: float, /) -> None:
        """Shift particles against the concentration gradient times a factor [m^2]."""


@dataclass(slots=True)
class Simulation:
    """A moving liquid between walls.

    Attributes:
        start: Initial fields; a device may use the arrays without copying them.
        fluids: Number of liquid particles, the first ones.
        law: Parameters of the pair interactions.
        surface: Tracked surface; None without surface tension.
        device: Creates particles from fields, number of liquid particles and law.
        held: Number of fixed particles after the liquid's that still carry the surface.
        particles: Particles, with positions, velocities and densities at ``time``.
        time: Time [s].
        steps: Number of time steps.
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
        """Fields of all particles."""
        return self.particles.fields

    @property
    def rates(self) -> Floats:
        """Rates of the liquid at the last positions, as ``rates_of`` returns them, shape (10, n)."""
        return self.particles.rates

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy of the liquid [J]."""
        fields = self.fields
        u, v, w = (speed[: self.fluids] for speed in (fields.u, fields.v, fields.w))
        return 0.5 * float(fields.mass[: self.fluids] @ (u * u + v * v + w * w))

    @property
    def volume(self) -> float:
        """Volume of the liquid particles [m^3]."""
        return float((self.fields.mass[: self.fluids] / self.fields.density[: self.fluids]).sum())

    @property
    def elastic_energy(self) -> float:
        """Energy of compression of the liquid from its rest density [J]."""
        density, mass = (values[: self.fluids] for values in (self.fields.density, self.fields.mass))
        ratio = density / self.law.rest_density
        return self.law.sound**2 * float(mass @ (np.log(ratio) + 1.0 / ratio - 1.0))

    @property
    def fastest(self) -> float:
        """Largest speed of the liquid [m/s]."""
        return self.particles.fastest

    @property
    def pressures(self) -> Floats:
        """Pressure of the liquid particles including the surface pressure, shape (fluids,) [Pa]."""
        return self.fields.pressure[: self.fluids] + (self.surface.pressure if self.surface else 0.0)

    def saved(self) -> dict[str, Any]:
        """Return the state, for a checkpoint."""
        return {
            "fields": self.fields._asdict(), "rates": self.rates, "built_at": self.particles.built_at,
            "builds": self.particles.builds, "time": self.time, "steps": self.steps,
            "surface": self.surface.saved() if self.surface else None,
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self.particles.restore(Fields(**saved["fields"]), saved["rates"], saved["built_at"], saved["builds"])
        self.time, self.steps = saved["time"], saved["steps"]
        if self.surface:
            self.surface.restore(saved["surface"])

    def time_step(self) -> float:
        """Return the largest stable time step [s]."""
        law, tension = self.law, self.surface.tension if self.surface else 0.0
        viscosity = self.particles.largest_viscosity if law.rheology else law.viscosity
        viscosity *= CENTRAL if law.has_surface else 1.0
        return largest_time_step(law.length, law.sound + self.fastest, law.rest_density, viscosity, tension)

    def step(self, time_step: float) -> None:
        """Advance by a time step [s].

        Rates at the new time depend on velocities and densities at that time; predictions from the last rates replace
        them, which preserves second order.
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
        """Return the volume of the particles that carry the surface, without those outside it [m^3]."""
        carriers, fields, surface = slice(self.fluids + self.held), self.fields, self.surface
        assert surface is not None
        volumes = fields.mass[carriers] / fields.density[carriers]
        surface.find_spray([coordinate[carriers] for coordinate in fields[:3]], volumes)
        return float(volumes.sum()) - surface.spray

    def _find_rates(self) -> None:
        """Compute the rates for the present fields, including surface tension."""
        self.particles.find_rates()
        if self.surface:
            carriers, surface = self.fluids + self.held, self.surface
            self.particles.add(lambda rates, fields: surface.add_to(rates, fields, carriers))
