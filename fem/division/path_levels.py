"""Step levels along a path: impulses inside a window of held velocity.

An element of pace r acts once in r steps of its model's motion, by an impulse of r dt times its force, and follows its
path from one of these states to the next (r-RESPA; M. Tuckerman, B. J. Berne, G. J. Martyna, J. Chem. Phys. 97, 1992,
1990-2001). Impulses have no resultant, so that momentum is kept to round-off by any path; no state is a mean, as those
of local steps are, so that plastic work is what it is in one model. Impulses drive what swings with half their period.
Elements swing at most with 2 / T of their critical step T. So layers of elements that could take the larger step lie
between those that cannot and those that do: what would resonate fades in them. Through a layer with the critical step T
a swing of half the period t fades by exp(-2 arcosh(pi T / (2 t))), as in a chain of masses and springs above its
highest frequency. There are two layers, or one in which it fades as much as in two that can just take the larger step.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.choose_levels import ROUNDING, SUBSTEP_COST, Pace
from reflowshock.fem.division.division import Division

MOST_LEVELS = 3  # as many as ``kernels.levels`` has paces; it is compiled code, which no plan loads
Around = Callable[[NDArray[np.bool_]], NDArray[np.bool_]]


def with_path_levels(division: Division, pace: Pace, around: Around, most: int) -> Division:
    """Return a division of held velocity in the levels, and with the substeps, of least predicted cost.

    Args:
        division: In one level.
        pace: Critical steps and costs of all cells.
        around: Returns which cells ``(ne,)`` of the meso model share a node with some, by a tie or without.
        most: Largest number of levels wanted.
    """
    plan, found = division.plan, FinerCells(division.meso, pace, around)

    def cost(ratios: tuple[int, ...]) -> float:
        counts = np.cumprod(ratios)
        level = found.level(ratios)
        return float(pace.cost @ np.array([0, *counts])[level]) + SUBSTEP_COST * float(counts.sum())

    ratios = min(candidates(plan.substeps, min(MOST_LEVELS, most)), key=cost)
    return replace(division, level=found.level(ratios), ratios=ratios, plan=replace(plan, substeps=math.prod(ratios)))


def candidates(substeps: int, most: int) -> Iterator[tuple[int, ...]]:
    """Yield ratios of one to ``most`` levels whose product is at least ``substeps``, and no larger than it must be."""
    yield (substeps,)
    if most > 1:
        for first in range(1, substeps):
            for inner in candidates(-(-substeps // first), most - 1):
                if inner[0] > 1:
                    yield (first, *inner)


def opaque_ratio(fraction: float) -> float:
    """Return the step of an element, over the larger one, from which on one layer is as good as two that just take it.

    Both are ``fraction`` of critical steps. The swing fades in it by twice the exponent: arcosh(r x) = 2 arcosh(x).
    """
    just = 0.5 * math.pi / fraction
    return 2.0 * just - 1.0 / just


class FinerCells:
    """Cells of the meso model that need smaller steps than some share of the window, and layers around them."""

    def __init__(self, meso: NDArray[np.bool_], pace: Pace, around: Around) -> None:
        """Take the cells ``(ne,)`` of the meso model, and what ``with_path_levels`` takes."""
        self._meso, self._around = meso, around
        self._steps, self._window = pace.fraction * pace.steps, pace.window
        self._opaque = opaque_ratio(pace.fraction)
        self._known: dict[int, NDArray[np.bool_]] = {}

    def than(self, count: int) -> NDArray[np.bool_]:
        """Return which cells ``(ne,)`` may not take ``count`` steps a window."""
        if count not in self._known:
            larger = self._window / count * (1.0 - ROUNDING)
            taken = self._around(self._meso & (self._steps < larger))
            self._known[count] = taken | self._around(taken & (self._steps < self._opaque * larger))
        return self._known[count]

    def level(self, ratios: tuple[int, ...]) -> NDArray[np.int32]:
        """Return the level ``(ne,)`` of each cell, 0 for those of the macro model."""
        inner = [self.than(int(count)) for count in np.cumprod(ratios)[:-1]]
        return np.sum([self._meso, *inner], axis=0, dtype=np.int32)
