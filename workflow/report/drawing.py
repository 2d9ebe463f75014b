"""Pictures by matplotlib, for pages and files that are no report of a run."""

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as pyplot
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

STYLE = {
    "font.size": 9,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "font.family": "sans-serif",
    "text.usetex": False,
    "text.parse_math": False,  # a dollar sign in a title or a name is no formula
}


def plain_ticks(axis) -> None:
    """Write plain numbers at a logarithmic axis, 1, 2 and 5 of each decade: formulas are not set (``STYLE``)."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
