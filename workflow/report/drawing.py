"""Matplotlib figures of pages other than run reports."""

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
    "text.parse_math": False,  # a dollar sign in a name does not start a formula
}


def plain_ticks(axis) -> None:
    """Label a logarithmic axis with plain numbers at 1, 2 and 5 of each decade.

    Args:
        axis: Axis of Matplotlib, such as ``axes.xaxis``, changed in place.
    """
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
