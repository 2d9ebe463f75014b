"""Effects as the backward Euler step sees them that is equivalent to a step of second order (`backward_difference`)."""

from dataclasses import dataclass, replace

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.discretisation.discretisation import Discretisation
from reflowshock.particles.physics.force_surface_tension import SurfaceTension
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.physics.plate_motion import PlateMotion


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
