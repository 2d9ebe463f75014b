"""Step levels for path-dependent elements: impulses inside a window of held velocity (r-RESPA).

An element of pace r acts once in r steps of its model, by an impulse of r dt times its force, and integrates its
history between these states (M. Tuckerman, B. J. Berne, G. J. Martyna, J. Chem. Phys. 97, 1992, 1990-2001). Impulses
have no resultant, so momentum is conserved to round-off; no state is a mean as with local steps, so plastic work is
correct.

Impulses resonate with oscillations whose half period is the interval between them. Elements oscillate at most with the
frequency 2 / T of their critical step T. Therefore layers of elements that could take the larger step separate the
elements of both levels, and the resonance decays in them: in a layer of critical step T, an oscillation of half period
t decays by exp(-2 arcosh(pi T / (2 t))), as in a chain of masses and springs above its cut-off frequency. There are two
layers, or one with the same decay as two layers that can just take the larger step.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.choose_levels import ROUNDING, SUBSTEP_COST, StepLimits
from reflowshock.fem.division.division import Division

MOST_LEVELS = 3  # equal to ``kernels.levels.PACES``, which is not imported because ``plan`` loads no compiled code
Around = Callable[[NDArray[np.bool_]], NDArray[np.bool_]]


def with_path_levels(division: Division, limits: StepLimits, around: Around, most: int) -> Division:
    """Return a division of held velocity with the levels and substeps of least predicted cost.

    Args:
        division: Division with a single level.
        limits: Critical steps [s] and costs of all cells.
        around: Function that takes a mask of cells and returns the mask of the meso cells that share a node with them,
            also through ties, shape (ne,) each.
        most: Largest number of levels.

    Returns:
        Division with the same cells and windows; levels of the meso cells, ratios between levels and substeps are new.
    """
    plan, finer = division.plan, FinerCells(division.meso, limits, around)

    def cost(ratios: tuple[int, ...]) -> float:
        counts = np.cumprod(ratios)
        level = finer.level(ratios)
        return float(limits.cost @ np.array([0, *counts])[level]) + SUBSTEP_COST * float(counts.sum())

    ratios = min(_candidates(plan.substeps, min(MOST_LEVELS, most)), key=cost)
    return replace(division, level=finer.level(ratios), ratios=ratios, plan=replace(plan, substeps=math.prod(ratios)))


def _candidates(substeps: int, most: int) -> Iterator[tuple[int, ...]]:
    """Yield ratios of one to ``most`` levels whose product is the smallest that reaches ``substeps``."""
    yield (substeps,)
    if most > 1:
        for first in range(1, substeps):
            for inner in _candidates(-(-substeps // first), most - 1):
                if inner[0] > 1:
                    yield (first, *inner)


def opaque_ratio(fraction: float) -> float:
    """Return the ratio of steps below which a cell with a small step needs a second layer of cells around it.

    Fast motion decays outwards from small steps, layer by layer. In a layer whose largest stable step is r times the
    step of the cells outside, it decays as much as in two layers with r = 1 if arcosh(r x) = 2 arcosh(x), x = pi / (2
    fraction).

    Args:
        fraction: Time step over critical time step, the same for both steps, dimensionless.

    Returns:
        Ratio r, dimensionless, above one.
    """
    just = 0.5 * math.pi / fraction
    return 2.0 * just - 1.0 / just


class FinerCells:
    """Cells of the meso model that need smaller steps than a fraction of the window, with layers around them."""

    def __init__(self, meso: NDArray[np.bool_], limits: StepLimits, around: Around) -> None:
        """Take the cells of the meso model, shape (ne,); other arguments as in ``with_path_levels``."""
        self._meso, self._around = meso, around
        self._steps, self._window = limits.fraction * limits.steps, limits.window
        self._opaque = opaque_ratio(limits.fraction)
        self._cache: dict[int, NDArray[np.bool_]] = {}

    def than(self, count: int) -> NDArray[np.bool_]:
        """Return the cells that need more than ``count`` steps per window, with layers around them, shape (ne,)."""
        if count not in self._cache:
            larger = self._window / count * (1.0 - ROUNDING)
            taken = self._around(self._meso & (self._steps < larger))
            self._cache[count] = taken | self._around(taken & (self._steps < self._opaque * larger))
        return self._cache[count]

    def level(self, ratios: tuple[int, ...]) -> NDArray[np.int32]:
        """Return the level of each cell, 0 for the macro model, shape (ne,)."""
        inner = [self.than(int(count)) for count in np.cumprod(ratios)[:-1]]
        return np.sum([self._meso, *inner], axis=0, dtype=np.int32)
