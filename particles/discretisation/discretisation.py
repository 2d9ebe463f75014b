"""What a step needs of space: gradients, volumes, mass and the incompressibility constraint."""

from dataclasses import dataclass

from scipy import sparse

from reflowshock.arrays import Floats


@dataclass(frozen=True, slots=True)
class Discretisation:
    """Sparse operators at the current positions of n particles, with m points of integration and k pressures.

    Attributes:
        gradient: three `(m, n)` matrices, d/dx, d/dy, d/dz at the points of integration [1/m].
        weights: `(m,)` volumes of these points [m^3].
        mass: `(n, n)` symmetric; the kinetic energy is rho/2 v . mass v [m^3].
        constraint: `(k, 3 n)` rate of the volume that each pressure controls [m^2].
        volume_share: `(k,)` these rates where the whole volume grows evenly at the rate one.
        stabilisation: `(k, k)` symmetric, positive semidefinite, over the time step [m^3/(Pa s^2)], or None.
        diffusion_rate: at which viscosity carries momentum across a spacing; it weakens the stabilisation [1/s].
    """

    gradient: tuple[sparse.csr_matrix, sparse.csr_matrix, sparse.csr_matrix]
    weights: Floats
    mass: sparse.csr_matrix
    constraint: sparse.csr_matrix
    volume_share: Floats
    stabilisation: sparse.csr_matrix | None = None
    diffusion_rate: float = 0.0
