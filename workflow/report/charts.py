"""Interactive charts of a report page: lines and markers, drawn by the browser."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reflowshock.workflow.report.colours import BLUE

if TYPE_CHECKING:
    from reflowshock.workflow.report.page_data import PageData

MOST_POINTS = 2400  # points of a line: two for each pixel of a wide screen
DASHES = {"solid": [], "dashed": [7, 4], "dotted": [2, 3]}


@dataclass(frozen=True, slots=True)
class Series:
    """A line, markers, or both.

    Attributes:
        name: Name in the legend.
        x: Ascending abscissae, shape (n,).
        y: Ordinates, shape (n,); NaN leaves a gap.
        colour: Colour as ``#rrggbb``.
        line: Line style of ``DASHES``, "step", or "none" for markers alone.
        marks: Whether each value has a marker.
        fill: Whether the area below the line is tinted.
        is_right: Whether the values belong to the right axis.
        labels: Name of each value, shown at the pointer; empty for none.
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
        """Return the record that the script reads."""
        x, y = np.asarray(self.x, dtype=float), np.asarray(self.y, dtype=float)
        if not self.labels:
            x, y = thin_samples(x, y)
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
    """An axis: label with unit, logarithmic scale, and the names of categories 0, 1, 2, ..."""

    label: str
    log: bool = False
    names: Sequence[str] = ()

    def record(self) -> dict:
        """Return the record that the script reads."""
        return {"label": self.label, "log": self.log, "names": list(self.names)}


@dataclass(frozen=True, slots=True)
class Chart:
    """A chart.

    Attributes:
        x: Horizontal axis.
        y: Vertical axis.
        series: Lines and markers.
        title: Title above the chart.
        right: Label of the right axis; empty for none.
        is_upright: Whether x points upwards.
        is_wide: Whether the chart takes the whole width of the page.
    """

    x: Axis
    y: Axis
    series: Sequence[Series] = field(default_factory=list)
    title: str = ""
    right: str = ""
    is_upright: bool = False
    is_wide: bool = False

    def record(self, page: "PageData") -> dict:
        """Return the record that the script reads."""
        return {
            "x": self.x.record(),
            "y": self.y.record(),
            "series": [series.record(page) for series in self.series],
            "title": self.title,
            "right": self.right,
            "upright": self.is_upright,
            "wide": self.is_wide,
        }


def thin_samples(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Reduce a line to ``MOST_POINTS`` points, the minimum and the maximum of each short interval.

    Args:
        x: Ascending abscissae, shape (n,).
        y: Ordinates, shape (n,); a line with missing values is not reduced.

    Returns:
        Abscissae and ordinates of at most ``MOST_POINTS`` points, each of shape (m,); short lines are returned
        unchanged.
    """
    if len(x) <= MOST_POINTS or not np.isfinite(y).all():
        return x, y
    edges = np.linspace(0, len(x), MOST_POINTS // 2 - 1).astype(int)
    low = [first + int(np.argmin(y[first:last])) for first, last in pairwise(edges)]
    high = [first + int(np.argmax(y[first:last])) for first, last in pairwise(edges)]
    extremes = np.unique([0, *low, *high, len(x) - 1])
    return x[extremes], y[extremes]
