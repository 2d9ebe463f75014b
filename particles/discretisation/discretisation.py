"""What a step needs of space, and how tetrahedra of the particles give it: linear velocity and linear pressure.

The rows of the constraint are the gradients of the dual volumes, a quarter of the tetrahedra around a particle. They
add up to the gradient of the enclosed volume, so a uniform pressure balances the surface exactly as in the statics, and
no force on a free body has a resultant. The mass is consistent: exact for linear velocities, to which the second mode
of a drop belongs; lumped, it is 4 % too heavy at four shells. Equal order needs a stabilisation, here the part of the
pressure gradient that the particles do not resolve (orthogonal subscales, Codina 2000): it vanishes for linear
pressures and hardly damps.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.tetrahedra import SMALLEST_VOLUME, cell_volumes, thick_cells, volume_gradients

STABILISATION = 0.05
DIFFUSION = 4.0
# Share of its first volume below which a tetrahedron is worn out.
WORN = 0.2


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


@dataclass(frozen=True, slots=True)
class LinearTetrahedra:
    """Tetrahedra that move with their particles.

    Attributes:
        cells: `(t, 4)`, whose boundary is the tracked surface.
        mass: `(n, n)` volumes that the particles carried when the tetrahedra were made [m^3].
        density: of the liquid [kg/m^3].
        viscosity: of the liquid [Pa s].
        volumes: `(t,)` of the tetrahedra when they were made [m^3].
    """

    cells: Indices
    mass: sparse.csr_matrix
    density: float
    viscosity: float
    volumes: Floats

    @classmethod
    def start(cls, points: Floats, cells: Indices, density: float, viscosity: float = 0.0) -> "LinearTetrahedra":
        """Give the particles the volumes of the tetrahedra at these points."""
        volumes = cell_volumes(points, cells)
        return cls(cells, particle_mass(cells, volumes, len(points)), density, viscosity, volumes)

    def is_worn(self, points: Floats) -> bool:
        """Whether a tetrahedron has been squeezed flat on the way to these points `(n, 3)` [m]."""
        thick = thick_cells(self.volumes)
        return bool((cell_volumes(points, self.cells[thick]) < WORN * self.volumes[thick]).any())

    def __call__(self, body: Body) -> Discretisation:
        """Build the operators at the current positions."""
        count, cells = len(body.points), self.cells
        volumes = cell_volumes(body.points, cells)
        average = _matrix(cells, np.full((len(cells), 4), 0.25), count).T.tocsr()
        slopes = volume_gradients(body.points, cells)
        scaled = [_matrix(cells, slopes[:, :, d], count) for d in range(3)]
        # Flat tetrahedra enter volumes and mass, but neither strain nor stabilisation.
        thick = thick_cells(volumes)
        weights = volumes[thick]
        inverse = sparse.diags(1.0 / weights)
        x, y, z = ((inverse @ part[thick]).tocsr() for part in scaled)
        dual = average @ volumes
        return Discretisation(
            gradient=(x, y, z),
            weights=weights,
            mass=self.mass,
            constraint=sparse.hstack([average @ part for part in scaled], format="csr"),
            volume_share=dual / dual.sum(),
            stabilisation=STABILISATION / self.density * _unresolved((x, y, z), weights, average[:, thick]),
            diffusion_rate=DIFFUSION * self.viscosity / (self.density * body.cloud.spacing**2),
        )


def particle_mass(cells: Indices, volumes: Floats, count: int) -> sparse.csr_matrix:
    """Volumes `(n, n)` [m^3] that `count` particles have of tetrahedra with some volumes `(t,)` [m^3]."""
    # Inverted tetrahedra mend the boundary of others. Only flat ones count, so that the mass stays definite.
    counted = np.where(volumes > -SMALLEST_VOLUME * volumes.mean(), volumes, 0.0)
    counted *= volumes.sum() / counted.sum()
    return consistent_mass(cells, counted, count)


def consistent_mass(cells: Indices, volumes: Floats, count: int) -> sparse.csr_matrix:
    """Integrals of products of linear shape functions, `(n, n)` [m^3]: volume / 20 (1 + delta)."""
    rows, columns = np.repeat(cells, 4, axis=1).ravel(), np.tile(cells, (1, 4)).ravel()
    values = volumes[:, None] / 20.0 * (1.0 + np.eye(4).ravel())
    return sparse.csr_matrix((values.ravel(), (rows, columns)), shape=(count, count))


def _unresolved(
    gradient: tuple[sparse.csr_matrix, ...], weights: Floats, average: sparse.csr_matrix
) -> sparse.csr_matrix:
    """Integral of the squared pressure gradient less that of its mean at the particles, `(n, n)` [m]."""
    share = average @ sparse.diags(weights)
    volumes = np.asarray(share.sum(axis=1)).ravel()
    inverse = sparse.diags(np.divide(1.0, volumes, out=np.zeros_like(volumes), where=volumes > 0.0))
    full = sum(part.T @ sparse.diags(weights) @ part for part in gradient)
    means = [share @ part for part in gradient]
    return (full - sum(mean.T @ inverse @ mean for mean in means)).tocsr()


def _matrix(cells: Indices, values: Floats, count: int) -> sparse.csr_matrix:
    """Values `(t, 4)` at the corners of the cells as a matrix `(t, n)`."""
    starts = np.arange(0, 4 * len(cells) + 1, 4)
    return sparse.csr_matrix((values.ravel(), cells.ravel(), starts), shape=(len(cells), count))
