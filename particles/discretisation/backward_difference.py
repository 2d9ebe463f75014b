"""Time integration of second order: BDF2 for any ratio of steps, as a backward Euler step from a shifted start.

With r = dt / dt_before, BDF2 reads x = x_base + dt_eff v and v = v_base + dt_eff a; dt_eff = dt (1 + r) / (1 + 2 r),
x_base = x_n + w (x_n - x_before), v_base = v_n + w (v_n - v_before), w = r^2 / (1 + 2 r). The first step is backward
Euler. A mode of frequency omega is damped at a rate of omega^4 dt^3 / 4 and slowed by a fraction (omega dt)^2 / 3.
"""

from dataclasses import dataclass

import numpy as np

from reflowshock.arrays import Floats


@dataclass(frozen=True, slots=True)
class Base:
    """Where the equivalent backward Euler step starts.

    Attributes:
        points: `(n, 3)` [m].
        velocity: `(n, 3)` [m/s].
        time_step: [s].
        weight: of the last step.
    """

    points: Floats
    velocity: Floats
    time_step: float
    weight: float


@dataclass(frozen=True, slots=True)
class BackwardDifference:
    """The last step: its displacement and change of velocity, `(n, 3)`, and its size [s]; infinite at the start."""

    displacement: Floats
    velocity_change: Floats
    time_step: float = np.inf

    @classmethod
    def start(cls, count: int) -> "BackwardDifference":
        """Start a body of `count` particles."""
        return cls(np.zeros((count, 3)), np.zeros((count, 3)))

    def base(self, points: Floats, velocity: Floats, time_step: float) -> Base:
        """Start of the equivalent step from positions and velocities `(n, 3)` now, for a time step [s]."""
        ratio = time_step / self.time_step
        weight = ratio**2 / (1.0 + 2.0 * ratio)
        return Base(
            points=points + weight * self.displacement,
            velocity=velocity + weight * self.velocity_change,
            time_step=time_step * (1.0 + ratio) / (1.0 + 2.0 * ratio),
            weight=weight,
        )
