"""Participants of a coupled run: their common interface, and a single uncoupled model.

A window has two halves, so that one rank can carry several models in turn: ``begin_window`` sends the messages that
other models wait for, ``finish_window`` does the work that needs their answers. Models exchange messages only through
the two channels of the interface. The participants of each scheme are in ``fem/coupling``.
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
from reflowshock.fem.parallel.checkpoint_state import State, Sum


class Participant(Protocol):
    """One model on one rank, advanced window by window.

    Attributes:
        plan: Length of the window and number of substeps.
        interface_work: Work of this rank's share across the interface [J]: done by the macro model, or received by the
            meso model.
    """

    plan: WindowPlan
    interface_work: float

    @property
    def motion(self) -> Motion:
        """State of the model."""

    def begin_window(self) -> None:
        """Do the first half of the window: everything that other models of the rank wait for."""

    def finish_window(self) -> None:
        """Do the second half of the window, with the answers of the other models."""

    def interface_force(self) -> NDArray[np.float64]:
        """Return this participant's forces across the interface, zero elsewhere, shape (n, 3) [N]."""

    def foreign_force(self) -> NDArray[np.float64]:
        """Return the part of ``motion.force`` that belongs to the other model, shape (n, 3) [N]."""

    def state(self) -> State:
        """Return the time-dependent state, for a checkpoint."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore the values that ``state`` returned."""


class Restartable:
    """Checkpoint and restart of a participant.

    Attributes:
        motion: State of the model.
        interface_work: Work across the interface [J], see ``Participant``.
    """

    motion: Motion
    interface_work: float

    def state(self) -> State:
        """Return the motion's state and the work across the interface."""
        return {"motion": self.motion.state(), "interface_work": Sum(self.interface_work)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore the values that ``state`` returned."""
        self.motion.restore(state["motion"])
        self.interface_work = state["interface_work"]


class SingleModel(Restartable):
    """Participant of a run with one model and no interface: a DNS or a structure."""

    def __init__(self, motion: Motion, plan: WindowPlan) -> None:
        """Wrap a motion whose step is the substep of the plan."""
        self.motion = motion
        self.interface_work = 0.0
        self.plan = plan
        self._zero = np.zeros_like(self.motion.force)

    def begin_window(self) -> None:
        """Take all substeps of the window."""
        self.motion.take_steps(self.plan.substeps)

    def finish_window(self) -> None:
        """Do nothing: ``begin_window`` has finished the window."""

    def interface_force(self) -> NDArray[np.float64]:
        """Return zero: there is no coupling interface."""
        return self._zero

    def foreign_force(self) -> NDArray[np.float64]:
        """Return zero: all forces belong to this model."""
        return self._zero


def explicit_motion(body: Body, loads: list[Load], step: float) -> ExplicitMotion:
    """Return the explicit motion (central differences) of a model without an interface, starting at rest.

    Args:
        body: Model on this rank.
        loads: Loads and damping of the model; may be empty.
        step: Time step [s].
    """
    return ExplicitMotion(body, loads, step, np.empty(0, np.int32), np.zeros(len(body.mass)))
