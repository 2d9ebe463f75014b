"""Common interface of explicit and implicit time integration of one model."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.loads.load import Loaded
from reflowshock.fem.parallel.checkpoint_state import State


class Motion(Loaded):
    """State of one model on one rank and its time integration; energies and works count the rank's share [J].

    Attributes:
        slave_force: Force of this rank's elements on the slaves before it is moved to the masters, shape (ns, 3) [N].
    """

    slave_force: NDArray[np.float64]

    @property
    @abstractmethod
    def external_work(self) -> float:
        """Work of all loads [J]."""

    @property
    @abstractmethod
    def damping_energy(self) -> float:
        """Energy that damping has dissipated [J]."""

    @abstractmethod
    def launch(self, velocity: NDArray[np.float64]) -> None:
        """Give all free components an initial velocity of shape (3,) [m/s] before the first step."""

    @abstractmethod
    def advance(self) -> None:
        """Advance displacement and velocity by one step; call ``update_force`` afterwards."""

    @abstractmethod
    def update_force(self) -> None:
        """Evaluate the force at the current displacement, once per step."""

    def take_steps(self, count: int) -> None:
        """Take ``count`` steps, each with its force update."""
        for _ in range(count):
            self.advance()
            self.update_force()

    @abstractmethod
    def present_velocity(self) -> NDArray[np.float64]:
        """Return the velocity at ``time``, shape (n, 3) [m/s]."""

    @abstractmethod
    def reaction(self) -> NDArray[np.float64]:
        """Return the forces of supports and prescribed motion on the nodes that this rank owns, shape (n, 3) [N]."""

    @abstractmethod
    def kinetic_energy(self) -> float:
        """Return the kinetic energy [J]."""

    @abstractmethod
    def step_energy(self, foreign: NDArray[np.float64]) -> float:
        """Return an energy [J] that exceeds the strain energy if the step is unstable, see ``ExplicitMotion``."""

    @abstractmethod
    def state(self) -> State:
        """Return the time-dependent state, for a checkpoint."""

    @abstractmethod
    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore the values that ``state`` returned."""
