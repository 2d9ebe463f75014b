"""Time integration of second order with little damping: a one-leg method of two steps, as a backward Euler step.

The step's equations hold for means over three times, X = b2 x + b1 x_n + b0 x_before and V likewise, with
b = (1, 2 R, R^2) / (1 + R)^2, and x - x_n = w (x_n - x_before) + (1 - w) dt V, v likewise with the acceleration. Both
roots of what is stiff are -R (one-leg form of Jansen, Whiting and Hulbert's method, 2000); R = 0 is BDF2, R = 1 the
midpoint rule. A mode of frequency omega is damped at a rate of omega^4 dt^3 / 4 times ((1 - R) / (1 + R))^3.

With a start that is shifted, that is a backward Euler step: X = X_base + dt_eff V, V = V_base + dt_eff a. Where steps
differ, the last one is made as long as this one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.particles.steps.backward_difference import Base

# What is left of stiff modes after a step. At a half, 30 steps of a period damp by 3 % of what viscosity does at an
# Ohnesorge number of 2e-3, BDF2 by 65 %.
RADIUS = 0.5
# Shares of the new, the present and the last state in the means; what a step carries on of the last one.
NEW, OLD = 1.0 / (1.0 + RADIUS) ** 2, RADIUS**2 / (1.0 + RADIUS) ** 2
CARRIED = (1.0 - 3.0 * RADIUS) / (3.0 - RADIUS)


@dataclass(frozen=True, slots=True)
class OneLeg:
    """The last step: its displacement and change of velocity, `(n, 3)`, and its size [s]; infinite at the start."""

    displacement: Floats
    velocity_change: Floats
    time_step: float = np.inf

    @classmethod
    def start(cls, count: int) -> "OneLeg":
        """Start a body of `count` particles."""
        return cls(np.zeros((count, 3)), np.zeros((count, 3)))

    def stopped(self, held: NDArray[np.bool_]) -> "OneLeg":
        """The last step without the motion of particles `(n,)` that something has caught since."""
        still = held[:, None]
        displacement, change = (np.where(still, 0.0, field) for field in (self.displacement, self.velocity_change))
        return OneLeg(displacement, change, self.time_step)

    def as_long_as(self, time_step: float, velocity: Floats) -> "OneLeg":
        """The last step, had it been as long as a time step [s] and led to the velocity `(n, 3)` that there is now."""
        if not np.isfinite(self.time_step):
            return OneLeg(time_step * velocity, np.zeros_like(velocity), time_step)
        ratio = time_step / self.time_step
        bend = 0.5 * time_step * (1.0 - ratio) * self.velocity_change
        return OneLeg(ratio * self.displacement + bend, ratio * self.velocity_change, time_step)

    @property
    def leg(self) -> float:
        """Time that the mean velocity goes on for in a step that follows and is as long [s]."""
        return (1.0 - CARRIED) * self.time_step

    def base(self, points: Floats, velocity: Floats) -> Base:
        """Start of the equivalent step from positions and velocities `(n, 3)` now, as long as the last one."""
        weight = NEW * CARRIED - OLD
        return Base(
            points=points + weight * self.displacement,
            velocity=velocity + weight * self.velocity_change,
            time_step=NEW * self.leg,
            weight=weight,
        )

    def followed_by(self, velocity: Floats, mean: Floats) -> "OneLeg":
        """The next step, from a velocity `(n, 3)`, with the mean velocity V `(n, 3)`."""
        return OneLeg(
            displacement=CARRIED * self.displacement + self.leg * mean,
            velocity_change=(mean - velocity + OLD * self.velocity_change) / NEW,
            time_step=self.time_step,
        )
