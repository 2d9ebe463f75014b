"""Moving least squares: sparse operators of the gradient and of the Laplacian at particles, in two bases."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.ispg.mls_weights import linear_weights, quadratic_weights, shape_weights

# Support radius in spacings: the quadratic fit needs at least 9 well placed neighbours at a wall, too.
SUPPORT = {"linear": 2.0, "quadratic": 2.4}


class DegenerateStencil(ArithmeticError):
    """A particle has too few neighbours to fit a gradient."""


@dataclass(frozen=True, slots=True)
class Derivatives:
    """Sparse derivative operators at some particles, one row a particle.

    Attributes:
        rows: `(m,)` the particles.
        gradient: three `(m, n)` matrices, d/dx, d/dy, d/dz [1/m].
        laplacian: `(m, n)` [1/m^2]; zero in rows of order 1 of the quadratic basis.
        order: `(m,)` order of the polynomial that each row reproduces.
    """

    rows: NDArray[np.int32]
    gradient: tuple[sparse.csr_matrix, sparse.csr_matrix, sparse.csr_matrix]
    laplacian: sparse.csr_matrix
    order: NDArray[np.int8]


def derivatives(points: Floats, rows: NDArray[np.int32], neighbours: NeighbourList, basis: str) -> Derivatives:
    """Fit the derivative operators at some particles.

    Args:
        points: `(n, 3)` [m].
        rows: `(m,)` particles at which the derivatives are wanted.
        neighbours: a list whose radius is the support of the weights.
        basis: "linear" or "quadratic".

    Raises:
        DegenerateStencil: a particle has too few neighbours, or they lie in a plane.
    """
    kernel = {"linear": linear_weights, "quadratic": quadratic_weights}[basis]
    pair, own, order = kernel(rows, points, neighbours.offsets, neighbours.indices, neighbours.radius)
    _check_order(order, points, rows, neighbours)
    first, second, third, laplacian = _assemble(len(points), rows, neighbours, (pair, own))
    return Derivatives(rows, (first, second, third), laplacian, order)


def shape_functions(points: Floats, rows: NDArray[np.int32], neighbours: NeighbourList) -> sparse.csr_matrix:
    """Values psi_J of the linear MLS shape functions at some particles (Hu et al., eq 11), `(m, n)`; rows add up to 1.

    Args: as `derivatives`.

    Raises:
        DegenerateStencil: a particle has too few neighbours, or they lie in a plane.
    """
    pair, own, order = shape_weights(rows, points, neighbours.offsets, neighbours.indices, neighbours.radius)
    _check_order(order, points, rows, neighbours)
    return _assemble(len(points), rows, neighbours, (pair, own))[0]


def _check_order(order: NDArray[np.int8], points: Floats, rows: NDArray[np.int32], neighbours: NeighbourList) -> None:
    if (order == 0).any():
        worst = rows[int(np.argmin(order))]
        raise DegenerateStencil(
            f"particle {worst} at {points[worst]} m has {np.diff(neighbours.offsets)[worst]} neighbours within "
            f"{neighbours.radius:.3g} m, or they lie in a plane: no gradient can be fitted"
        )


def _assemble(
    count: int, rows: NDArray[np.int32], neighbours: NeighbourList, weights: tuple[Floats, Floats]
) -> list[sparse.csr_matrix]:
    """One matrix `(m, count)` for each column of the weights per pair and at the particle."""
    pair, own = weights
    lengths = np.diff(neighbours.offsets)[rows]
    starts = np.concatenate(([0], np.cumsum(lengths + 1)))
    first = np.cumsum(lengths) - lengths
    slot = np.repeat(neighbours.offsets[rows] - first, lengths) + np.arange(lengths.sum())
    columns = np.empty(starts[-1], np.int32)
    is_own = np.zeros(starts[-1], bool)
    is_own[starts[1:] - 1] = True
    columns[is_own] = rows
    columns[~is_own] = neighbours.indices[slot]
    matrices = []
    for c in range(pair.shape[1]):
        values = np.empty(starts[-1])
        values[is_own] = own[:, c]
        values[~is_own] = pair[slot, c]
        matrices.append(sparse.csr_matrix((values, columns, starts), shape=(len(rows), count)))
    return matrices
