"""The equations of the pressure in the seed's scheme (Hu et al., eqs 5-7 and 20-24), in strong form."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.krylov import solve_gmres
from reflowshock.particles.ispg.collocation import Operators


@dataclass(frozen=True, slots=True)
class Poisson:
    """Laplacian below the free surface, value on it.

    The slope along the normal of a wall vanishes because the operators are mirrored there: rows of eq 23, with the
    derivative along the normal alone, would take the Laplacian from the particles on the walls.

    Attributes:
        operators: at the particles.
        surface: `(n,)` whether a particle lies on the free surface.
        basis: "linear" or "quadratic".
    """

    operators: Operators
    surface: NDArray[np.bool_]
    basis: str

    def solve(self, source: Floats, boundary: Floats) -> tuple[Floats, int]:
        """Return coefficients `(n,)` of f with lap f = source below the surface and f = boundary on it; iterations.

        Args:
            source: `(n,)`, read below the surface.
            boundary: `(n,)`, read on the surface.

        Raises:
            SolveFailed: the linear solve failed.
        """
        on, below = (sparse.diags(mask.astype(float)) for mask in (self.surface, ~self.surface))
        matrix = on @ self.operators.values + below @ self.operators.laplacian
        return solve_gmres(matrix.tocsr(), np.where(self.surface, boundary, source), self.basis)


@dataclass(frozen=True, slots=True)
class Correction:
    """What the projection of a velocity gives.

    Attributes:
        potential: `(n,)` coefficients of phi [Pa].
        pressure: `(n,)` at the end of the step [Pa].
        iterations: of the solve.
    """

    potential: Floats
    pressure: Floats
    iterations: int


def correct_pressure(
    poisson: Poisson, fluid: tuple[float, float], divergence: Floats, pressure: Floats, given: Floats
) -> Correction:
    """Rotational incremental pressure correction: phi = p_new - p + mu div v* (eqs 21, 22 and 24).

    Args:
        poisson: Laplacian and boundary.
        fluid: density over the time step [kg/(m^3 s)] and viscosity [Pa s].
        divergence: `(n,)` of the predicted velocity [1/s].
        pressure: `(n,)` coefficients of the last pressure [Pa].
        given: `(n,)` pressure that the free surface has, read there [Pa].

    Raises:
        SolveFailed: the linear solve failed.
    """
    inertia, viscosity = fluid
    last = poisson.operators.values @ pressure - viscosity * divergence
    potential, iterations = poisson.solve(inertia * divergence, given - last)
    return Correction(potential, poisson.operators.values @ potential + last, iterations)
