"""Von Mises stress of all joints where they meet the package, two-scale beside DNS, at given times."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.typing import NDArray

from reflowshock.workflow.case.text import mega, percent
from reflowshock.workflow.report.curves import MILLI, STYLE, svg
from reflowshock.workflow.report.tables import mode_name

Arrays = Mapping[str, NDArray]

MEGA = 1e6
ROWS_DRAWN = 3  # times that are drawn; the table has all of them
PANEL = 4.4  # inches
SAME_TIME = 1e-6  # s: modes write a time at the end of their own window that is next to it


def read_interfaces(shock: Path, modes: Sequence[str]) -> dict[str, dict[str, NDArray]]:
    """Read ``interface.npz`` of the modes that have it."""
    found = {}
    for mode in modes:
        path = shock / mode / "interface.npz"
        if path.exists():
            with np.load(path) as arrays:
                found[mode] = dict(arrays)
    return found


def joints_of(interface: Arrays) -> list[str]:
    """Return the joints that an interface has, in its order."""
    return [name.split("@")[1] for name in interface if name.startswith("von_mises@")]


def areas(interface: Arrays, joint: str) -> NDArray[np.float64]:
    """Return the areas ``(q,)`` [m^2] of the faces of a joint, from their diagonals."""
    corners = interface[f"points@{joint}"][interface[f"quads@{joint}"]]
    diagonals = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    return 0.5 * np.linalg.norm(np.cross(*diagonals), axis=1)


def times_of(interfaces: Mapping[str, Arrays]) -> NDArray[np.float64]:
    """Return all times [s] that a mode has; one that ends early has fewer."""
    return max((interface["times"] for interface in interfaces.values()), key=len)


def row_at(interface: Arrays, time: float) -> int | None:
    """Return the row of the time next to ``time`` [s]; None where a mode that ends early has none."""
    away = np.abs(interface["times"] - time)
    return int(away.argmin()) if away.min(initial=np.inf) <= SAME_TIME else None


def difference(ours: Arrays, reference: Arrays, joints: Sequence[str], time: float) -> float | None:
    """Return the relative L2 difference of two stress fields over the faces of joints; None unless both have it."""
    row, row_of_reference = row_at(ours, time), row_at(reference, time)
    if row is None or row_of_reference is None:
        return None
    squares = np.zeros(2)
    for joint in joints:
        exact = reference[f"von_mises@{joint}"][row_of_reference]
        weight = areas(reference, joint)
        squares += weight @ (ours[f"von_mises@{joint}"][row] - exact) ** 2, weight @ exact**2
    return float(np.sqrt(squares[0] / squares[1])) if squares[1] > 0.0 else float(np.sqrt(squares[0]))


def comparable(interfaces: Mapping[str, Arrays]) -> list[str]:
    """Return the joints that both modes have with the same faces; none where only one mode was run."""
    if len(interfaces) < 2:
        return []
    first, second = interfaces.values()
    keys = {joint: f"von_mises@{joint}" for joint in joints_of(first)}
    return [name for name, key in keys.items() if key in second and first[key].shape[1] == second[key].shape[1]]


def table(interfaces: Mapping[str, Arrays]) -> dict:
    """Largest and mean stress of both modes at each time, the joint that has the largest, and how far they differ."""
    shared = comparable(interfaces)
    rows = []
    for time in times_of(interfaces):
        here = [(interface, row_at(interface, time)) for interface in interfaces.values()]
        extremes = [_extremes(one, row) if row is not None else 3 * ("–",) for one, row in here]
        cells = [cell for cells_of_mode in extremes for cell in cells_of_mode]
        if shared:
            first, second = interfaces.values()
            differs = difference(first, second, shared, time)
            cells.append("–" if differs is None else percent(differs))
        rows.append([f"{time / MILLI:.4g}", *cells])
    heads = [head for mode in interfaces for head in (f"{mode_name(mode)}: largest [MPa]", "in joint", "mean [MPa]")]
    last = [f"relative L2 difference of {len(shared)} joints"] if shared else []
    return {"head": ["time [ms]", *heads, *last], "rows": rows}


def interface_maps(interfaces: Mapping[str, Arrays]) -> str:
    """Draw the faces of all joints seen from above, a row a time, a column a mode, one colour scale per time."""
    times = times_of(interfaces)[:ROWS_DRAWN]
    with pyplot.rc_context(STYLE | {"axes.grid": False, "savefig.dpi": 200}):
        size = (PANEL * len(interfaces) + 0.8, (PANEL - 0.2) * len(times))
        figure, axes = pyplot.subplots(len(times), len(interfaces), figsize=size, layout="constrained", squeeze=False)
        for row, time in enumerate(times):
            found = {mode: row_at(interface, time) for mode, interface in interfaces.items()}
            here = {mode: own for mode, own in found.items() if own is not None}
            top = max(_largest(interfaces[mode], own) for mode, own in here.items()) / MEGA
            for axis in axes[row][len(here) :]:
                axis.set_visible(False)
            for axis, (mode, own) in zip(axes[row], here.items(), strict=False):
                drawn = _draw_joints(axis, interfaces[mode], own, top)
                axis.set_title(f"{mode_name(mode)}, {time / MILLI:.4g} ms", fontsize=9)
            figure.colorbar(drawn, ax=axes[row][: len(here)].tolist(), label="von Mises [MPa]", shrink=0.85)
        return svg(figure)


def _largest(interface: Arrays, row: int) -> float:
    return max(float(interface[f"von_mises@{joint}"][row].max()) for joint in joints_of(interface))


def _extremes(interface: Arrays, row: int) -> tuple[str, str, str]:
    """Return the largest stress at a time, the joint that has it, and the mean over all faces."""
    joints = joints_of(interface)
    peaks = [float(interface[f"von_mises@{joint}"][row].max()) for joint in joints]
    worst = int(np.argmax(peaks))
    weights = [areas(interface, joint) for joint in joints]
    force = sum(
        float(weight @ interface[f"von_mises@{joint}"][row]) for joint, weight in zip(joints, weights, strict=True)
    )
    return mega(peaks[worst]), joints[worst], mega(force / sum(float(weight.sum()) for weight in weights))


def _draw_joints(axis: Axes, interface: Arrays, row: int, top: float) -> PolyCollection:
    """Draw the faces of all joints at a time, on a scale that ends at ``top`` [MPa]."""
    joints = joints_of(interface)
    places = [interface[f"points@{joint}"][interface[f"quads@{joint}"]][:, :, :2] / MILLI for joint in joints]
    values = np.concatenate([interface[f"von_mises@{joint}"][row] for joint in joints]) / MEGA
    faces = PolyCollection(np.concatenate(places), array=values, cmap="turbo", linewidths=0.0, rasterized=True)
    faces.set_clim(0.0, top)
    axis.add_collection(faces)
    for joint, corners in zip(joints, places, strict=True):
        x, low, high = corners[..., 0].mean(), corners[..., 1].min(), corners[..., 1].max()
        axis.annotate(joint, (x, low - 0.08 * (high - low)), ha="center", va="top", fontsize=6, color="#5f6c7b")
    axis.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
    axis.margins(x=0.06, y=0.1)
    axis.autoscale_view()
    return faces
