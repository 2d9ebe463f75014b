"""Participants that are functions: in place of a macro or a meso model, for tests and for finding faults.

They go through the windows of ``held_velocity`` (``local_steps`` too), or of ``one_way``, with a real partner. Their
interface nodes are numbered as those of the partner's interface: its number k is their node k.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.parallel.exchange import InterfaceChannels

# Velocity of the interface [m/s] from time [s] and points (nc, 3) [m]; force [N] from time, displacement, velocity.
VelocityScript = Callable[[float, NDArray[np.float64]], NDArray[np.float64]]
ForceScript = Callable[[float, NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]


def scripted_interface(count: int) -> NDArray[np.int32]:
    """Return the numbers of the interface nodes of a scripted participant, for ``InterfaceChannels.open``."""
    return np.arange(count, dtype=np.int32)


class ScriptedDriver:
    """A macro model that moves the interface and takes nothing back, as ``one_way.Driver``.

    Attributes:
        time: [s].
    """

    def __init__(
        self, points: NDArray[np.float64], velocity: VelocityScript, plan: WindowPlan, channels: InterfaceChannels
    ) -> None:
        """Start at time zero.

        Args:
            points: ``(nc, 3)`` [m] the interface nodes.
            velocity: Of the interface; asked for at the middle of each window.
            plan: Windows.
            channels: To the meso model.
        """
        self.time, self._points, self._velocity = 0.0, points, velocity
        self._plan, self._channels = plan, channels

    def begin_window(self) -> None:
        """Send the interface's velocity."""
        middle = self.time + 0.5 * self._plan.window
        self._channels.velocities.send(np.broadcast_to(self._velocity(middle, self._points), self._points.shape).copy())
        self.time += self._plan.window

    def finish_window(self) -> None:
        """Do nothing."""


class ScriptedMacro(ScriptedDriver):
    """A macro model that moves the interface, as ``held_velocity.HeldVelocityMacro``.

    Attributes:
        mass: ``(nc, 3)`` [kg] of the meso model at the interface.
        force: ``(nc, 3)`` [N] that it has given back last.
    """

    def __init__(
        self, points: NDArray[np.float64], velocity: VelocityScript, plan: WindowPlan, channels: InterfaceChannels
    ) -> None:
        """Receive the interface mass; a ``HeldVelocityMeso`` must have sent it. Arguments as ``ScriptedDriver``."""
        super().__init__(points, velocity, plan, channels)
        self.mass, self.force = np.zeros_like(points), np.zeros_like(points)
        channels.forces.receive(self.mass)

    def finish_window(self) -> None:
        """Receive the meso model's force."""
        self._channels.forces.receive(self.force)


class ScriptedMeso:
    """A meso model that answers with a force, as ``held_velocity.HeldVelocityMeso``: a spring, a dashpot, a table.

    Attributes:
        time: [s].
        displacement: ``(nc, 3)`` [m] of the interface, ``velocity`` [m/s] that over the window.
        force: ``(nc, 3)`` [N] that was given back last.
    """

    def __init__(
        self, mass: NDArray[np.float64], force: ForceScript, plan: WindowPlan, channels: InterfaceChannels
    ) -> None:
        """Send the interface mass and start at rest.

        Args:
            mass: ``(nc,)`` [kg] at the interface.
            force: On the interface; asked for at the end of each window.
            plan: Windows.
            channels: To the macro model.
        """
        self.time, self._script, self._plan, self._channels = 0.0, force, plan, channels
        self.displacement, self.velocity, self.force = np.zeros((3, len(mass), 3))
        channels.forces.send(np.repeat(mass[:, None], 3, axis=1))

    def begin_window(self) -> None:
        """Move with the received velocity of the interface, then send the force on it."""
        self._channels.velocities.receive(self.velocity)
        self.displacement += self._plan.window * self.velocity
        self.time += self._plan.window
        self.force[:] = self._script(self.time, self.displacement, self.velocity)
        self._channels.forces.send(self.force)

    def finish_window(self) -> None:
        """Do nothing."""
