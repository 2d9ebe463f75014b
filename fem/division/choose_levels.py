"""Choice of step levels and step ratios by the least predicted cost of a window."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.chebyshev import Substeps
from reflowshock.fem.errors import LevelError

if TYPE_CHECKING:  # a plan loads no compiled kernels
    from reflowshock.fem.mesh.tie import Tie

SUBSTEP_COST = 500.0  # fixed cost of a substep (kernel calls, messages), in updates of a box
LARGEST_RATIO = 64
ROUNDING = 1e-12


@dataclass(frozen=True, slots=True)
class StepLimits:
    """Critical steps and costs from which the step levels follow.

    Attributes:
        steps: Critical step of each element, shape (ne,) [s].
        cost: Cost of an update of each element, in updates of a box, shape (ne,).
        window: Step of level 0 [s].
        fraction: Largest allowed step over undamped critical step.
        stiffness: Coefficient beta of stiffness-proportional damping [s].
    """

    steps: NDArray[np.float64]
    cost: NDArray[np.float64]
    window: float
    fraction: float
    stiffness: float = 0.0

    @property
    def damping(self) -> float:
        """Coefficient beta over the window."""
        return self.stiffness / self.window

    @property
    def outermost(self) -> float:
        """Smallest critical step times fraction of an element that can take the window [s].

        Damping requires DT^2 (1 + 2 beta / DT) below the square of the critical step; inside the levels, the
        stabilisation parameter nu accounts for it.
        """
        return self.window * math.sqrt(1.0 + 2.0 * self.fraction * self.damping)


def choose_levels(
    cells: NDArray[np.int32], tie: "Tie", limits: StepLimits, most: int
) -> tuple[NDArray[np.int32], tuple[int, ...]]:
    """Choose the levels of all elements of a mesh.

    A level contains all nodes of the elements that need its step, including the masters of slaves, and all elements of
    these nodes. It thus grows by one layer of elements that could take larger steps.

    Args:
        cells: Nodes of each element, shape (ne, k).
        tie: Slaves and masters of the mesh.
        limits: Critical steps and costs of the elements.
        most: Largest number of levels below the window, at least 1.

    Returns:
        Level of each element, 0 for the window, shape (ne,) int32, and the ratios: steps of level k + 1 in one step of
        level k, empty if all elements take the window.

    Raises:
        LevelError: The elements need more than ``LARGEST_RATIO`` steps in a level.
    """
    needed = governing_steps(cells, tie, limits.fraction * limits.steps)
    if needed.min() >= limits.outermost * (1.0 - ROUNDING):
        return np.zeros(len(cells), np.int32), ()
    order = np.argsort(needed)
    cost = np.concatenate([[0.0], np.cumsum(limits.cost[order])])
    candidates = list(_all_ratios(limits, limits.window / needed.min(), (), most))
    if not candidates:
        raise LevelError(
            f"the window {limits.window:.3e} s is {limits.window / needed.min():.3g} times the smallest step of an"
            f" element, {needed.min():.3e} s; allowed: {LARGEST_RATIO} steps per level and {most} levels"
        )
    ratios = candidates[int(np.argmin(_window_costs(candidates, needed[order], cost, limits)))]
    return np.sum(needed[:, None] < least_steps(ratios, limits)[:-1], axis=1, dtype=np.int32), ratios


def governing_steps(cells: NDArray[np.int32], tie: "Tie", steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the smallest critical step among all elements that share a node with each element.

    Slaves count as their masters. This step determines the level of the element.

    Args:
        cells: Nodes of each element, shape (ne, k).
        tie: Slaves and masters of the mesh.
        steps: Usable critical step of each element, shape (ne,) [s].

    Returns:
        Smallest step for each element, shape (ne,) [s].
    """
    node = np.full(int(max(cells.max(), tie.master.max(initial=0), tie.slave.max(initial=0))) + 1, np.inf)
    np.minimum.at(node, cells.ravel(), np.repeat(steps, cells.shape[1]))
    np.minimum.at(node, tie.master.ravel(), np.repeat(node[tie.slave], tie.master.shape[1]))
    node[tie.slave] = node[tie.master].min(axis=1)
    return node[cells].min(axis=1)


