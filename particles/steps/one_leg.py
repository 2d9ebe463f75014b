"""Second-order one-leg method of two steps with little damping, written as a backward Euler step.

The equations hold for means over three time levels, X = b2 x + b1 x_n + b0 x_before and V likewise, with
b = (1, 2 R, R^2) / (1 + R)^2; x - x_n = w (x_n - x_before) + (1 - w) dt V, and v likewise with the acceleration. Both
roots of stiff modes are -R (one-leg form of the method of Jansen, Whiting and Hulbert, 2000); R = 0 is BDF2, R = 1 the
midpoint rule. A mode of frequency omega is damped at a rate of omega^4 dt^3 / 4 times ((1 - R) / (1 + R))^3.

From a shifted start this is a backward Euler step: X = X_base + dt_eff V, V = V_base + dt_eff a. If the last step
dt_before differs from dt, b is unchanged, x - x_n = w (x_n - x_before) + (dt - w dt_before) V, and w keeps the order.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.particles.steps.backward_difference import Base, LastStep

# Spectral radius R of stiff modes. With 1/2 and 30 steps per period the damping is 3 % of the viscous damping at an
# Ohnesorge number of 2e-3; with BDF2 it is 65 %.
RADIUS = 0.5
# Weights of the new and of the state before the last in the means.
NEW, OLD = 1.0 / (1.0 + RADIUS) ** 2, RADIUS**2 / (1.0 + RADIUS) ** 2


@dataclass(frozen=True, slots=True)
class OneLeg(LastStep):
    """Last step, continued by the one-leg method; the first step uses the midpoint rule."""

    def stopped(self, pinned: NDArray[np.bool_], carried: Floats) -> "OneLeg":
        """Return the last step with the displacement of the walls for particles pinned to them since.

        Args:
            pinned: Whether each particle is pinned now, shape (n,).
            carried: Displacement of its wall, shape (n, 3) [m].
        """
        still = pinned[:, None]
        displacement, change = np.where(still, carried, self.displacement), np.where(still, 0.0, self.velocity_change)
        return OneLeg(displacement, change, self.time_step)

    def base(self, points: Floats, velocity: Floats, time_step: float) -> Base:
        """Return the start of the equivalent backward Euler step.

        Args:
            points: Current positions, shape (n, 3) [m].
            velocity: Current velocity, shape (n, 3) [m/s].
            time_step: Time step [s].
        """
        new, old, carried = self._shares(time_step)
        weight = new * carried - old
        return Base(
            points=points + weight * self.displacement,
            velocity=velocity + weight * self.velocity_change,
            time_step=new * self.leg(time_step),
            weight=weight,
        )

    def leg(self, time_step: float) -> float:
        """Return the time for which the mean velocity acts on positions in a step [s], dt - w dt_before."""
        carried = self._shares(time_step)[2]
        return time_step - carried * self.time_step if carried else time_step

    def mean_along(self, displacement: Floats, time_step: float) -> Floats:
        """Return the mean velocity V that gives the next step a displacement.

        Args:
            displacement: Displacement, shape (n, 3) [m] or (6,) [m, rad].
            time_step: Time step [s].
        """
        return (displacement - self._shares(time_step)[2] * self.displacement) / self.leg(time_step)

    def followed_by(self, velocity: Floats, mean: Floats, time_step: float) -> "OneLeg":
        """Return the next step.

        Args:
            velocity: Velocity at its start, shape (n, 3) [m/s].
            mean: Mean velocity V, shape (n, 3) [m/s].
            time_step: Time step [s].
        """
        new, old, carried = self._shares(time_step)
        displacement = carried * self.displacement + self.leg(time_step) * mean
        return OneLeg(displacement, (mean - velocity + old * self.velocity_change) / new, time_step)

    def _shares(self, time_step: float) -> tuple[float, float, float]:
        """Return the weights of the new state and of the state before the last in the means, and w, for a step [s]."""
        if not np.isfinite(self.time_step):
            return 0.5, 0.0, 0.0
        ratio = time_step / self.time_step
        middle = NEW - OLD / ratio
        return NEW, OLD, (2.0 * middle - 1.0) * ratio**2 / (1.0 + 2.0 * middle * ratio)
