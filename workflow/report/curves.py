"""Charts of a drop: histories, difference of the modes, energies."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.colours import BLACK, BLUE, GREEN, GREY, LIGHT, ORANGE, PURPLE, RED
from reflowshock.workflow.report.histories import joint_stress

MODE_STYLE: dict[str, dict[str, Any]] = {
    "two_scale": {"name": "two-scale", "colour": BLUE},
    "dns": {"name": "DNS", "colour": RED, "line": "dashed"},
}
MILLI, MICRO, MEGA = 1.0e-3, 1.0e-6, 1.0e6
GRAVITY = 9.80665
TIME = Axis("time [ms]")
ENERGIES = {
    "external": BLACK, "kinetic": BLUE, "internal": ORANGE, "plastic": RED, "hourglass": PURPLE, "damping": GREEN,
}  # fmt: skip

Histories = Mapping[str, Mapping[str, NDArray]]


def history_curves(histories: Histories, critical_joint: str) -> list[Chart]:
    """Return charts of pulse, board and die displacement, board strain and stress of the critical joint.

    Args:
        histories: Mode -> arrays of its ``history.npz``: ``time``, shape (k,) [s], and k rows of each quantity.
        critical_joint: Name of the joint whose stress is drawn.

    Returns:
        Interactive charts for the report page.
    """
    quantities = (
        ("board centre, relative to table [mm]", lambda history: history["board_centre"][:, 2] / MILLI),
        ("die centre, relative to table [mm]", lambda history: history["die_centre"][:, 2] / MILLI),
        ("largest board strain under the package [1e-3]", lambda history: 1e3 * history["board_strain"]),
        (
            f"von Mises stress, solder layer of {critical_joint} [MPa]",
            lambda history: joint_stress(history, critical_joint) / MEGA,
        ),
    )
    lines = [[Series(x=_time(history), y=of(history), **MODE_STYLE[mode]) for mode, history in histories.items()]
             for _, of in quantities]  # fmt: skip
    first = next(iter(histories.values()))
    acceleration = first["base_acceleration"] / GRAVITY
    lines[0].append(Series("input", _time(first), acceleration, LIGHT, fill=True, is_right=True))
    rights = ("input acceleration [G]", "", "", "")
    return [
        Chart(TIME, Axis(label), series, right=right)
        for (label, _), series, right in zip(quantities, lines, rights, strict=True)
    ]


def difference_curves(histories: Histories, critical_joint: str) -> list[Chart]:
    """Return charts of two-scale minus DNS (one model), die displacement and critical stress; empty unless both ran.

    Args:
        histories: Mode -> arrays of its ``history.npz``: ``time``, shape (k,) [s], and k rows of each quantity.
        critical_joint: Name of the joint whose stress is drawn.

    Returns:
        Interactive charts for the report page.
    """
    if len(histories) < 2:
        return []
    ours, reference = histories["two_scale"], histories["dns"]
    count = min(len(ours["time"]), len(reference["time"]))  # a DNS may end early
    time = _time(ours)[:count]
    displacement = (ours["die_centre"][:count] - reference["die_centre"][:count])[:, 2] / MICRO
    stresses = [joint_stress(history, critical_joint)[:count] / MEGA for history in (ours, reference)]
    return [
        Chart(TIME, Axis("die centre, difference [µm]"), [Series("two-scale minus DNS", time, displacement)]),
        Chart(
            TIME,
            Axis(f"von Mises of {critical_joint}, difference [MPa]"),
            [Series("two-scale minus DNS", time, stresses[0] - stresses[1])],
        ),
    ]


def energy_curves(history: Mapping[str, NDArray]) -> list[Chart]:
    """Return two charts of one run over time: its energies, and its energy balance relative to the largest energy.

    Args:
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], and energies such as ``kinetic`` and ``internal``,
            shape (k,) [J].

    Returns:
        Interactive charts for the report page.
    """
    time = _time(history)
    terms = [
        Series(name, time, history[name] / MILLI, colour)
        for name, colour in ENERGIES.items()
        if name in history and np.any(history[name])
    ]
    largest = max(float(np.max(np.abs(history[name]))) for name in ("external", "kinetic", "internal")) or 1.0
    shares = [
        Series(name, time, 100.0 * history[name] / largest, colour)
        for name, colour in (("balance", RED), ("interface", GREY))
    ]
    return [
        Chart(TIME, Axis("energy [mJ]"), terms),
        Chart(TIME, Axis("share of the largest energy [%]"), shares),
    ]


def _time(history: Mapping[str, NDArray]) -> NDArray:
    return history["time"] / MILLI
