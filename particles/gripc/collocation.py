"""Strong-form operators at all particles by moving least squares, walls mirrored: what Hu et al. build eqs 12-28 from.

With the linear basis values are those of the MLS shape functions, derivatives theirs (as printed); with the quadratic
basis particles carry their own values, and derivatives are those of a fitted Taylor expansion. A stencil next to a wall
sees images of the particles behind it: a scalar is even there and has no slope along the normal; of a velocity the
component along the wall is even, the other one odd (free slip).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.gripc.moving_least_squares import SUPPORT, derivatives, shape_functions
from reflowshock.particles.ispg.ghosts import mirror

Matrix: TypeAlias = sparse.csr_matrix


@dataclass(frozen=True, slots=True)
class Operators:
    """Sparse operators at n particles; scalars are even at the walls, velocities slip along them.

    Velocities are stored by component: all x, all y, all z.

    Attributes:
        values: `(n, n)` approximated scalar at the particles, from their coefficients.
        gradient: three `(n, n)` matrices [1/m].
        laplacian: `(n, n)` [1/m^2].
        velocity_values: `(3 n, 3 n)` as `values`, of a velocity.
        velocity_gradient: three `(3 n, 3 n)`, d/dx, d/dy, d/dz of each component [1/m].
        velocity_laplacian: `(3 n, 3 n)` [1/m^2].
        divergence: `(n, 3 n)` [1/m].
        smoothing: `(3 n, 3 n)` linear MLS approximation of a velocity, in either basis.
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
    """Fit the operators at the particles `(n, 3)` [m].

    Args:
        points: particles.
        plates: walls, mirrored.
        spacing: of the particles [m].
        basis: "linear" or "quadratic".

    Raises:
        DegenerateStencil: the derivatives at a particle cannot be fitted.
    """
    count, rows = len(points), np.arange(len(points), dtype=np.int32)
    ghosts = mirror(points, plates, SUPPORT[basis] * spacing)
    everything = np.concatenate((points, ghosts.points))
    even, vector = ghosts.even(count), ghosts.vector(count)

    def neighbours(kind: str) -> NeighbourList:
        found = NeighbourList(SUPPORT[kind] * spacing, 0.0)
        found.update(everything)
        return found

    fitted = derivatives(everything, rows, neighbours(basis), basis)
    shape = shape_functions(everything, rows, neighbours("linear"))
    values = shape if basis == "linear" else sparse.eye(*shape.shape, format="csr")
    three = sparse.identity(3)
    return Operators(
        values=(values @ even).tocsr(),
        gradient=tuple((component @ even).tocsr() for component in fitted.gradient),
        laplacian=(fitted.laplacian @ even).tocsr(),
        velocity_values=(sparse.kron(three, values) @ vector).tocsr(),
        velocity_gradient=tuple((sparse.kron(three, component) @ vector).tocsr() for component in fitted.gradient),
        velocity_laplacian=(sparse.kron(three, fitted.laplacian) @ vector).tocsr(),
        divergence=(sparse.hstack(fitted.gradient) @ vector).tocsr(),
        smoothing=(sparse.kron(three, shape) @ vector).tocsr(),
    )
