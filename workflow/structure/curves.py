"""Curves of a structure's report: histories of watch points, reactions, energies; one line a solver."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from numpy.typing import NDArray

from reflowshock.workflow.report.curves import ENERGIES, MILLI, STYLE, svg

SOLVER_STYLE: dict[str, dict[str, Any]] = {
    "explicit": {"color": "#0b5fa5", "linestyle": "-", "linewidth": 1.6, "label": "explicit"},
    "implicit": {"color": "#d1495b", "linestyle": "--", "linewidth": 1.3, "label": "implicit"},
    "dns": {"color": "#2a7d4f", "linestyle": ":", "linewidth": 1.6, "label": "DNS"},
}
COMPONENTS = {3: ("x", "y", "z"), 6: ("xx", "yy", "zz", "xy", "yz", "xz")}
UNITS = {"displacement": "m", "velocity": "m/s", "strain": "m/m", "stress": "Pa", "reaction": "N"}
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))

Histories = Mapping[str, Mapping[str, NDArray]]


def point_curves(histories: Histories, point: str) -> str:
    """Draw displacement, velocity, strain and stress of a watch point, of each its largest component."""
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(2, 2, figsize=(9.2, 5.2), sharex=True, constrained_layout=True)
        for axis, quantity in zip(axes.ravel(), ("displacement", "velocity", "strain", "stress"), strict=True):
            _draw(axis, histories, quantity, point)
        axes[0, 0].legend(frameon=False)
        for axis in axes[1]:
            axis.set_xlabel("time [ms]")
        return svg(figure)


def reaction_curves(histories: Histories, supports: list[str]) -> str:
    """Draw the largest component of the reaction of every support."""
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(
            1, len(supports), figsize=(min(9.2, 4.6 * len(supports)), 2.8), squeeze=False, constrained_layout=True
        )
        for axis, support in zip(axes[0], supports, strict=True):
            _draw(axis, histories, "reaction", support)
            axis.set(xlabel="time [ms]", title=support)
        axes[0, 0].legend(frameon=False)
        return svg(figure)


def energy_curves(histories: Histories) -> str:
    """Draw all terms of each solver's ledger that are not zero, and its balance relative to the largest energy."""
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(
            len(histories), 2, figsize=(9.2, 3.0 * len(histories)), squeeze=False, constrained_layout=True
        )
        for (left, right), (solver, history) in zip(axes, histories.items(), strict=True):
            time, largest = history["time"] / MILLI, _largest(history)
            factor, prefix = _prefix(largest)
            for name, colour in ENERGIES.items():
                if np.abs(history[name]).max() > 1e-6 * largest:
                    left.plot(time, history[name] / factor, label=name, color=colour)
            left.set_ylabel(f"{solver}: energy [{prefix}J]")
            left.legend(frameon=False, fontsize=7, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
            right.plot(time, 100.0 * history["balance"] / (largest or 1.0), color="#d1495b")
            right.set_ylabel(f"{solver}: balance [%]")
        for axis in axes[-1]:
            axis.set_xlabel("time [ms]")
        return svg(figure)


def _draw(axis: Axes, histories: Histories, quantity: str, place: str) -> None:
    """Draw one component of a vector or tensor: the one that is largest in the first history."""
    name = f"{quantity}@{place}"
    first = next(iter(histories.values()))[name]
    component = int(np.argmax(np.abs(first).max(axis=0)))
    factor, prefix = _prefix(float(np.abs(first[:, component]).max()))
    for solver, history in histories.items():
        axis.plot(history["time"] / MILLI, history[name][:, component] / factor, **SOLVER_STYLE[solver])
    axis.set_ylabel(f"{quantity} {COMPONENTS[first.shape[1]][component]} [{prefix}{UNITS[quantity]}]")


def _prefix(largest: float) -> tuple[float, str]:
    """Return the power of a thousand, and its prefix, with which a value reads between 1 and 1000."""
    return next(((factor, prefix) for factor, prefix in PREFIXES if largest >= factor), (1.0, ""))


def _largest(history: Mapping[str, NDArray]) -> float:
    return max(float(np.abs(history[name]).max()) for name in ENERGIES)
