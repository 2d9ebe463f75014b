"""Adaptive time step: bounded by the displacement in a step, the energy, and a multiple of the capillary limit."""

from dataclasses import dataclass
from math import ceil, pi

import numpy as np

from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.reference.drop_oscillation import cap_frequency, lamb_decay_rate, rayleigh_frequency

LARGEST_DISPLACEMENT = 0.25
GROWTH = 1.15
# Shares of the displacement bound at which a step that was cut, and the next one, aim.
SAFETY = 0.8
AIM = 0.9
# Share of the largest step below which no smaller one is tried.
SMALLEST_SHARE = 1e-9
# Longest step of the scheme ispg, in periods of the drop's swing: it keeps the decay of 1 mm^3 of real solder to 5 %.
LONGEST_OF_SWING = 1.0 / 30.0
# Steps to rest, where a case does not say how many at most; with ispg, besides, those in which a free drop's swing
# would decay by exp(-40).
MOST_STEPS, DECAYS = 1000, 40.0


class StepCollapsed(RuntimeError):
    """No time step is so small that particles move by less than a quarter of their spacing and energy does not rise."""


def capillary_limit(density: float, spacing: float, surface_tension: float) -> float:
    """Largest stable step of an explicit surface tension, 0.25 sqrt(rho h^3 / (2 pi gamma)) [s]."""
    return float(0.25 * np.sqrt(density * spacing**3 / (2.0 * np.pi * surface_tension)))


def swing_period(solder: Solder, angle: float | None = None) -> float:
    """Period of the slowest mode of a drop of all the solder, free or with a contact angle [rad] on a wall [s]."""
    if angle is not None:
        return 2.0 * pi / cap_frequency(angle, solder.volume, solder.density, solder.surface_tension)
    return 2.0 * pi / rayleigh_frequency(2, _radius(solder), solder.density, solder.surface_tension)


def largest_step(solder: Solder, spacing: float) -> tuple[float, str]:
    """Upper bound of the time step [s] of particles at a spacing [m], and what it is."""
    largest = solder.numerics.time_step_limit * capillary_limit(solder.density, spacing, solder.surface_tension)
    of_swing = LONGEST_OF_SWING * swing_period(solder)
    if solder.numerics.scheme == "ispg" and largest > of_swing:
        return of_swing, "swing"
    return largest, "capillary multiple"


def most_steps(solder: Solder, spacing: float) -> int:
    """Steps after which a run to rest has failed: what the case says, else what the scheme may need."""
    numerics = solder.numerics
    if numerics.max_steps is not None:
        return numerics.max_steps
    if numerics.scheme != "ispg":
        return MOST_STEPS
    decay = DECAYS / lamb_decay_rate(2, _radius(solder), solder.density, solder.viscosity)
    return MOST_STEPS + ceil(min(decay, solder.process_time) / largest_step(solder, spacing)[0])


def _radius(solder: Solder) -> float:
    """Radius of a free drop of all the solder [m]."""
    return float(np.cbrt(0.75 * solder.volume / pi))


@dataclass(slots=True)
class TimeStep:
    """The step size and what binds it.

    Attributes:
        largest: upper bound [s].
        spacing: particle spacing [m].
        size: current step [s].
        binding: that of the upper bound, "growth", "displacement", "energy" or, for one made longer, "steady motion".
        bound: what the upper bound is.
    """

    largest: float
    spacing: float
    size: float
    binding: str = "capillary multiple"
    bound: str = "capillary multiple"

    def accepts(self, speed: float) -> bool:
        """Whether a largest particle speed [m/s] moves no particle too far; else the step is cut.

        Raises:
            StepCollapsed: the step would be 1e-9 of its upper bound.
        """
        displacement = speed * self.size
        if displacement <= LARGEST_DISPLACEMENT * self.spacing:
            return True
        moves = f"the fastest particle still moves {displacement / self.spacing:.3g} spacings in it"
        self._cut(max(0.25, SAFETY * LARGEST_DISPLACEMENT * self.spacing / displacement), "displacement", moves)
        return False

    def cut_for_energy(self) -> None:
        """Cut a step that raises the energy; a short enough one does not.

        Raises:
            StepCollapsed: the step would be 1e-9 of its upper bound.
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
        """How many steps of this size a largest particle speed [m/s] allows in one; one, unless it is at its bound."""
        if self.size < self.largest:
            return 1.0
        return AIM * LARGEST_DISPLACEMENT * self.spacing / max(speed * self.size, float(np.finfo(float).tiny))

    def prolong(self, steps: float) -> None:
        """Make this step as long as several; the next one has the bound again."""
        self.size, self.binding = steps * self.size, "steady motion"

    def grow(self, speed: float) -> None:
        """Grow after an accepted step, up to the bound and as far as a largest particle speed [m/s] allows."""
        displacement = LARGEST_DISPLACEMENT * self.spacing
        self.size, self.binding = GROWTH * self.size, "growth"
        if self.size * speed > AIM * displacement:
            self.size, self.binding = AIM * displacement / speed, "displacement"
        if self.size >= self.largest:
            self.size, self.binding = self.largest, self.bound
