"""Charts of a page: lines and marks that the browser draws, to be zoomed and read under the pointer."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reflowshock.workflow.report.colours import BLUE

if TYPE_CHECKING:
    from reflowshock.workflow.report.page_data import PageData

MOST_POINTS = 2400  # of a line: two for each pixel of a wide screen
DASHES = {"solid": [], "dashed": [7, 4], "dotted": [2, 3]}


@dataclass(frozen=True, slots=True)
class Series:
    """A line, marks, or both.

    Attributes:
        name: in the legend.
        x: ``(n,)``, ascending.
        y: ``(n,)``; nan leaves a gap.
        colour: ``#rrggbb``.
        line: one of ``DASHES``, "step", or "none" for marks alone.
        marks: whether each value has a mark.
        fill: whether the area below is tinted.
        is_right: whether the values belong to the axis on the right.
        labels: name of each value, to be read under the pointer; or none.
    """

    name: str
    x: ArrayLike
    y: ArrayLike
    colour: str = BLUE
    line: str = "solid"
    marks: bool = False
    fill: bool = False
    is_right: bool = False
    labels: Sequence[str] = ()

    def record(self, page: "PageData") -> dict:
        """Return what the script draws."""
        x, y = np.asarray(self.x, dtype=float), np.asarray(self.y, dtype=float)
        if not self.labels:
            x, y = thinned(x, y)
        return {
            "name": self.name,
            "x": page.array(x, "f4"),
            "y": page.array(y, "f4"),
            "colour": self.colour,
            "dash": DASHES.get(self.line, []),
            "step": self.line == "step",
            "line": self.line != "none",
            "marks": self.marks,
            "fill": self.fill,
            "right": self.is_right,
            "labels": list(self.labels),
        }


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis: what it shows with its unit, whether it is logarithmic, and the names that stand for 0, 1, 2, ..."""

    label: str
    log: bool = False
    names: Sequence[str] = ()

    def record(self) -> dict:
        """Return what the script draws."""
        return {"label": self.label, "log": self.log, "names": list(self.names)}


@dataclass(frozen=True, slots=True)
class Chart:
    """A chart.

    Attributes:
        x, y: its axes.
        series: what is drawn.
        title: above it.
        right: label of the axis on the right, where a series needs one.
        is_upright: whether x points upwards.
        is_wide: whether it takes the whole width of the page.
    """

    x: Axis
    y: Axis
    series: Sequence[Series] = field(default_factory=list)
    title: str = ""
    right: str = ""
    is_upright: bool = False
    is_wide: bool = False

    def record(self, page: "PageData") -> dict:
        """Return what the script draws."""
        return {
            "x": self.x.record(),
            "y": self.y.record(),
            "series": [one.record(page) for one in self.series],
            "title": self.title,
            "right": self.right,
            "upright": self.is_upright,
            "wide": self.is_wide,
        }


def thinned(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a line of at most ``MOST_POINTS`` points with the least and the largest value of each short stretch.

    Args:
        x: ``(n,)``, ascending.
        y: ``(n,)``; where values are missing nothing is left out.
    """
    if len(x) <= MOST_POINTS or not np.isfinite(y).all():
        return x, y
    edges = np.linspace(0, len(x), MOST_POINTS // 2 - 1).astype(int)
    low = [first + int(np.argmin(y[first:last])) for first, last in pairwise(edges)]
    high = [first + int(np.argmax(y[first:last])) for first, last in pairwise(edges)]
    kept = np.unique([0, *low, *high, len(x) - 1])
    return x[kept], y[kept]
