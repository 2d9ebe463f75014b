"""Step levels along a path: impulses inside a window of held velocity.

An element of pace r acts once in r steps of its model's motion, by an impulse of r dt times its force, and follows its
path from one of these states to the next (r-RESPA; M. Tuckerman, B. J. Berne, G. J. Martyna, J. Chem. Phys. 97, 1992,
1990-2001). Impulses have no resultant, so that momentum is kept to round-off by any path; no state is a mean, as those
of local steps are, so that plastic work is what it is in one model. Impulses drive what swings with half their period.
Elements swing at most with 2 / T of their critical step T. So layers of elements that could take the larger step lie
between those that cannot and those that do: what would resonate fades in them.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.choose_levels import ROUNDING, SUBSTEP_COST
from reflowshock.fem.division.division import Division, Rules
from reflowshock.fem.division.whole import Survey, Whole, seeds_of, touching
from reflowshock.fem.kernels.levels import PACES


def with_path_levels(whole: Whole, survey: Survey, division: Division, rules: Rules) -> Division:
    """Return a division of held velocity in the levels, and with the substeps, of least predicted cost."""
    plan, found = division.plan, FinerCells(whole, survey, division, rules)

    def cost(ratios: tuple[int, ...]) -> float:
        counts = np.cumprod(ratios)
        level = found.level(ratios)
        return float(survey.cost @ np.array([0, *counts])[level]) + SUBSTEP_COST * float(counts.sum())

    ratios = min(candidates(plan.substeps, min(PACES, rules.coupling.most_levels)), key=cost)
    return replace(division, level=found.level(ratios), ratios=ratios, plan=replace(plan, substeps=math.prod(ratios)))


def candidates(substeps: int, most: int) -> Iterator[tuple[int, ...]]:
    """Yield ratios of one to ``most`` levels whose product is at least ``substeps``, and no larger than it must be."""
    yield (substeps,)
    if most > 1:
        for first in range(1, substeps):
            for inner in candidates(-(-substeps // first), most - 1):
                if inner[0] > 1:
                    yield (first, *inner)


class FinerCells:
    """Cells of the meso model that need smaller steps than some share of the window, and layers around them."""

    def __init__(self, whole: Whole, survey: Survey, division: Division, rules: Rules) -> None:
        """Take a divided mesh."""
        self._whole, self._meso = whole, division.meso
        self._steps, self._window = rules.fraction * survey.step, division.plan.window
        self._layers = rules.coupling.buffer_layers
        self._known: dict[int, NDArray[np.bool_]] = {}

    def than(self, count: int) -> NDArray[np.bool_]:
        """Return which cells ``(ne,)`` may not take ``count`` steps a window."""
        if count not in self._known:
            taken = self._meso & (self._steps < self._window / count * (1.0 - ROUNDING))
            for _ in range(self._layers if taken.any() else 0):
                taken = self._meso & self._around(taken)
            self._known[count] = taken
        return self._known[count]

    def level(self, ratios: tuple[int, ...]) -> NDArray[np.int32]:
        """Return the level ``(ne,)`` of each cell, 0 for those of the macro model."""
        inner = [self.than(int(count)) for count in np.cumprod(ratios)[:-1]]
        return np.sum([self._meso, *inner], axis=0, dtype=np.int32)

    def _around(self, taken: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the cells ``(ne,)`` that share a node with some, by a tie or without."""
        tie, nodes = self._whole.tie, seeds_of(self._whole, taken)
        nodes[tie.slave[nodes[tie.master].any(axis=1)]] = True
        return touching(self._whole.mesh.cells, nodes)
