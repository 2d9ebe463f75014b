"""Curves of the report, as inline SVG."""

import io

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from reflowshock.workflow.process.terminal import visible
from reflowshock.workflow.report.histories import joint_stress

MODE_STYLE = {
    "two_scale": {"color": "#0b5fa5", "linestyle": "-", "linewidth": 1.6, "label": "two-scale"},
    "dns": {"color": "#d1495b", "linestyle": "--", "linewidth": 1.3, "label": "DNS"},
}
STYLE = {
    "font.size": 9,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "text.usetex": False,
    "text.parse_math": False,  # a dollar sign in a title or a name is no formula
}
MILLI, MICRO = 1.0e-3, 1.0e-6
ENERGIES = {
    "external": "#333333", "kinetic": "#0b5fa5", "internal": "#e09f3e", "plastic": "#d1495b", "hourglass": "#7a5ea8",
    "damping": "#2a7d4f",
}  # fmt: skip


def history_curves(histories: dict[str, dict], critical_joint: str) -> str:
    """Draw pulse, board and die displacement, board strain and the critical joint's stress of every mode.

    Args:
        histories: mode -> arrays of ``history.npz``.
        critical_joint: name of the joint whose stress is drawn.

    Returns:
        An SVG element.
    """
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(2, 2, figsize=(9.2, 5.6), sharex=True, constrained_layout=True)
        for mode, history in histories.items():
            _draw_histories(axes, mode, history, critical_joint)
        any_history = next(iter(histories.values()))
        pulse = axes[0, 0].twinx()
        pulse.fill_between(
            any_history["time"] / MILLI, any_history["base_acceleration"] / 9.80665, color="#888888", alpha=0.18, lw=0
        )
        pulse.set_ylabel("input acceleration [G]", color="#777777")
        pulse.grid(False)
        pulse.spines["right"].set_visible(True)
        axes[0, 0].legend(frameon=False)
        for axis in axes[1]:
            axis.set_xlabel("time [ms]")
        return svg(figure)


def difference_curves(histories: dict[str, dict], critical_joint: str) -> str:
    """Draw by how much two scales differ from the DNS: die displacement and the critical joint's stress.

    Returns:
        An SVG element; empty unless both were run.
    """
    if len(histories) < 2:
        return ""
    ours, reference = histories["two_scale"], histories["dns"]
    count = min(len(ours["time"]), len(reference["time"]))  # a DNS may end early
    time = ours["time"][:count] / MILLI
    stresses = [joint_stress(history, critical_joint)[:count] / 1.0e6 for history in (ours, reference)]
    with pyplot.rc_context(STYLE):
        figure, (left, right) = pyplot.subplots(1, 2, figsize=(9.2, 2.6), constrained_layout=True)
        left.plot(time, (ours["die_centre"][:count] - reference["die_centre"][:count])[:, 2] / MICRO, color="#0b5fa5")
        left.set(xlabel="time [ms]", ylabel="die centre, difference [µm]")
        right.plot(time, stresses[0] - stresses[1], color="#0b5fa5")
        right.set(xlabel="time [ms]", ylabel=f"von Mises of {critical_joint},\ndifference [MPa]")
        return svg(figure)


def energy_curves(history: dict) -> str:
    """Draw the energy balance of one run: its terms, and the balance relative to the largest energy."""
    time = history["time"] / MILLI
    with pyplot.rc_context(STYLE):
        figure, (left, right) = pyplot.subplots(1, 2, figsize=(9.2, 3.1), constrained_layout=True)
        for name, color in ENERGIES.items():
            if name in history and np.any(history[name]):
                left.plot(time, history[name] / MILLI, label=name, color=color)
        left.set(xlabel="time [ms]", ylabel="energy [mJ]")
        left.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
        largest = max(float(np.max(np.abs(history[name]))) for name in ("external", "kinetic", "internal"))
        right.plot(time, 100.0 * history["balance"] / largest, color="#d1495b", label="balance")
        right.plot(time, 100.0 * history["interface"] / largest, color="#5f6c7b", label="interface")
        right.set(xlabel="time [ms]", ylabel="share of the largest energy [%]")
        right.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        return svg(figure)


def timing_bars(timings: dict[str, float]) -> str:
    """Draw the wall time of every stage."""
    names = list(timings)
    with pyplot.rc_context(STYLE):
        figure, axis = pyplot.subplots(figsize=(9.2, 0.35 * len(names) + 0.8), constrained_layout=True)
        bars = axis.barh(names, [timings[name] for name in names], color="#0b5fa5")
        axis.bar_label(bars, fmt="%.1f s", padding=3)
        axis.invert_yaxis()
        axis.set_xlabel("wall time [s]")
        axis.grid(axis="y", visible=False)
        return svg(figure)


def _draw_histories(axes, mode: str, history: dict, critical_joint: str) -> None:
    time, style = history["time"] / MILLI, MODE_STYLE[mode]
    axes[0, 0].plot(time, history["board_centre"][:, 2] / MILLI, **style)
    axes[0, 0].set_ylabel("board centre, relative to table [mm]")
    axes[0, 1].plot(time, history["die_centre"][:, 2] / MILLI, **style)
    axes[0, 1].set_ylabel("die centre, relative to table [mm]")
    axes[1, 0].plot(time, 1.0e3 * history["board_strain"], **style)
    axes[1, 0].set_ylabel("largest board strain under the package [1e-3]")
    axes[1, 1].plot(time, joint_stress(history, critical_joint) / 1.0e6, **style)
    axes[1, 1].set_ylabel(f"von Mises of the layers of {critical_joint} [MPa]")


def plain_ticks(axis) -> None:
    """Write plain numbers at a logarithmic axis, 1, 2 and 5 of each decade: formulas are not set (``STYLE``)."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def stacked(count: int, height: float):
    """Return a figure with ``count`` axes below each other, each ``height`` [in] high, and these axes."""
    size = (9.2, height * count)
    figure, axes = pyplot.subplots(count, 1, figsize=size, squeeze=False, sharex=True, constrained_layout=True)
    return figure, axes[:, 0]


def svg(figure) -> str:
    """Return a figure as an SVG element, and close it."""
    stream = io.StringIO()
    figure.savefig(stream, format="svg")
    pyplot.close(figure)
    text = stream.getvalue()
    return visible(text[text.index("<svg") :])
