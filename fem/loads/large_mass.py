"""Input-G by a large mass at the supports and the force that moves it (H 4.4)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.errors import LoadError
from reflowshock.fem.loads.load import Kept, Load, Loaded
from reflowshock.fem.loads.pulse import Pulse
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.checkpoint_state import Rows, State

MASS_RATIO = 1e6  # large mass over the model's: the base deviates from its pulse by about one part in this


@dataclass(frozen=True)
class ShakenBase(Load):
    """The frame of results of a model that has no node of the large mass: it follows time and acts on nothing.

    The large mass of the other model takes steps of a window; from these integrals it is a part of (pi w / tau)^2 / 12
    away, with w the window and tau the pulse: below 1e-6 where a pulse has a thousand windows.

    Attributes:
        direction: ``(3,)`` unit vector against which the base moves.
        pulse: Acceleration [m/s^2].
    """

    direction: NDArray[np.float64]
    pulse: Pulse

    def base_displacement(self, time: float) -> NDArray[np.float64]:
        """Return the displacement ``(3,)`` [m] of the base."""
        return -self.direction * self.pulse.double_integral(time)

    def base_velocity(self, time: float) -> NDArray[np.float64]:
        """Return the velocity ``(3,)`` [m/s] of the base."""
        return -self.direction * self.pulse.integral(time)


@dataclass
class LargeMass(Load):
    """Input-G by a large mass on the support nodes and the force that moves it; displacements are absolute.

    The energy balance leaves the large mass out: external work is what its nodes pass on to the model.

    Attributes:
        nodes: ``(k,)`` local nodes.
        mass: ``(k,)`` [kg] added to each.
        direction: ``(3,)`` unit vector against which the base moves, as ``BodyAcceleration`` pushes the body.
        pulse: Acceleration [m/s^2].
    """

    nodes: NDArray[np.int32]
    mass: NDArray[np.float64]
    direction: NDArray[np.float64]
    pulse: Pulse
    kept: ClassVar[Mapping[str, Kept]] = {"work": "sum", "_base": "same"}
    work: float = 0.0
    _force: NDArray[np.float64] = field(init=False)
    _base: NDArray[np.float64] = field(init=False)  # displacement and velocity at the motion's time, half a kick

    @classmethod
    def build(
        cls,
        comm: MPI.Comm,
        body: Body,
        nodes: NDArray[np.integer],
        base: tuple[NDArray[np.float64], Pulse],
        moved: float | None = None,
    ) -> "LargeMass":
        """Share ``MASS_RATIO`` times the moved mass among input nodes ``(k,)`` by their masses; collective.

        Args:
            comm: Communicator of the model.
            body: The model.
            nodes: Of the model.
            base: ``direction`` and ``pulse``.
            moved: Mass [kg] of all models; without it the model is alone.

        Raises:
            LoadError: A node does not exist, or is held or tied.
        """
        local = body.local.locate(nodes)
        local = local[local >= 0]
        owned = body.shared.owned
        count, wrong, support, total = comm.allreduce(
            np.array(
                [
                    len(local),
                    np.sum(~body.free[local]),
                    body.mass[local][owned[local]].sum(),
                    body.mass[owned].sum(),
                ]
            )
        )
        if not count or wrong:
            found = f"{int(wrong)} of their components are held or tied" if count else "there are none"
            raise LoadError(f"a large mass needs support nodes that are free to move: {found}")
        return cls(local, body.mass[local] * (MASS_RATIO * (moved or total) / support), *base)

    def state(self, body: Body) -> State:
        """Return also the force at its nodes."""
        return {**super().state(body), "_force": Rows(body.local.nodes[self.nodes], self._force)}

    def base_displacement(self, time: float) -> NDArray[np.float64]:
        """Return the displacement ``(3,)`` [m] of the base, integrated in the motion's own steps up to its time."""
        return -self.direction * self._base[0]

    def base_velocity(self, time: float) -> NDArray[np.float64]:
        """Return the velocity ``(3,)`` [m/s] of the base, integrated in the motion's own steps up to its time."""
        return -self.direction * self._base[1]

    def begin(self, motion: Loaded) -> None:
        """Add the masses."""
        motion.add_mass(self.nodes, self.mass)
        kick = 0.5 * motion.step * self.pulse.value(0.0)
        self._base = np.array([motion.step * kick, -2.0 * kick, kick])

    def add(self, motion: Loaded) -> None:
        """Add the force that gives the masses the base's acceleration against all body forces."""
        value = self.pulse.value(motion.time)
        kick = 0.5 * motion.step * value
        between = self._base[1] + self._base[2]
        self._base = np.array([self._base[0] + motion.step * between, between + kick, kick])
        self._force = np.outer(self.mass, -self.direction * value - motion.gravity)
        motion.force[self.nodes] += self._force

    def remove(self, force: NDArray[np.float64]) -> None:
        """Subtract it from a copy."""
        force[self.nodes] -= self._force

    def release(self, force: NDArray[np.float64]) -> None:
        """Subtract all of it: the mass stands for a support."""
        self.remove(force)

    def collect(self, motion: Loaded) -> None:
        """Add half a step's work of what is left of the force after moving the mass itself."""
        owned = motion.body.shared.owned[self.nodes]
        passed = self._force - self.mass[:, None] * (motion.acceleration(self.nodes) - motion.gravity)
        self.work += 0.5 * motion.step * float(np.sum((passed * motion.velocity[self.nodes])[owned]))
