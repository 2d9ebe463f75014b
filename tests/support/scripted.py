"""Scripted participants in place of a macro or a meso model, for tests and for locating errors.

They take part in the windows of ``held_velocity`` (also ``local_steps``) or ``one_way`` with a real partner. Their
interface nodes are numbered like the interface of the partner.
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
    """Return the numbers 0 to ``count`` - 1 of the interface nodes of a scripted participant, shape (count,)."""
    return np.arange(count, dtype=np.int32)


class ScriptedDriver:
    """Macro model with a prescribed interface motion and no feedback, as ``one_way.Driver``.

    Attributes:
        time: Time [s].
    """

    def __init__(
        self, points: NDArray[np.float64], velocity: VelocityScript, plan: WindowPlan, channels: InterfaceChannels
    ) -> None:
        """Start at time zero.

        Args:
            points: Interface nodes [m], shape (nc, 3).
            velocity: Velocity of the interface, evaluated at the middle of each window.
            plan: Windows.
            channels: Channels to the meso model.
        """
        self.time, self._points, self._velocity = 0.0, points, velocity
        self._plan, self._channels = plan, channels

    def begin_window(self) -> None:
        """Send the velocity of the interface."""
        middle = self.time + 0.5 * self._plan.window
        self._channels.velocities.send(np.broadcast_to(self._velocity(middle, self._points), self._points.shape).copy())
        self.time += self._plan.window

    def finish_window(self) -> None:
        """Do nothing."""


class ScriptedMacro(ScriptedDriver):
    """Macro model with a prescribed interface motion, as ``held_velocity.HeldVelocityMacro``.

    Attributes:
        mass: Mass of the meso model at the interface [kg], shape (nc, 3).
        force: Latest force of the meso model [N], shape (nc, 3).
    """

    def __init__(
        self, points: NDArray[np.float64], velocity: VelocityScript, plan: WindowPlan, channels: InterfaceChannels
    ) -> None:
        """Receive the interface mass, which a ``HeldVelocityMeso`` must have sent; arguments as ``ScriptedDriver``."""
        super().__init__(points, velocity, plan, channels)
        self.mass, self.force = np.zeros_like(points), np.zeros_like(points)
        channels.forces.receive(self.mass)

    def finish_window(self) -> None:
        """Receive the force of the meso model."""
        self._channels.forces.receive(self.force)


class ScriptedMeso:
    """Meso model that answers with a prescribed force law, as ``held_velocity.HeldVelocityMeso``.

    Attributes:
        time: Time [s].
        displacement: Displacement of the interface [m], shape (nc, 3).
        force: Latest sent force [N], shape (nc, 3).
    """

    def __init__(
        self, mass: NDArray[np.float64], force: ForceScript, plan: WindowPlan, channels: InterfaceChannels
    ) -> None:
        """Send the interface mass and start at rest.

        Args:
            mass: Mass at the interface [kg], shape (nc,).
            force: Force law of the interface, evaluated at the end of each window.
            plan: Windows.
            channels: Channels to the macro model.
        """
        self.time, self._script, self._plan, self._channels = 0.0, force, plan, channels
        self.displacement, self.velocity, self.force = np.zeros((3, len(mass), 3))
        channels.forces.send(np.repeat(mass[:, None], 3, axis=1))

    def begin_window(self) -> None:
        """Move with the received velocity of the interface, then send its force."""
        self._channels.velocities.receive(self.velocity)
        self.displacement += self._plan.window * self.velocity
        self.time += self._plan.window
        self.force[:] = self._script(self.time, self.displacement, self.velocity)
        self._channels.forces.send(self.force)

    def finish_window(self) -> None:
        """Do nothing."""
