"""Time integration of second order: BDF2 for any ratio of steps, as a backward Euler step from a shifted start.

With r = dt / dt_before, BDF2 reads x = x_base + dt_eff v and v = v_base + dt_eff a; dt_eff = dt (1 + r) / (1 + 2 r),
x_base = x_n + w (x_n - x_before), v_base = v_n + w (v_n - v_before), w = r^2 / (1 + 2 r). The first step is backward
Euler. A mode of frequency omega is damped at a rate of omega^4 dt^3 / 4 and slowed by a fraction (omega dt)^2 / 3.
`stepped` gives the effects as that backward Euler step sees them.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.discretisation.discretisation import Discretisation
from reflowshock.particles.physics.forces import SurfaceTension
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.physics.plate_motion import PlateMotion


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
class LastStep:
    """The last step: its displacement and change of velocity, `(n, 3)`, and its size [s]; infinite at the start."""

    displacement: Floats
    velocity_change: Floats
    time_step: float = np.inf

    @classmethod
    def start(cls, count: int) -> Self:
        """Start a body of `count` particles."""
        return cls(np.zeros((count, 3)), np.zeros((count, 3)))


@dataclass(frozen=True, slots=True)
class BackwardDifference(LastStep):
    """The last step, as this method continues it."""

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


@dataclass(frozen=True, slots=True)
class PredictedTension:
    """Surface tension has moved the body to the predicted positions already: only the rest is implicit.

    Attributes:
        tension: the surface tension.
        velocity: of the prediction, `(n, 3)` [m/s].
    """

    tension: SurfaceTension
    velocity: Floats

    def load(self, body: Body, space: Discretisation, time_step: float) -> Floats:
        """Return dt gamma K v, `(n, 3)` [N]."""
        matrix = self.tension.matrix(body, space, time_step)
        return np.ascontiguousarray((matrix @ self.velocity.T.ravel()).reshape(3, -1).T)


@dataclass(frozen=True, slots=True, eq=False)
class SteppedMotion:
    """Motion of a plate as the equivalent backward Euler step sees it: after the whole step it is where it should be.

    Attributes:
        motion: of the plate.
        carried: `(6,)` displacement and rotation from the last step that the step starts with [m, rad].
        whole: the whole time step [s].
    """

    motion: PlateMotion
    carried: Floats
    whole: float

    @property
    def wall(self) -> int:
        """Index of the plate."""
        return self.motion.wall

    @property
    def directions(self) -> Floats:
        """The twists with which the plate moves freely, `(k, 6)`."""
        return self.motion.directions

    @property
    def load(self) -> Floats:
        """Force on the plate besides the solder's, `(3,)` [N]."""
        return self.motion.load

    def given(self, plate: Plate, time_step: float) -> Floats:
        """Twist `(6,)` at the end of the step [m/s, rad/s]."""
        return (self.whole * self.motion.given(plate, self.whole) - self.carried) / time_step


def stepped(physics: Physics, velocity: Floats, carried: dict[int, Floats], time_step: float) -> Physics:
    """Physics of a step [s] at the positions that a velocity `(n, 3)` predicts.

    Args:
        physics: what acts on the body.
        velocity: of the prediction [m/s].
        carried: `(6,)` of each plate that moves, what the last step carries it on [m, rad].
        time_step: the whole step [s].
    """
    tensions = (part for part in physics.operators if isinstance(part, SurfaceTension))
    momenta = (*physics.momenta, *(PredictedTension(tension, velocity) for tension in tensions))
    motions = tuple(SteppedMotion(motion, carried[motion.wall], time_step) for motion in physics.motions)
    return replace(physics, momenta=momenta, motions=motions)
