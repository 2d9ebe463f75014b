"""Highest frequency of an assembled model, tie and supports included, by the Lanczos method.

The largest Ritz value is below the largest eigenvalue of M^-1 K. For a random start vector and any spectrum, it is too
low by more than a fraction e after k steps with n unknowns with a probability below
1.648 sqrt(n) exp(-(2 k - 1) sqrt(e)) (Kuczynski & Wozniakowski, SIAM J. Matrix Anal. Appl. 13, 1992, theorem 4).
Dividing the Ritz value by 1 - e, with e from a probability of 1e-12, gives an upper bound of the frequency.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.forces.energy import InternalForce
from reflowshock.fem.model.body import Body

FAILURE_PROBABILITY = 1e-12  # accepted probability that the estimate is too low
MARGIN = 0.005  # relative margin on the squared frequency
SEED = 0x9E3779B97F4A7C15


@dataclass(frozen=True, slots=True)
class HighestFrequency:
    """Upper estimate of the highest frequency.

    Attributes:
        critical_step: 2 / omega of the upper estimate [s].
        margin: Fraction by which the estimate of omega^2 may be too high; zero if the Krylov space is exhausted.
        iterations: Number of products with K.
    """

    critical_step: float
    margin: float
    iterations: int


def highest_frequency(
    comm: MPI.Comm, body: Body, terms: Sequence[InternalForce], mass: NDArray[np.float64], margin: float = MARGIN
) -> HighestFrequency:
    """Estimate the highest frequency of a model from above, and its critical step from below; collective.

    Args:
        comm: Communicator of the model.
        body: Model with its tie, shared nodes and free components.
        terms: Force terms, linear in the displacement.
        mass: Lumped mass, attached masses included, shape (n,) [kg].
        margin: Relative margin on omega^2, positive.

    Returns:
        Upper estimate of the frequency; the critical step is infinite if no node can move or no element is stiff.
    """
    scale = np.where(body.free, 1.0 / np.sqrt(np.where(mass > 0.0, mass, np.inf))[:, None], 0.0)
    owned = body.shared.owned
    unknowns = int(comm.allreduce(np.count_nonzero(scale[owned])))

    def dot(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
        return float(comm.allreduce(float(np.sum(first[owned] * second[owned]))))

    def product(vector: NDArray[np.float64]) -> NDArray[np.float64]:
        displacement, force = scale * vector, np.zeros_like(vector)
        body.tie.spread(displacement)
        for term in terms:
            term.add(displacement, force)
        body.tie.gather(force)
        body.shared.add(force)
        return -scale * force

    start = np.where(scale > 0.0, random_normal(body.local.nodes), 0.0)
    largest, iterations = _lanczos(product, dot, start, steps_for(unknowns, margin))
    deficit = min(margin_after(iterations, unknowns), margin) if iterations < unknowns else 0.0
    if largest <= 0.0:
        return HighestFrequency(math.inf, deficit, iterations)
    return HighestFrequency(2.0 * math.sqrt((1.0 - deficit) / largest), deficit, iterations)


def steps_for(unknowns: int, margin: float) -> int:
    """Return the number of Lanczos steps, at most ``unknowns``, after which the margin on omega^2 is reached.

    Args:
        unknowns: Number of unknowns on all ranks.
        margin: Relative error of omega^2 that is exceeded with a probability of ``FAILURE_PROBABILITY``, positive.
    """
    needed = 0.5 * (1.0 + math.log(1.648 * math.sqrt(max(unknowns, 1)) / FAILURE_PROBABILITY) / math.sqrt(margin))
    return min(math.ceil(needed), unknowns)


def margin_after(steps: int, unknowns: int) -> float:
    """Return the relative margin on omega^2 after a number of Lanczos steps; the inverse of ``steps_for``.

    Args:
        steps: Number of Lanczos steps taken.
        unknowns: Number of unknowns on all ranks.
    """
    return (math.log(1.648 * math.sqrt(max(unknowns, 1)) / FAILURE_PROBABILITY) / max(2 * steps - 1, 1)) ** 2


def _lanczos(product, dot, start: NDArray[np.float64], steps: int) -> tuple[float, int]:
    """Return the largest Ritz value and the number of steps taken, fewer if the Krylov space is exhausted.

    The vectors lose orthogonality by round-off, which repeats Ritz values but moves none outside the spectrum.

    Args:
        product: Symmetric operator on vectors like ``start``.
        dot: Scalar product, equal on all ranks.
        start: First vector, not normalised.
        steps: Largest number of products.
    """
    norm = math.sqrt(dot(start, start))
    if norm == 0.0 or steps == 0:
        return 0.0, 0
    vector, previous = start / norm, np.zeros_like(start)
    diagonal: list[float] = []
    off_diagonal: list[float] = []
    for _ in range(steps):
        image = product(vector)
        diagonal.append(dot(vector, image))
        image -= diagonal[-1] * vector + (off_diagonal[-1] if off_diagonal else 0.0) * previous
        residual = math.sqrt(dot(image, image))
        if residual <= 1e-12 * max(abs(value) for value in diagonal):
            break
        off_diagonal.append(residual)
        previous, vector = vector, image / residual
    return _largest_of_tridiagonal(diagonal, off_diagonal[: len(diagonal) - 1]), len(diagonal)


def _largest_of_tridiagonal(diagonal: Sequence[float], off_diagonal: Sequence[float]) -> float:
    """Return the largest eigenvalue of a symmetric tridiagonal matrix."""
    matrix = np.diag(diagonal) + np.diag(off_diagonal, 1) + np.diag(off_diagonal, -1)
    return float(np.linalg.eigvalsh(matrix)[-1])


def random_normal(nodes: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return standard normal random numbers, shape (n, 3), that depend only on node numbers, not on ranks (splitmix64).

    Args:
        nodes: Input numbers of this rank's nodes, shape (n,).
    """
    counter = 6 * nodes.astype(np.uint64)[:, None] + np.arange(6, dtype=np.uint64)
    bits = (counter + np.uint64(1)) * np.uint64(SEED)
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    uniform = ((bits ^ (bits >> np.uint64(31))) >> np.uint64(11)).astype(float) * 2.0**-53
    return np.sqrt(-2.0 * np.log1p(-uniform[:, :3])) * np.cos(2.0 * np.pi * uniform[:, 3:])
