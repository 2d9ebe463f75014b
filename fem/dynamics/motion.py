"""What a run asks of a motion, be it explicit or implicit."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.forces.energy import Energy
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.portable import State


class Motion(Protocol):
    """The state of one model on one rank; energies and works are those of the rank's share [J].

    Attributes:
        body: The model.
        step: dt [s].
        time: [s].
        displacement: ``(n, 3)`` [m] at ``time``.
        velocity: ``(n, 3)`` [m/s] as the scheme keeps it; ``present_velocity`` is that at ``time``.
        force: ``(n, 3)`` [N] at ``time`` after ``update_force``, summed over ranks.
        slave_force: ``(ns, 3)`` [N] of this rank's elements on the slaves, before it is moved.
    """

    body: Body
    step: float
    time: float
    displacement: NDArray[np.float64]
    velocity: NDArray[np.float64]
    force: NDArray[np.float64]
    slave_force: NDArray[np.float64]

    @property
    def external_work(self) -> float:
        """Return the work of all loads."""

    @property
    def damping_energy(self) -> float:
        """Return the energy that damping has taken."""

    def launch(self, velocity: NDArray[np.float64]) -> None:
        """Give all free components an initial velocity ``(3,)`` [m/s]; before the first step."""

    def advance(self) -> None:
        """Move from ``time`` to ``time + dt``; the force is then out of date."""

    def update_force(self) -> None:
        """Evaluate the force at the present displacement, once a step."""

    def present_velocity(self) -> NDArray[np.float64]:
        """Return the velocity ``(n, 3)`` [m/s] at ``time``."""

    def base_displacement(self) -> NDArray[np.float64]:
        """Return the displacement ``(3,)`` [m] of the frame in which results are told."""

    def base_velocity(self) -> NDArray[np.float64]:
        """Return the velocity ``(3,)`` [m/s] of that frame."""

    def reaction(self) -> NDArray[np.float64]:
        """Return the forces ``(n, 3)`` [N] of supports and prescribed motion on the nodes that this rank counts."""

    def kinetic_energy(self) -> float:
        """Return the kinetic energy."""

    def internal_energy(self) -> Energy:
        """Return the energies of the elements."""

    def state(self) -> State:
        """Return all that changes with time, for a checkpoint."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from the values of what ``state`` returned."""

    def step_energy(self, foreign: NDArray[np.float64]) -> float:
        """Return what exceeds the strain energy where the step is too large for stability, see ``ExplicitMotion``."""
