"""Maps of the array: what the reflow made of every joint, at its place."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps, pyplot
from matplotlib.axes import Axes

from reflowshock.workflow.report.curves import MICRO, MILLI, STYLE, svg

MAPS = (
    ("standoff", "standoff [µm]", MICRO),
    ("max_width", "maximum width [µm]", MICRO),
    ("contact_angle_package", "contact angle at the package [deg]", 1.0),
    ("tilted", "tilt of the package's pad [mrad]", MILLI),
    ("contact_angle_board", "contact angle at the board [deg]", 1.0),
)
PANELS = 4
MAP_POINTS = 215.0  # width of a map on the page, in points
MARK_SHARE = 0.82  # of the pitch that a mark takes
SMALLEST_TEXT = 3.5  # points; below it a map has colours only
NOT_OK = "#b3261e"


def array_map(joints: Sequence[Mapping[str, Any]]) -> str:
    """Draw standoff, width, contact angle and tilt or second contact angle of every joint at its place in the array.

    Args:
        joints: records with name, x, y, standoff, max_width [m] and verdict, and what else of ``MAPS`` the joints have.

    Returns:
        An SVG element; joints whose verdict is not ok have a red rim.
    """
    shown = [entry for entry in MAPS if any(entry[0] in joint for joint in joints)][:PANELS]
    rows = -(-len(shown) // 2)
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(rows, 2, figsize=(9.2, 3.9 * rows), constrained_layout=True, squeeze=False)
        for axis, entry in zip(axes.flat, shown, strict=False):
            _draw_map(axis, joints, entry)
        for axis in axes.flat[len(shown) :]:
            axis.set_visible(False)
        return svg(figure)


def pitch_of(joints: Sequence[Mapping[str, Any]]) -> float:
    """Return the smallest distance of two joints along x or y [m]; 1 mm for a single one."""
    steps = [np.diff(np.unique(np.round([joint[axis] for joint in joints], 9))) for axis in ("x", "y")]
    return float(min(np.concatenate(steps), default=MILLI))


def _draw_map(axis: Axes, joints: Sequence[Mapping[str, Any]], entry: tuple[str, str, float]) -> None:
    key, label, unit = entry
    values = np.array([joint.get(key, 0.0) for joint in joints]) / unit
    x, y = (np.array([joint[name] for joint in joints]) / MILLI for name in "xy")
    count = 1 + max(np.ptp(x), np.ptp(y)) * MILLI / pitch_of(joints)
    width = MAP_POINTS / (count + 0.3)  # points between two joints
    rims = ["white" if joint.get("verdict", "ok") in ("ok", "given") else NOT_OK for joint in joints]
    marks = axis.scatter(x, y, c=values, s=(MARK_SHARE * width) ** 2, cmap="viridis", edgecolors=rims, linewidths=1.2)
    size = min(8.5, 0.19 * width)
    if size >= SMALLEST_TEXT:
        _write_names(axis, joints, (x, y, values), size)
    margin = 0.65 * pitch_of(joints) / MILLI
    axis.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", axisbelow=True)
    axis.set(xlim=(x.min() - margin, x.max() + margin), ylim=(y.min() - margin, y.max() + margin))
    axis.figure.colorbar(marks, ax=axis, label=label)


def _write_names(axis: Axes, joints: Sequence[Mapping[str, Any]], places: tuple, size: float) -> None:
    values = places[2]
    span = float(np.ptp(values)) or 1.0
    digits = 0 if np.abs(values).max() >= 100.0 else 1 if np.abs(values).max() >= 10.0 else 2
    for joint, x, y, value in zip(joints, *places, strict=True):
        light = np.dot(colormaps["viridis"]((value - values.min()) / span)[:3], (0.3, 0.6, 0.1)) > 0.5
        text = f"{joint['name']}\n{value:.{digits}f}"
        axis.annotate(text, (x, y), ha="center", va="center", fontsize=size, color="black" if light else "white")
