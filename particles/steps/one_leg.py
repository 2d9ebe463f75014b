"""Time integration of second order with little damping: a one-leg method of two steps, as a backward Euler step.

The step's equations hold for means over three times, X = b2 x + b1 x_n + b0 x_before and V likewise, with
b = (1, 2 R, R^2) / (1 + R)^2, and x - x_n = w (x_n - x_before) + (1 - w) dt V, v likewise with the acceleration. Both
roots of what is stiff are -R (one-leg form of Jansen, Whiting and Hulbert's method, 2000); R = 0 is BDF2, R = 1 the
midpoint rule. A mode of frequency omega is damped at a rate of omega^4 dt^3 / 4 times ((1 - R) / (1 + R))^3.

With a start that is shifted, that is a backward Euler step: X = X_base + dt_eff V, V = V_base + dt_eff a. Where the
last step was another, dt_before, b stays, x - x_n = w (x_n - x_before) + (dt - w dt_before) V, and w keeps the order.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.particles.steps.backward_difference import Base, LastStep

# What is left of stiff modes after a step. At a half, 30 steps of a period damp by 3 % of what viscosity does at an
# Ohnesorge number of 2e-3, BDF2 by 65 %.
RADIUS = 0.5
# Shares of the new and the last state in the means.
NEW, OLD = 1.0 / (1.0 + RADIUS) ** 2, RADIUS**2 / (1.0 + RADIUS) ** 2


@dataclass(frozen=True, slots=True)
class OneLeg(LastStep):
    """The last step, as this method continues it. The first step is one by the midpoint rule."""

    def stopped(self, held: NDArray[np.bool_], carried: Floats) -> "OneLeg":
        """The last step where particles `(n,)` that something has caught since went with it, by `(n, 3)` [m]."""
        still = held[:, None]
        displacement, change = np.where(still, carried, self.displacement), np.where(still, 0.0, self.velocity_change)
        return OneLeg(displacement, change, self.time_step)

    def base(self, points: Floats, velocity: Floats, time_step: float) -> Base:
        """Start of the equivalent step from positions and velocities `(n, 3)` now, for a time step [s]."""
        new, old, carried = self._shares(time_step)
        weight = new * carried - old
        return Base(
            points=points + weight * self.displacement,
            velocity=velocity + weight * self.velocity_change,
            time_step=new * self.leg(time_step),
            weight=weight,
        )

    def leg(self, time_step: float) -> float:
        """Time for which the mean velocity takes the particles on in a step [s]."""
        carried = self._shares(time_step)[2]
        return time_step - carried * self.time_step if carried else time_step

    def mean_along(self, displacement: Floats, time_step: float) -> Floats:
        """Mean velocity V with which the next step [s] has a displacement [m]."""
        return (displacement - self._shares(time_step)[2] * self.displacement) / self.leg(time_step)

    def followed_by(self, velocity: Floats, mean: Floats, time_step: float) -> "OneLeg":
        """The next step [s], from a velocity `(n, 3)`, with the mean velocity V `(n, 3)`."""
        new, old, carried = self._shares(time_step)
        displacement = carried * self.displacement + self.leg(time_step) * mean
        return OneLeg(displacement, (mean - velocity + old * self.velocity_change) / new, time_step)

    def _shares(self, time_step: float) -> tuple[float, float, float]:
        """Of the new and the last state in the means, and what a step [s] carries on of the last one: w."""
        if not np.isfinite(self.time_step):
            return 0.5, 0.0, 0.0
        ratio = time_step / self.time_step
        middle = NEW - OLD / ratio
        return NEW, OLD, (2.0 * middle - 1.0) * ratio**2 / (1.0 + 2.0 * middle * ratio)
