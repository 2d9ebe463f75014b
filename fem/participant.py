"""The participants of a run: macro and meso model of the two-scale scheme, or one model alone.

A window of the held-velocity scheme (held cut velocity; the cut lies two layers of elements inside the board):
macro: a_n = (F_ext + F_c - F_int) / (M + M_interface) -> v^{n+1/2}, U^{n+1}; the cut's v^{n+1/2} goes to the meso
model, which takes m substeps with it WHILE the macro model computes F_int(U^{n+1}); F_c = -(K u)_cut comes back at the
end. Messages go through two channels and nothing else; ``Macro.begin_window`` and ``finish_window`` are apart, so that
one rank can also carry both models and take turns.
"""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fem.body import Body
from fem.estimate import WindowPlan
from fem.exchange import CutChannels
from fem.kernels.motion import add_impulse
from fem.loads import Load
from fem.motion import Motion
from fem.moving import Moving


class Participant(Protocol):
    """One model on one rank.

    Attributes:
        plan: Window and substeps.
        interface_work: Work [J] of this rank's share across the cut: put in by the macro, received by the meso model.
    """

    plan: WindowPlan
    interface_work: float

    @property
    def motion(self) -> Moving:
        """Return its state."""

    def begin_window(self) -> None:
        """Do what must come before other models of the rank have their turn."""

    def finish_window(self) -> None:
        """Do the rest of the window."""

    def cut_force(self) -> NDArray[np.float64]:
        """Return the forces ``(n, 3)`` [N] across the cut as this participant knows them, zero elsewhere."""

    def foreign_force(self) -> NDArray[np.float64]:
        """Return the part ``(n, 3)`` [N] of ``motion.force`` that belongs to the other model."""

    def state(self) -> dict[str, Any]:
        """Return all that changes from window to window, for a checkpoint."""

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from what ``state`` returned."""


class Continued:
    """What a participant keeps for a restart.

    Attributes:
        motion: Its state.
        interface_work: See ``Participant``.
    """

    motion: Moving
    interface_work: float

    def state(self) -> dict[str, Any]:
        """Return the motion's state and the work across the cut."""
        return {"motion": self.motion.state(), "interface_work": self.interface_work}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from what ``state`` returned."""
        self.motion.restore(state["motion"])
        self.interface_work = state["interface_work"]


class Alone(Continued):
    """One model without a cut: a DNS, all steps small, or a structure."""

    def __init__(self, motion: Moving, plan: WindowPlan) -> None:
        """Take a motion that is ready to advance by the plan's steps."""
        self.motion = motion
        self.interface_work = 0.0
        self.plan = plan
        self._zero = np.zeros_like(self.motion.force)

    def begin_window(self) -> None:
        """Take m substeps."""
        for _ in range(self.plan.substeps):
            self.motion.advance()
            self.motion.update_force()

    def finish_window(self) -> None:
        """Do nothing: the window is done."""

    def cut_force(self) -> NDArray[np.float64]:
        """Return zero: there is no cut."""
        return self._zero

    def foreign_force(self) -> NDArray[np.float64]:
        """Return zero: all forces are this model's."""
        return self._zero


class Macro(Continued):
    """The board: one step a window."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: CutChannels) -> None:
        """Receive the interface mass and start at rest; a ``Meso`` must have sent it."""
        self._channels = channels
        self._received = np.zeros((len(body.mass), 3))
        channels.forces.receive(self._received)
        self.motion = Motion(body, loads, plan.window, np.empty(0, np.int32), self._received[:, 0].copy())
        self._received[:] = 0.0
        self.plan = plan
        self._counted = counted_cut(body)
        self.interface_work = 0.0

    def begin_window(self) -> None:
        """Move, and send the cut's velocity."""
        self.motion.advance()
        self._channels.velocities.send(self.motion.velocity)

    def finish_window(self) -> None:
        """Compute the force, and receive the meso model's."""
        motion = self.motion
        motion.update_force()
        before = self._received[self._counted]
        self._channels.forces.receive(self._received)
        motion.force += self._received
        impulse = 0.5 * motion.step * (before + self._received[self._counted])
        self.interface_work -= float(np.sum(impulse * motion.velocity[self._counted]))

    def cut_force(self) -> NDArray[np.float64]:
        """Return the received force at the cut."""
        return self._received

    def foreign_force(self) -> NDArray[np.float64]:
        """Return the received force: it is in ``motion.force``."""
        return self._received

    def state(self) -> dict[str, Any]:
        """Return also the received force."""
        return super().state() | {"received": self._received}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from what ``state`` returned."""
        super().restore(state)
        self._received[:] = state["received"]


class Meso(Continued):
    """Joints, package and the uppermost board layers: m substeps a window."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: CutChannels) -> None:
        """Send the interface mass and start at rest."""
        self._channels = channels
        channels.forces.send(np.repeat(body.mass[:, None], 3, axis=1))
        held = body.cut[body.cut >= 0]
        self.motion = Motion(body, loads, plan.step, held, np.zeros(len(body.mass)))
        self.plan = plan
        self._counted = counted_cut(body)
        self._cut_force = np.zeros((len(body.mass), 3))
        self._zero = np.zeros_like(self._cut_force)
        self.interface_work = 0.0

    def begin_window(self) -> None:
        """Take m substeps at the received velocity of the cut, then send its force."""
        motion = self.motion
        self._channels.velocities.receive(motion.velocity)
        impulse = np.zeros((len(self._counted), 3))
        add_impulse(self._counted, motion.force, 0.5 * motion.step, impulse)
        for _ in range(self.plan.substeps):
            motion.advance()
            motion.update_force()
            add_impulse(self._counted, motion.force, motion.step, impulse)
        add_impulse(self._counted, motion.force, -0.5 * motion.step, impulse)
        self._channels.forces.send(motion.force)
        self.interface_work -= float(np.sum(impulse * motion.velocity[self._counted]))

    def finish_window(self) -> None:
        """Do nothing: the window is done."""

    def cut_force(self) -> NDArray[np.float64]:
        """Return the force that was sent."""
        self._cut_force[self._counted] = self.motion.force[self._counted]
        return self._cut_force

    def foreign_force(self) -> NDArray[np.float64]:
        """Return zero: all forces are this model's."""
        return self._zero


def uncut_motion(body: Body, loads: list[Load], step: float) -> Motion:
    """Return the motion from rest of a model without a cut."""
    return Motion(body, loads, step, np.empty(0, np.int32), np.zeros(len(body.mass)))


def counted_cut(body: Body) -> NDArray[np.int32]:
    """Return the local cut nodes that count on this rank: those that it owns."""
    here = body.cut[body.cut >= 0]
    return here[body.shared.owned[here]]
