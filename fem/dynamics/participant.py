"""The participants of a run: what all of them do in a window, and one model alone.

``begin_window`` and ``finish_window`` are apart, so that one rank can also carry several models and take turns: what
others wait for is sent in the first, what needs their answer is done in the second. Messages between models go through
two channels and nothing else. The participants of each scheme are in ``fem/coupling``.
"""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.loads.load import Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.portable import State, Sum


class Participant(Protocol):
    """One model on one rank.

    Attributes:
        plan: Window and substeps.
        interface_work: Work [J] of this rank's share across the interface: put in by the macro model, received by the
            meso model.
    """

    plan: WindowPlan
    interface_work: float

    @property
    def motion(self) -> Motion:
        """Return its state."""

    def begin_window(self) -> None:
        """Do what must come before other models of the rank have their turn."""

    def finish_window(self) -> None:
        """Do the rest of the window."""

    def interface_force(self) -> NDArray[np.float64]:
        """Return the forces ``(n, 3)`` [N] across the interface as this participant knows them, zero elsewhere."""

    def foreign_force(self) -> NDArray[np.float64]:
        """Return the part ``(n, 3)`` [N] of ``motion.force`` that belongs to the other model."""

    def state(self) -> State:
        """Return all that changes from window to window, for a checkpoint."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from the values of what ``state`` returned."""


class Continued:
    """What a participant keeps for a restart.

    Attributes:
        motion: Its state.
        interface_work: See ``Participant``.
    """

    motion: Motion
    interface_work: float

    def state(self) -> State:
        """Return the motion's state and the work across the interface."""
        return {"motion": self.motion.state(), "interface_work": Sum(self.interface_work)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from the values of what ``state`` returned."""
        self.motion.restore(state["motion"])
        self.interface_work = state["interface_work"]


class Alone(Continued):
    """One model without an interface: a DNS, all steps small, or a structure."""

    def __init__(self, motion: Motion, plan: WindowPlan) -> None:
        """Take a motion that is ready to advance by the plan's steps."""
        self.motion = motion
        self.interface_work = 0.0
        self.plan = plan
        self._zero = np.zeros_like(self.motion.force)

    def begin_window(self) -> None:
        """Take m substeps."""
        self.motion.take_steps(self.plan.substeps)

    def finish_window(self) -> None:
        """Do nothing: the window is done."""

    def interface_force(self) -> NDArray[np.float64]:
        """Return zero: there is no coupling interface."""
        return self._zero

    def foreign_force(self) -> NDArray[np.float64]:
        """Return zero: all forces are this model's."""
        return self._zero


def explicit_motion(body: Body, loads: list[Load], step: float) -> ExplicitMotion:
    """Return the motion from rest of a model without an interface."""
    return ExplicitMotion(body, loads, step, np.empty(0, np.int32), np.zeros(len(body.mass)))