def least_steps(ratios: tuple[int, ...], limits: StepLimits) -> NDArray[np.float64]:
    """Return the smallest stable step, critical step times safety fraction, that an element must have at each level.

    An element with a smaller one must go to a higher level, with more substeps.

    Args:
        ratios: Steps of level k + 1 in one step of level k, outermost first; empty for level 0 alone.
        limits: Window (step of level 0) [s], fraction of step over critical step, and damping; its elements are not
            used.

    Returns:
        Smallest step at levels 0, 1, ..., shape (levels + 1,) [s].
    """
    counts = np.cumprod(ratios)
    reaches = [reach_of(ratio, level, limits.damping) for level, ratio in enumerate(ratios, 1)]
    return np.array([limits.outermost, *(limits.window / (counts * reaches))]) * (1.0 - ROUNDING)


@cache
def reach_of(ratio: int, level: int, damping: float) -> float:
    """Return the largest stable substep of a level over the stable step of plain leapfrog, dimensionless.

    The substeps of a level are stabilised by Chebyshev polynomials, see ``Substeps``, which makes them shorter.

    Args:
        ratio: Substeps of the level in one step of the surrounding level.
        level: Number of the level, 1 for the outermost.
        damping: Coefficient beta of stiffness-proportional damping over the window, dimensionless.
    """
    return Substeps.of(ratio, level, damping).reach


def _all_ratios(limits: StepLimits, needed: float, inner: tuple[int, ...], most: int) -> Iterator[tuple[int, ...]]:
    """Yield the ratios of one to ``most`` levels that divide a window into at least ``needed`` steps.

    Args:
        limits: Critical steps and costs of the elements.
        needed: Step of level 0 over the smallest step.
        inner: Ratios of the surrounding levels.
        most: Largest number of further levels.
    """
    level = len(inner) + 1
    for ratio in range(2, LARGEST_RATIO + 1):
        reached = ratio * reach_of(ratio, level, limits.damping)
        if reached >= needed * (1.0 - ROUNDING):
            yield (*inner, ratio)
            return
        if most > 1 and needed / ratio <= LARGEST_RATIO ** (most - 1):
            yield from _all_ratios(limits, needed / ratio, (*inner, ratio), most - 1)


def _window_costs(
    candidates: list[tuple[int, ...]], needed: NDArray[np.float64], cost: NDArray[np.float64], limits: StepLimits
) -> NDArray[np.float64]:
    """Return the predicted cost of a window for each candidate, for element updates and substeps.

    There may be 250 000 candidates, so all candidates with the same number of levels are evaluated together.

    Args:
        candidates: Ratios of the levels.
        needed: Required step of each element in ascending order, shape (ne,) [s].
        cost: Cumulative cost of an update of the elements in this order, shape (ne + 1,).
        limits: Critical steps and costs of the elements.
    """
    totals = np.empty(len(candidates))
    lengths = np.array([len(ratios) for ratios in candidates])
    for length in np.unique(lengths):
        rows = np.flatnonzero(lengths == length)
        ratios = np.array([candidates[row] for row in rows])
        counts = np.cumprod(ratios, axis=1)
        least = np.full(ratios.shape, limits.outermost)
        for level in range(1, length):
            reach = {ratio: reach_of(ratio, level, limits.damping) for ratio in range(2, LARGEST_RATIO + 1)}
            reaches = np.array([reach.get(ratio, 1.0) for ratio in range(LARGEST_RATIO + 1)])
            least[:, level] = limits.window / (counts[:, level - 1] * reaches[ratios[:, level - 1]])
        finer = cost[np.searchsorted(needed, least * (1.0 - ROUNDING))]
        beyond = np.concatenate([finer[:, 1:], np.zeros((len(rows), 1))], axis=1)
        totals[rows] = (counts * (finer - beyond + SUBSTEP_COST)).sum(axis=1) - finer[:, 0]
    return totals
