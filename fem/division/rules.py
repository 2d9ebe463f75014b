"""What the division of a mesh follows besides its elements."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.estimates.estimate import WindowPlan, window_plan
from reflowshock.fem.problem.shock import Coupling


@dataclass(frozen=True, slots=True)
class Rules:
    """What a division follows.

    Attributes:
        coupling: What the user wants.
        coarse: ``(ne,)`` cells that are the macro model's where velocities or forces are coupled: a board's.
        fraction: Of the critical step that is used.
        stiffness: beta of damping [s].
        duration: Simulated time [s].
        samples: History samples wanted.
        copied: One way, ``(ne,)`` fine cells of which the driving model has a coarse copy.
        copy: These copies.
    """

    coupling: Coupling
    coarse: NDArray[np.bool_]
    fraction: float
    stiffness: float
    duration: float
    samples: int
    copied: NDArray[np.bool_] | None = None
    copy: NDArray[np.bool_] | None = None

    def plan(self, macro_step: float, meso_step: float) -> WindowPlan:
        """Return the windows that follow from two critical steps [s]."""
        return window_plan(macro_step, meso_step, self.fraction, self.duration, self.samples)
