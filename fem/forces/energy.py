"""Energy that a force term stores or has dissipated."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.mean_strain import MeanStrain


@dataclass(frozen=True, slots=True)
class Energy:
    """Energies of the elements of one rank [J].

    Attributes:
        strain: Elastic strain energy, recoverable.
        plastic: Work dissipated by plastic or viscous flow so far.
        hourglass: Energy of the hourglass stiffness of one-point elements; in yielding fully integrated elements the
            work of incompatible modes that are not yet in equilibrium.
    """

    strain: float = 0.0
    plastic: float = 0.0
    hourglass: float = 0.0

    def __add__(self, other: "Energy") -> "Energy":
        """Return the sum, component by component."""
        return Energy(self.strain + other.strain, self.plastic + other.plastic, self.hourglass + other.hourglass)

    @property
    def total(self) -> float:
        """Work of the internal force so far [J]."""
        return self.strain + self.plastic + self.hourglass


class InternalForce(Protocol):
    """Object that subtracts an internal force, such as a ``force.ForceTerm``."""

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force ``(n, 3)`` [N] at a displacement ``(n, 3)`` [m]."""


def linear_energy(term: InternalForce, displacement: NDArray[np.float64], mean: MeanStrain | None) -> Energy:
    """Return the strain and hourglass energy of a linear force term on this rank, together u . K u / 2 [J].

    Args:
        term: Force term with a linear internal force K u.
        displacement: Nodal displacement u, shape (n, 3) [m].
        mean: Mean strains of elements with hourglass control, which split the energy into strain and hourglass energy;
            None if all of it is strain energy.

    Returns:
        Elastic strain energy, plastic work (zero) and hourglass energy [J].
    """
    force = np.zeros_like(displacement)
    term.add(displacement, force)
    total = -0.5 * float(np.vdot(displacement, force))
    strain = mean.energy(displacement) if mean else total
    return Energy(strain=strain, hourglass=total - strain)
