"""Report of one drop or joint: pictures, profile against the exact meridian, histories, metrics with their errors."""

import json
from pathlib import Path

import numpy as np
import pyvista
from matplotlib import pyplot

from workflow.case_text import CASES
from workflow.report_curves import MICRO, MILLI, STYLE, svg
from workflow.report_pictures import new_plotter, save
from workflow.report_tables import number, percent, quantity

WORK_PRECISION = CASES / "sessile_drop" / "work_precision.json"
SMALLEST_RANGE = 0.01
HEADLINE = ("height", "max_width", "waist", "contact_angle", "max_width_error", "verdict", "particles", "seconds")


def headline(metrics: dict) -> list[dict]:
    """The figures at the top of the page."""
    return [
        {"label": name.replace("_", " "), "value": _text(name, metrics[name])} for name in HEADLINE if name in metrics
    ]


def metric_table(metrics: dict, health: dict) -> dict:
    """All metrics, those with a limit beside it."""
    rows = [
        [name.replace("_", " "), _text(name, metric), percent(health[name]["limit"]) if name in health else ""]
        for name, metric in metrics.items()
    ]
    return {"head": ["metric", "value", "limit"], "rows": rows}


def work_precision_table() -> dict | None:
    """The stored work-precision ladder of the sessile drop."""
    if not WORK_PRECISION.exists():
        return None
    rows = [
        [
            f"{row['contact_angle']:g} deg, {row['per_edge']} per edge, {row['basis']}, {row['time_step_limit']:g} x",
            percent(row["height_error"]) if "height_error" in row else "no rest",
            percent(row["max_width_error"]) if "max_width_error" in row else "",
            number(row.get("steps", "")),
            number(row.get("seconds", "")),
        ]
        for row in json.loads(WORK_PRECISION.read_text())["rows"]
    ]
    head = [
        "drop, resolution, basis, time step over capillary limit",
        "height error",
        "width error",
        "steps",
        "seconds",
    ]
    return {"head": head, "rows": rows}


def profile_curve(points: np.ndarray, meridian: np.ndarray | None) -> str:
    """Draw radius against height of the surface particles `(s, 3)` [m] over the exact meridian `(2, k)` [m]."""
    with pyplot.rc_context(STYLE):
        figure, axis = pyplot.subplots(figsize=(6.2, 3.6), constrained_layout=True)
        radius = np.hypot(points[:, 0], points[:, 1])
        axis.plot(radius / MILLI, points[:, 2] / MILLI, ".", ms=3, color="#0b5fa5", label="surface particles")
        if meridian is not None:
            axis.plot(*(meridian / MILLI), color="#d1495b", lw=1.2, label="Young-Laplace")
        axis.set(xlabel="radius [mm]", ylabel="height [mm]", aspect="equal")
        axis.legend(frameon=False)
        return svg(figure)


def history_curve(history: dict) -> str:
    """Draw height and width, energy, capillary number and time step against the steps."""
    step = history["step"]
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(2, 2, figsize=(9.2, 5.2), sharex=True, constrained_layout=True)
        axes[0, 0].plot(step, history["height"] / MILLI, label="height")
        axes[0, 0].plot(step, history["width"] / MILLI, label="width")
        axes[0, 0].set_ylabel("[mm]")
        axes[0, 0].legend(frameon=False)
        axes[0, 1].plot(step, history["energy"] / MICRO)
        axes[0, 1].set_ylabel("energy [µJ]")
        axes[1, 0].semilogy(step, history["capillary_number"])
        axes[1, 0].set_ylabel("capillary number")
        axes[1, 1].semilogy(step, history["time_step"] / MICRO)
        axes[1, 1].set_ylabel("time step [µs]")
        for axis in axes[1]:
            axis.set_xlabel("step")
        return svg(figure)


def render_body(shape, picture: Path) -> None:
    """Render particles and free surface before and after the reflow; after it coloured by pressure."""
    plotter = new_plotter((1800, 800))
    after = shape.points / MILLI
    first = shape.snapshots[0]
    before = first.points / MILLI
    gap = 0.6 * np.ptp(before[:, 0]) + 0.6 * np.ptp(after[:, 0])
    before = before - np.array([gap, 0.0, 0.0])
    for points, triangles in ((before, first.triangles), (after, shape.triangles)):
        faces = np.column_stack((np.full(len(triangles), 3), triangles))
        surface = pyvista.PolyData(points, faces.ravel())
        plotter.add_mesh(surface, color="#b9c4cf", opacity=0.35, show_edges=True, edge_color="#5f6c7b", line_width=0.6)
    size = {"point_size": 9, "render_points_as_spheres": True}
    plotter.add_mesh(pyvista.PolyData(before), color="#8a949e", **size)
    cloud = pyvista.PolyData(after)
    cloud["pressure [Pa]"] = shape.pressure
    bar = {"vertical": True, "position_x": 0.9, "position_y": 0.25, "height": 0.5, "color": "black", "n_labels": 3}
    limits, bar = _colour_limits(shape.pressure), bar | {"fmt": "%.4g"}
    plotter.add_mesh(cloud, scalars="pressure [Pa]", cmap="viridis", clim=limits, scalar_bar_args=bar, **size)
    plotter.camera_position = [(-0.5 * gap, -10.0, 4.0), (-0.5 * gap, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.enable_parallel_projection()
    plotter.reset_camera()
    plotter.camera.zoom(1.2)
    save(plotter, picture)


def _colour_limits(pressure: np.ndarray) -> tuple[float, float]:
    """Range of the colours: that of the values, at least one per cent about the mean, so that equal ones look equal."""
    mean = float(pressure.mean())
    low, high = float(pressure.min()), float(pressure.max())
    return min(low, mean - SMALLEST_RANGE * abs(mean)), max(high, mean + SMALLEST_RANGE * abs(mean))


def _text(name: str, metric: dict) -> str:
    if metric["unit"] == "" and name.endswith(("_error", "_drift", "_scatter")):
        return percent(metric["value"])
    return f"{number(metric['value'])} Pa" if metric["unit"] == "Pa" else quantity(metric)
