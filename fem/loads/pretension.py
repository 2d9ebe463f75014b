"""The force that linear elements have at no displacement: constant, at the nodes."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.forces.energy import Energy


@dataclass(frozen=True, slots=True)
class Pretension:
    """A constant internal force; a ``force.ForceTerm`` beside those of the elements, which give its change.

    Attributes:
        force: ``(n, 3)`` [N] of this rank's elements.
        stored: Elastic energy [J] of these elements at no displacement.
        history: Empty: nothing changes.
    """

    force: NDArray[np.float64]
    stored: float
    history: dict[str, NDArray] = field(default_factory=dict)

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the force, whatever the displacement."""
        force -= self.force

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the energy at the beginning, and the work against the force since."""
        return Energy(strain=self.stored + float(np.vdot(self.force, displacement)))
