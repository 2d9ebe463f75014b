"""Constant internal force of prestressed linear elements."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.forces.energy import Energy


@dataclass(frozen=True, slots=True)
class Pretension:
    """Internal force of prestressed elements at zero displacement, as a ``force.ForceTerm``; others add its change.

    Attributes:
        force: Internal nodal force of this rank's elements at zero displacement, shape (n, 3) [N].
        stored: Elastic energy of these elements at zero displacement [J].
        history: Empty, because the force is constant.
    """

    force: NDArray[np.float64]
    stored: float
    history: dict[str, NDArray] = field(default_factory=dict)

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the constant internal force from a nodal force ``(n, 3)`` [N]; the displacement is not used."""
        force -= self.force

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the stored energy plus the work against the constant force at a displacement ``(n, 3)`` [m]."""
        return Energy(strain=self.stored + float(np.vdot(self.force, displacement)))
