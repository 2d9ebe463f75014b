"""What a run asks of a motion, be it explicit or implicit."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.loads.load import Loaded
from reflowshock.fem.parallel.portable import State


class Motion(Loaded):
    """The state of one model on one rank; energies and works are those of the rank's share [J].

    Attributes:
        slave_force: ``(ns, 3)`` [N] of this rank's elements on the slaves, before it is moved.
    """

    slave_force: NDArray[np.float64]

    @property
    @abstractmethod
    def external_work(self) -> float:
        """Return the work of all loads."""

    @property
    @abstractmethod
    def damping_energy(self) -> float:
        """Return the energy that damping has taken."""

    @abstractmethod
    def launch(self, velocity: NDArray[np.float64]) -> None:
        """Give all free components an initial velocity ``(3,)`` [m/s]; before the first step."""

    @abstractmethod
    def advance(self) -> None:
        """Move from ``time`` to ``time + dt``; the force is then out of date."""

    @abstractmethod
    def update_force(self) -> None:
        """Evaluate the force at the present displacement, once a step."""

    def take_steps(self, count: int) -> None:
        """Take steps, each with its force."""
        for _ in range(count):
            self.advance()
            self.update_force()

    @abstractmethod
    def present_velocity(self) -> NDArray[np.float64]:
        """Return the velocity ``(n, 3)`` [m/s] at ``time``."""

    @abstractmethod
    def reaction(self) -> NDArray[np.float64]:
        """Return the forces ``(n, 3)`` [N] of supports and prescribed motion on the nodes that this rank counts."""

    @abstractmethod
    def kinetic_energy(self) -> float:
        """Return the kinetic energy."""

    @abstractmethod
    def step_energy(self, foreign: NDArray[np.float64]) -> float:
        """Return what exceeds the strain energy where the step is too large for stability, see ``ExplicitMotion``."""

    @abstractmethod
    def state(self) -> State:
        """Return all that changes with time, for a checkpoint."""

    @abstractmethod
    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from the values of what ``state`` returned."""
