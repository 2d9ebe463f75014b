"""Spatial operators of a step, and their form on tetrahedra with linear velocity and linear pressure.

The rows of the constraint are gradients of the dual volumes, a quarter of the tetrahedra around each particle. They sum
to the gradient of the enclosed volume, so that a uniform pressure balances the surface exactly and forces on a free
body have no resultant. The mass matrix is consistent, hence exact for linear velocities, to which the second mode of a
drop belongs; lumped, it is 4 % too heavy with four shells. Equal order of velocity and pressure needs a stabilisation:
the part of the pressure gradient that the particles do not resolve (orthogonal subscales, Codina 2000), which vanishes
for linear pressures and hardly damps.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.tetrahedra import SMALLEST_VOLUME, cell_volumes, thick_cells, volume_gradients

STABILISATION = 0.05
DIFFUSION = 4.0
# Share of its initial volume below which a tetrahedron counts as degenerate.
WORN = 0.2


@dataclass(frozen=True, slots=True)
class Discretisation:
    """Sparse operators at the current positions of n particles, with m integration points and k pressures.

    Attributes:
        gradient: Derivatives by x, y and z at the integration points, shape (m, n) each [1/m].
        weights: Volumes of the integration points, shape (m,) [m^3].
        mass: Symmetric mass matrix over the density, shape (n, n) [m^3].
        constraint: Rate of the volume that each pressure controls, shape (k, 3 n) [m^2].
        volume_share: Share of each of these volumes in a uniform expansion, shape (k,).
        stabilisation: Symmetric positive semidefinite matrix over the time step, shape (k, k) [m^3/(Pa s^2)], or None.
        diffusion_rate: Rate of viscous diffusion across a spacing, which weakens the stabilisation [1/s].
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
        cells: Corners, shape (t, 4); the boundary is the tracked surface.
        mass: Mass matrix of the particles over the density when the tetrahedra were made, shape (n, n) [m^3].
        density: Density [kg/m^3].
        viscosity: Dynamic viscosity [Pa s].
        volumes: Volumes of the tetrahedra when they were made, shape (t,) [m^3].
    """

    cells: Indices
    mass: sparse.csr_matrix
    density: float
    viscosity: float
    volumes: Floats

    @classmethod
    def start(cls, points: Floats, cells: Indices, density: float, viscosity: float = 0.0) -> "LinearTetrahedra":
        """Return tetrahedra with corners ``cells`` and the mass matrix of their volumes at these points."""
        volumes = cell_volumes(points, cells)
        return cls(cells, particle_mass(cells, volumes, len(points)), density, viscosity, volumes)

    def is_worn(self, points: Floats) -> bool:
        """Return whether a tetrahedron is nearly flat or inverted at these points, shape (n, 3) [m]."""
        thick = thick_cells(self.volumes)
        return bool((cell_volumes(points, self.cells[thick]) < WORN * self.volumes[thick]).any())

    def __call__(self, body: Body) -> Discretisation:
        """Assemble the operators at the current positions of a body."""
        count, cells = len(body.points), self.cells
        volumes = cell_volumes(body.points, cells)
        average = _matrix(cells, np.full((len(cells), 4), 0.25), count).T.tocsr()
        slopes = volume_gradients(body.points, cells)
        scaled = [_matrix(cells, slopes[:, :, d], count) for d in range(3)]
        # Flat tetrahedra contribute to volumes and mass, but not to strain and stabilisation.
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
    """Return the consistent mass matrix of particles divided by the density, shape (n, n) [m^3].

    It is positive definite even with inverted tetrahedra, which are left out; the others are scaled to the total
    volume.

    Args:
        cells: Corners of the tetrahedra, shape (t, 4).
        volumes: Signed volumes of the tetrahedra, shape (t,) [m^3]; negative if inverted.
        count: Number n of particles.
    """
    # Inverted tetrahedra correct the boundary of others. They are left out, so that the mass stays definite.
    counted = np.where(volumes > -SMALLEST_VOLUME * volumes.mean(), volumes, 0.0)
    counted *= volumes.sum() / counted.sum()
    return consistent_mass(cells, counted, count)


def consistent_mass(cells: Indices, volumes: Floats, count: int) -> sparse.csr_matrix:
    """Return the integrals of products of linear shape functions, the mass matrix over the density, shape (n, n) [m^3].

    Each tetrahedron adds volume / 20 to the pairs of its corners, twice that on the diagonal.

    Args:
        cells: Corners of the tetrahedra, shape (t, 4).
        volumes: Volumes of the tetrahedra, shape (t,) [m^3].
        count: Number n of particles.
    """
    rows, columns = np.repeat(cells, 4, axis=1).ravel(), np.tile(cells, (1, 4)).ravel()
    values = volumes[:, None] / 20.0 * (1.0 + np.eye(4).ravel())
    return sparse.csr_matrix((values.ravel(), (rows, columns)), shape=(count, count))


def _unresolved(
    gradient: tuple[sparse.csr_matrix, ...], weights: Floats, average: sparse.csr_matrix
) -> sparse.csr_matrix:
    """Return the integral of the squared pressure gradient not resolved by the particle means, shape (n, n) [m]."""
    share = average @ sparse.diags(weights)
    volumes = np.asarray(share.sum(axis=1)).ravel()
    inverse = sparse.diags(np.divide(1.0, volumes, out=np.zeros_like(volumes), where=volumes > 0.0))
    full = sum(part.T @ sparse.diags(weights) @ part for part in gradient)
    means = [share @ part for part in gradient]
    return (full - sum(mean.T @ inverse @ mean for mean in means)).tocsr()


def _matrix(cells: Indices, values: Floats, count: int) -> sparse.csr_matrix:
    """Return values at the corners of the cells, shape (t, 4), as a sparse matrix, shape (t, n)."""
    starts = np.arange(0, 4 * len(cells) + 1, 4)
    return sparse.csr_matrix((values.ravel(), cells.ravel(), starts), shape=(len(cells), count))
