"""BDF2 for variable steps, written as a backward Euler step from a shifted start.

With r = dt / dt_before, BDF2 reads x = x_base + dt_eff v and v = v_base + dt_eff a, where
dt_eff = dt (1 + r) / (1 + 2 r), x_base = x_n + w (x_n - x_before), v_base = v_n + w (v_n - v_before) and
w = r^2 / (1 + 2 r). The first step is backward Euler. A mode of frequency omega is damped at a rate of
omega^4 dt^3 / 4 and slowed by a fraction (omega dt)^2 / 3. ``prepare_physics`` converts effects to that backward
Euler step.
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
    """Start of the equivalent backward Euler step.

    Attributes:
        points: Positions, shape (n, 3) [m].
        velocity: Velocity, shape (n, 3) [m/s].
        time_step: Effective time step [s].
        weight: Weight w of the last step.
    """

    points: Floats
    velocity: Floats
    time_step: float
    weight: float


@dataclass(frozen=True, slots=True)
class LastStep:
    """Last step of a two-step method.

    Attributes:
        displacement: Displacement, shape (n, 3) [m].
        velocity_change: Change of the velocity, shape (n, 3) [m/s].
        time_step: Size of the step [s]; infinite before the first step.
    """

    displacement: Floats
    velocity_change: Floats
    time_step: float = np.inf

    @classmethod
    def start(cls, count: int) -> Self:
        """Return the history of ``count`` particles before their first step."""
        return cls(np.zeros((count, 3)), np.zeros((count, 3)))


@dataclass(frozen=True, slots=True)
class BackwardDifference(LastStep):
    """Last step, continued by BDF2."""

    def base(self, points: Floats, velocity: Floats, time_step: float) -> Base:
        """Return the start of the equivalent backward Euler step.

        Args:
            points: Current positions, shape (n, 3) [m].
            velocity: Current velocity, shape (n, 3) [m/s].
            time_step: Time step [s].
        """
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
    """Implicit surface tension in a step from predicted positions, which already contain its displacement.

    Attributes:
        tension: Surface tension.
        velocity: Predicted velocity, shape (n, 3) [m/s].
    """

    tension: SurfaceTension
    velocity: Floats

    def load(self, body: Body, space: Discretisation, time_step: float) -> Floats:
        """Return dt gamma K v with the predicted velocity, shape (n, 3) [N]."""
        matrix = self.tension.matrix(body, space, time_step)
        return np.ascontiguousarray((matrix @ self.velocity.T.ravel()).reshape(3, -1).T)


@dataclass(frozen=True, slots=True, eq=False)
class SteppedMotion:
    """Motion of a plate in the equivalent backward Euler step; it is exact at the end of the whole step.

    Attributes:
        motion: Motion of the plate.
        carried: Displacement and rotation carried on from the last step, shape (6,) [m, rad].
        whole: Whole time step [s].
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
        """Twists with which the plate floats, shape (k, 6)."""
        return self.motion.directions

    @property
    def load(self) -> Floats:
        """External force on the plate, shape (3,) [N]."""
        return self.motion.load

    def prescribed_twist(self, plate: Plate, time_step: float) -> Floats:
        """Return the twist at the end of the step, shape (6,) [m/s, rad/s]."""
        return (self.whole * self.motion.prescribed_twist(plate, self.whole) - self.carried) / time_step

    def after_split(self, wall: int) -> PlateMotion | None:
        """Return the motion of the plate after the body has split."""
        return self.motion.after_split(wall)


def prepare_physics(physics: Physics, velocity: Floats, carried: dict[int, Floats], time_step: float) -> Physics:
    """Return the physics for a two-step method (BDF2) that is solved as a backward Euler step from predicted positions.

    Surface tension and the motions of plates are corrected for the displacement that the prediction already contains.

    Args:
        physics: Effects that act on the body; not changed.
        velocity: Velocity of the particles in the prediction, shape (n, 3) [m/s].
        carried: Number of a moving plate -> displacement carried on from the last step, shape (6,) [m, rad].
        time_step: Whole time step [s].

    Returns:
        Copy of the physics with these corrections.
    """
    tensions = (part for part in physics.operators if isinstance(part, SurfaceTension))
    momenta = (*physics.momenta, *(PredictedTension(tension, velocity) for tension in tensions))
    motions = tuple(SteppedMotion(motion, carried[motion.wall], time_step) for motion in physics.motions)
    return replace(physics, momenta=momenta, motions=motions)
