"""Input-G by a large mass at the supports and the force that accelerates it (large-mass method, H 4.4)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.errors import LoadError
from reflowshock.fem.loads.load import BodyAcceleration, Checkpointed, Load, Loaded
from reflowshock.fem.loads.pulse import Pulse
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.checkpoint_state import Rows, State

MASS_RATIO = 1e6  # large mass over mass of the model; the relative error of the base motion is about its inverse


@dataclass(frozen=True)
class ShakenBase(Load):
    """Moving frame of results for a model without nodes of the large mass; it adds no force.

    The base displacement is the exact integral of the pulse. The large mass of the other model takes steps of one
    window w, so it differs from the integral by (pi w / tau)^2 / 12 relative to the displacement, with tau the duration
    of the pulse: below 1e-6 from a thousand windows per pulse.

    Attributes:
        direction: Unit vector opposite to the acceleration of the base, shape (3,).
        pulse: Acceleration of the base [m/s^2].
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
    """Large mass on the support nodes and the force that accelerates it; displacements are absolute.

    The energy balance leaves the large mass out: the external work is the work of its nodes on the model.

    Attributes:
        nodes: Local support nodes, shape (k,).
        mass: Mass added to each node, shape (k,) [kg].
        direction: Unit vector opposite to the acceleration of the base, shape (3,); ``BodyAcceleration`` has the same.
        pulse: Acceleration of the base [m/s^2].
    """

    nodes: NDArray[np.int32]
    mass: NDArray[np.float64]
    direction: NDArray[np.float64]
    pulse: Pulse
    checkpointed: ClassVar[Mapping[str, Checkpointed]] = {"work": "sum", "_base": "same"}
    work: float = 0.0
    _force: NDArray[np.float64] = field(init=False)
    # Displacement of the base at the motion's time, its velocity there, and the velocity change of half a step.
    _base: NDArray[np.float64] = field(init=False)

    @classmethod
    def build(
        cls,
        comm: MPI.Comm,
        body: Body,
        nodes: NDArray[np.integer],
        base: BodyAcceleration,
        moved: float | None = None,
    ) -> "LargeMass":
        """Distribute ``MASS_RATIO`` times the moved mass over nodes, in proportion to their masses; collective.

        Args:
            comm: Communicator of the model.
            body: Model on this rank.
            nodes: Global numbers of the support nodes, shape (k,).
            base: Body acceleration that would act on the model in the frame of its supports.
            moved: Mass of all models [kg], or None for the mass of this model.

        Raises:
            LoadError: There are no nodes, or one of them is held or tied.
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
            reason = f"{int(wrong)} of their components are held or tied" if count else "the model has none"
            raise LoadError(f"a large mass needs support nodes that are free to move: {reason}")
        mass = body.mass[local] * (MASS_RATIO * (moved or total) / support)
        return cls(local, mass, base.direction, base.pulse)

    def state(self, body: Body) -> State:
        """Return the attributes that change with time, with the force at the nodes of the large mass."""
        return {**super().state(body), "_force": Rows(body.local.nodes[self.nodes], self._force)}

    def base_displacement(self, time: float) -> NDArray[np.float64]:
        """Return the displacement ``(3,)`` [m] of the base, integrated in the steps of the motion up to its time."""
        return -self.direction * self._base[0]

    def base_velocity(self, time: float) -> NDArray[np.float64]:
        """Return the velocity ``(3,)`` [m/s] of the base, integrated in the steps of the motion up to its time."""
        return -self.direction * self._base[1]

    def begin(self, motion: Loaded) -> None:
        """Add the masses to the motion and set the base to rest."""
        motion.add_mass(self.nodes, self.mass)
        kick = 0.5 * motion.step * self.pulse.value(0.0)
        self._base = np.array([motion.step * kick, -2.0 * kick, kick])

    def add(self, motion: Loaded) -> None:
        """Add the force that gives the masses the acceleration of the base, and advance the base by a step."""
        value = self.pulse.value(motion.time)
        kick = 0.5 * motion.step * value
        between = self._base[1] + self._base[2]
        self._base = np.array([self._base[0] + motion.step * between, between + kick, kick])
        self._force = np.outer(self.mass, -self.direction * value - motion.gravity)
        motion.force[self.nodes] += self._force

    def remove(self, force: NDArray[np.float64]) -> None:
        """Subtract the force of the latest ``add`` from a copy of the motion's force."""
        force[self.nodes] -= self._force

    def release(self, force: NDArray[np.float64]) -> None:
        """Subtract the whole force, because the large mass stands for a support."""
        self.remove(force)

    def collect(self, motion: Loaded) -> None:
        """Add the work of half a step by the force on the model, i.e. without the inertia of the large mass."""
        owned = motion.body.shared.owned[self.nodes]
        passed = self._force - self.mass[:, None] * (motion.acceleration(self.nodes) - motion.gravity)
        self.work += 0.5 * motion.step * float(np.sum((passed * motion.velocity[self.nodes])[owned]))
