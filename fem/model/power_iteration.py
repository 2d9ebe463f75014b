"""Highest frequency of an assembled model, tie and supports included: Lanczos' form of the power iteration.

The largest Ritz value is below the largest eigenvalue of M^-1 K. How far below is not known for sure, but it is in
probability over random starts, whatever the spectrum (Kuczynski & Wozniakowski, SIAM J. Matrix Anal. Appl. 13, 1992,
theorem 4): after k steps with n unknowns it misses a fraction e with a probability below
1.648 sqrt(n) exp(-(2 k - 1) sqrt(e)). Solved for e, that makes the Ritz value an upper estimate.

With the chosen e the step is too large with a probability of 1e-12 at most.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.forces.energy import InternalForce
from reflowshock.fem.model.body import Body

MISSED = 1e-12  # accepted probability that the estimate is too low
MARGIN = 0.005  # wanted relative margin on the frequency squared
SEED = 0x9E3779B97F4A7C15


@dataclass(frozen=True, slots=True)
class HighestFrequency:
    """What the iteration found.

    Attributes:
        critical_step: 2 / omega of the upper estimate [s].
        margin: Fraction by which the upper estimate of omega^2 may be too high; omega^2 itself if it was exhausted.
        iterations: Products with K.
    """

    critical_step: float
    margin: float
    iterations: int


def highest_frequency(
    comm: MPI.Comm, body: Body, terms: Sequence[InternalForce], mass: NDArray[np.float64], margin: float = MARGIN
) -> HighestFrequency:
    """Estimate the critical step of a model from above in frequency; collective.

    Args:
        comm: Communicator of the model.
        body: The model: tie, shared nodes, free components.
        terms: Terms that are linear in the displacement.
        mass: ``(n,)`` lumped mass [kg] with all that moves along.
        margin: Wanted relative margin on omega^2, positive.

    Returns:
        The estimate; its critical step is infinite where nothing can move or nothing is stiff.
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
    largest, iterations = lanczos(product, dot, start, steps_for(unknowns, margin))
    missed = min(margin_after(iterations, unknowns), margin) if iterations < unknowns else 0.0
    if largest <= 0.0:
        return HighestFrequency(math.inf, missed, iterations)
    return HighestFrequency(2.0 * math.sqrt((1.0 - missed) / largest), missed, iterations)


def steps_for(unknowns: int, margin: float) -> int:
    """Return the Lanczos steps after which the estimate misses more than ``margin`` with probability ``MISSED``."""
    needed = 0.5 * (1.0 + math.log(1.648 * math.sqrt(max(unknowns, 1)) / MISSED) / math.sqrt(margin))
    return min(math.ceil(needed), unknowns)


def margin_after(steps: int, unknowns: int) -> float:
    """Return the margin that ``steps`` Lanczos steps give; the inverse of ``steps_for``."""
    return (math.log(1.648 * math.sqrt(max(unknowns, 1)) / MISSED) / max(2 * steps - 1, 1)) ** 2


def lanczos(product, dot, start: NDArray[np.float64], steps: int) -> tuple[float, int]:
    """Return the largest Ritz value after some steps, and how many were taken: fewer where the space is exhausted.

    The vectors lose orthogonality in round-off, which repeats Ritz values but moves none beyond the spectrum.

    Args:
        product: Symmetric operator on vectors like ``start``.
        dot: Scalar product, equal on all ranks.
        start: First vector, not normalised.
        steps: Most products.
    """
    norm = math.sqrt(dot(start, start))
    if norm == 0.0 or steps == 0:
        return 0.0, 0
    vector, before = start / norm, np.zeros_like(start)
    diagonal: list[float] = []
    beside: list[float] = []
    for _ in range(steps):
        image = product(vector)
        diagonal.append(dot(vector, image))
        image -= diagonal[-1] * vector + (beside[-1] if beside else 0.0) * before
        rest = math.sqrt(dot(image, image))
        if rest <= 1e-12 * max(abs(value) for value in diagonal):
            break
        beside.append(rest)
        before, vector = vector, image / rest
    return largest_of_tridiagonal(diagonal, beside[: len(diagonal) - 1]), len(diagonal)


def largest_of_tridiagonal(diagonal: Sequence[float], beside: Sequence[float]) -> float:
    """Return the largest eigenvalue of a symmetric tridiagonal matrix."""
    matrix = np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1)
    return float(np.linalg.eigvalsh(matrix)[-1])


def random_normal(nodes: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return normal random numbers ``(n, 3)`` that depend on the node numbers alone, so not on ranks (splitmix64)."""
    counter = 6 * nodes.astype(np.uint64)[:, None] + np.arange(6, dtype=np.uint64)
    bits = (counter + np.uint64(1)) * np.uint64(SEED)
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    uniform = ((bits ^ (bits >> np.uint64(31))) >> np.uint64(11)).astype(float) * 2.0**-53
    return np.sqrt(-2.0 * np.log1p(-uniform[:, :3])) * np.cos(2.0 * np.pi * uniform[:, 3:])
