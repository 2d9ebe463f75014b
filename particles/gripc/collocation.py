"""Collocated (strong-form) operators by moving least squares with mirrored walls, for eqs 12 to 28 of Hu et al.

With the linear basis, MLS shape functions give values and derivatives (as printed). With the quadratic basis particles
carry their own values, and a fitted Taylor expansion gives the derivatives. At a wall, scalars and tangential
velocities are even, and normal velocities are odd (free slip).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.gripc.moving_least_squares import SUPPORT, fit_derivatives, fit_shape_functions
from reflowshock.particles.ispg.ghosts import mirror_particles

Matrix: TypeAlias = sparse.csr_matrix


@dataclass(frozen=True, slots=True)
class Operators:
    """Sparse operators at n particles; scalars are even at the walls, velocities slip along them.

    Velocities are stored by component: all x, all y, all z.

    Attributes:
        values: Scalar values from coefficients, shape (n, n).
        gradient: Derivatives by x, y and z, shape (n, n) each [1/m].
        laplacian: Laplacian, shape (n, n) [1/m^2].
        velocity_values: Velocity values from coefficients, shape (3 n, 3 n).
        velocity_gradient: Derivatives of each component by x, y and z, shape (3 n, 3 n) each [1/m].
        velocity_laplacian: Laplacian of each component, shape (3 n, 3 n) [1/m^2].
        divergence: Divergence, shape (n, 3 n) [1/m].
        smoothing: Linear MLS approximation of a velocity, in either basis, shape (3 n, 3 n).
    """

    values: Matrix
    gradient: tuple[Matrix, Matrix, Matrix]
    laplacian: Matrix
    velocity_values: Matrix
    velocity_gradient: tuple[Matrix, Matrix, Matrix]
    velocity_laplacian: Matrix
    divergence: Matrix
    smoothing: Matrix


def collocate(points: Floats, plates: Sequence[Plate], spacing: float, basis: str) -> Operators:
    """Fit sparse matrices for values, derivatives and smoothing at the particles by moving least squares.

    Args:
        points: Particle positions, shape (n, 3) [m].
        plates: Walls, at which particles are mirrored; may be empty.
        spacing: Particle spacing [m].
        basis: Polynomial basis of the moving least squares fit, "linear" or "quadratic".

    Returns:
        Operators: sparse matrices, shape (n, n) for scalars and (3 n, 3 n) for velocities, that give values, gradient,
        Laplacian, divergence [1/m, 1/m^2] and smoothed velocities from coefficients at the particles.

    Raises:
        DegenerateStencil: The derivatives at a particle cannot be fitted.
    """
    count, rows = len(points), np.arange(len(points), dtype=np.int32)
    ghosts = mirror_particles(points, plates, SUPPORT[basis] * spacing)
    everything = np.concatenate((points, ghosts.points))
    even, vector = ghosts.even(count), ghosts.vector(count)

    def neighbours(kind: str) -> NeighbourList:
        lists = NeighbourList(SUPPORT[kind] * spacing, 0.0)
        lists.update(everything)
        return lists

    fitted = fit_derivatives(everything, rows, neighbours(basis), basis)
    shape = fit_shape_functions(everything, rows, neighbours("linear"))
    values = shape if basis == "linear" else sparse.eye(*shape.shape, format="csr")
    components = sparse.identity(3)
    return Operators(
        values=(values @ even).tocsr(),
        gradient=tuple((component @ even).tocsr() for component in fitted.gradient),
        laplacian=(fitted.laplacian @ even).tocsr(),
        velocity_values=(sparse.kron(components, values) @ vector).tocsr(),
        velocity_gradient=tuple((sparse.kron(components, component) @ vector).tocsr() for component in fitted.gradient),
        velocity_laplacian=(sparse.kron(components, fitted.laplacian) @ vector).tocsr(),
        divergence=(sparse.hstack(fitted.gradient) @ vector).tocsr(),
        smoothing=(sparse.kron(components, shape) @ vector).tocsr(),
    )
