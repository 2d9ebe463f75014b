"""Adaptive time step, bounded by the displacement, the energy, and a multiple of the capillary limit."""

from dataclasses import dataclass
from math import ceil, pi

import numpy as np

from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.reference.drop_oscillation import cap_frequency, lamb_decay_rate, rayleigh_frequency

LARGEST_DISPLACEMENT = 0.25
GROWTH = 1.15
# Shares of the displacement bound that a step that was cut, and the next step, aim at.
SAFETY = 0.8
AIM = 0.9
# Smallest step over the largest one.
SMALLEST_SHARE = 1e-9
# Longest step of the scheme ispg in periods of a drop's oscillation; the decay of 1 mm^3 of solder is within 5 %.
LONGEST_OF_SWING = 1.0 / 30.0
# Default of the largest number of steps to rest; ispg adds those in which a free drop's oscillation decays by exp(-40).
MOST_STEPS, DECAYS = 1000, 40.0


class StepCollapsed(RuntimeError):
    """Error of a time step that was reduced to a billionth of its upper bound."""


def capillary_limit(density: float, spacing: float, surface_tension: float) -> float:
    """Return the largest stable step of explicit surface tension, 0.25 sqrt(rho h^3 / (2 pi gamma)) [s].

    Args:
        density: Density [kg/m^3].
        spacing: Particle spacing h [m].
        surface_tension: Surface tension [N/m].
    """
    return float(0.25 * np.sqrt(density * spacing**3 / (2.0 * np.pi * surface_tension)))


def swing_period(solder: Solder, angle: float | None = None) -> float:
    """Return the period of the slowest oscillation of a drop that contains all the solder [s].

    Args:
        solder: Solder of the case: volume, fluid, contact angles and numerics.
        angle: Contact angle of a drop on a wall [rad]; None for a free drop.
    """
    if angle is not None:
        return 2.0 * pi / cap_frequency(angle, solder.volume, solder.density, solder.surface_tension)
    return 2.0 * pi / rayleigh_frequency(2, _radius(solder), solder.density, solder.surface_tension)


def largest_step(solder: Solder, spacing: float) -> tuple[float, str]:
    """Return the upper bound of the time step and the name of the bound.

    Args:
        solder: Fluid, and numerics with the limit as a multiple of the capillary limit.
        spacing: Particle spacing [m].

    Returns:
        Time step [s], and "swing" (a share of the slowest period, with ispg) or "capillary multiple".
    """
    largest = solder.numerics.time_step_limit * capillary_limit(solder.density, spacing, solder.surface_tension)
    of_swing = LONGEST_OF_SWING * swing_period(solder)
    if solder.numerics.scheme == "ispg" and largest > of_swing:
        return of_swing, "swing"
    return largest, "capillary multiple"


def most_steps(solder: Solder, spacing: float) -> int:
    """Return the number of steps after which a run to rest has failed, from the case or estimated for the scheme.

    Args:
        solder: Solder of the case; its ``numerics.max_steps`` is returned unless it is None.
        spacing: Particle spacing [m].
    """
    numerics = solder.numerics
    if numerics.max_steps is not None:
        return numerics.max_steps
    if numerics.scheme != "ispg":
        return MOST_STEPS
    decay = DECAYS / lamb_decay_rate(2, _radius(solder), solder.density, solder.viscosity)
    return MOST_STEPS + ceil(min(decay, solder.process_time) / largest_step(solder, spacing)[0])


def _radius(solder: Solder) -> float:
    """Return the radius of a free drop of all the solder [m]."""
    return float(np.cbrt(0.75 * solder.volume / pi))


@dataclass(slots=True)
class TimeStep:
    """Time step and the criterion that bounds it.

    Attributes:
        largest: Upper bound [s].
        spacing: Particle spacing [m].
        size: Current time step [s].
        binding: Criterion that bounds it: ``bound``, "growth", "displacement", "energy" or "steady motion".
        bound: Name of the upper bound.
    """

    largest: float
    spacing: float
    size: float
    binding: str = "capillary multiple"
    bound: str = "capillary multiple"

    def accepts(self, speed: float) -> bool:
        """Return whether no particle moves too far at a largest speed [m/s]; otherwise reduce the step.

        Raises:
            StepCollapsed: The step would be 1e-9 of its upper bound.
        """
        displacement = speed * self.size
        if displacement <= LARGEST_DISPLACEMENT * self.spacing:
            return True
        moves = f"the fastest particle still moves {displacement / self.spacing:.3g} spacings in it"
        self._cut(max(0.25, SAFETY * LARGEST_DISPLACEMENT * self.spacing / displacement), "displacement", moves)
        return False

    def cut_for_energy(self) -> None:
        """Halve a step that raises the energy; a sufficiently short one does not.

        Raises:
            StepCollapsed: The step would be 1e-9 of its upper bound.
        """
        self._cut(0.5, "energy", "the energy still rises in it")

    def _cut(self, share: float, binding: str, trouble: str) -> None:
        if not self.size > SMALLEST_SHARE * self.largest:
            raise StepCollapsed(
                f"the time step was reduced to {self.size:.2e} s, {SMALLEST_SHARE:g} of its upper bound, and {trouble}:"
                " the flow is unstable"
            )
        self.size, self.binding = share * self.size, binding

    def steps_within_reach(self, speed: float) -> float:
        """Return the number of steps that a largest particle speed [m/s] allows at once; one below the upper bound."""
        if self.size < self.largest:
            return 1.0
        return AIM * LARGEST_DISPLACEMENT * self.spacing / max(speed * self.size, float(np.finfo(float).tiny))

    def prolong(self, steps: float) -> None:
        """Lengthen this step to several steps; the next one is bounded again."""
        self.size, self.binding = steps * self.size, "steady motion"

    def grow(self, speed: float) -> None:
        """Grow after an accepted step, up to the bound and as far as a largest particle speed [m/s] permits."""
        displacement = LARGEST_DISPLACEMENT * self.spacing
        self.size, self.binding = GROWTH * self.size, "growth"
        if self.size * speed > AIM * displacement:
            self.size, self.binding = AIM * displacement / speed, "displacement"
        if self.size >= self.largest:
            self.size, self.binding = self.largest, self.bound
