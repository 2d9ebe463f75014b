"""Central differences on one rank: velocities live half a step behind displacements."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fem.body import Body
from fem.kernels_motion import advance
from fem.loads import Load


class Motion:
    """The state of one model on one rank, and its step.

    Half-kick, drift, force, half-kick, written with the velocity half a step back: v += dt (f / m + g), u += dt v.
    Nodes that several ranks hold are updated by each of them, from equal sums of forces.

    Attributes:
        displacement: ``(n, 3)`` [m] at ``time``.
        velocity: ``(n, 3)`` [m/s] at ``time - dt / 2``.
        force: ``(n, 3)`` [N] at ``time``, summed over ranks, slaves' moved to their masters; without body force.
        external_work: Work of the body force on this rank's share of the mass [J].
    """

    def __init__(
        self, body: Body, loads: Sequence[Load], step: float, held: NDArray[np.integer], extra_mass: NDArray[np.float64]
    ) -> None:
        """Start at rest.

        Args:
            body: The model.
            loads: Body accelerations.
            step: dt [s].
            held: Local nodes whose velocity another model prescribes; their mass is in that model's ledger.
            extra_mass: ``(n,)`` [kg] that another model adds at the cut.
        """
        self.body, self.step, self.time, self.external_work = body, step, 0.0, 0.0
        self._loads = loads
        mass = body.mass + extra_mass
        free = body.free.copy()
        free[held] = False
        self._masses = np.zeros((len(mass), 4))
        self._masses[:, :3] = np.where(free, 1.0 / np.where(mass > 0.0, mass, np.inf)[:, None], 0.0)
        self._masses[:, 3] = np.where(body.shared.owned, mass, 0.0)
        self._masses[held, 3] = 0.0
        self._state = np.zeros((3, len(mass), 3))
        self.displacement, self.velocity, self.force = self._state
        self._gravity = self.body_acceleration(0.0)
        self.velocity -= 0.5 * step * self._acceleration()

    def body_acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the sum of all loads ``(3,)`` [m/s^2] at a time [s]."""
        return sum((load.acceleration(time) for load in self._loads), np.zeros(3))

    def advance(self) -> None:
        """Move from ``time`` to ``time + dt``, slaves with their masters; the force is then out of date."""
        momentum = advance(self._state, self._masses, self._gravity, self.step)
        self.body.tie.spread(self.displacement)
        self.time += self.step
        before, self._gravity = self._gravity, self.body_acceleration(self.time)
        self.external_work += 0.5 * self.step * float((before + self._gravity) @ np.array(momentum))

    def update_force(self) -> None:
        """Evaluate the internal force at the present displacement, summed over ranks."""
        self.force.fill(0.0)
        for term in self.body.terms:
            term.add(self.displacement, self.force)
        self.body.tie.gather(self.force)
        self.body.shared.add(self.force)

    def kinetic_energy(self) -> float:
        """Return the kinetic energy [J] of this rank's share at ``time``."""
        return 0.5 * float(self._masses[:, 3] @ np.sum(self.present_velocity() ** 2, axis=1))

    def present_velocity(self) -> NDArray[np.float64]:
        """Return the velocity ``(n, 3)`` [m/s] at ``time``, half a step after ``velocity``; not that of slaves."""
        return self.velocity + 0.5 * self.step * self._acceleration()

    def strain_energy(self, foreign: NDArray[np.float64]) -> float:
        """Return the strain energy [J] of this rank's share, - u . f / 2 of linear elastic terms.

        Args:
            foreign: ``(n, 3)`` [N], part of the force that is not this model's.
        """
        owned = self.body.shared.owned
        return -0.5 * float(np.sum(self.displacement[owned] * (self.force - foreign)[owned]))

    def _acceleration(self) -> NDArray[np.float64]:
        inverse = self._masses[:, :3]
        return self.force * inverse + np.where(inverse > 0.0, self._gravity, 0.0)
