"""Report of solder alone: shape, profile or oscillation with the exact one, histories, metrics with limits."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.workflow.case.text import number, percent, quantity
from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.colours import BLUE, ORANGE, RED
from reflowshock.workflow.report.curves import MICRO, MILLI, TIME
from reflowshock.workflow.report.particles import particle_scene
from reflowshock.workflow.report.tables import figures_of, limited_metrics
from reflowshock.workflow.solder.case import OscillationCase, SolderCase

if TYPE_CHECKING:
    from reflowshock.particles.steps.shape import JointShape

DEGREE = np.pi / 180.0
HEADLINE = (
    "height", "max_width", "waist", "contact_angle", "max_width_error", "axial_force", "offset",
    "collapse_height_error", "standoff_at_break", "time_at_break", "drops_left", "radius_error",
    "period", "period_error", "decay_rate", "decay_rate_error", "verdict", "at_rest", "particles", "seconds",
)  # fmt: skip


def add_solder(run_folder: Path, case: SolderCase, context: dict, summary: dict) -> None:
    """Add the section of a body of solder at rest to the context of the report: headline, metrics, charts, scene.

    Args:
        run_folder: Run folder with the products.
        case: Case of the run.
        context: Context of the page's template, changed in place: ``headline``, ``tables``, ``curves``, ``scenes``.
        summary: Content of ``summary.json``.
    """
    shape, meridian = _add_body(run_folder, context, summary)
    if shape.verdict != "apart":
        axis = 0.0 if case.is_centred else vertical_axis(shape.surface_points)
        context["curves"]["profile"] = profile_curve(shape.surface_points - axis, meridian, case.is_plane)
    moves = summary["effects"].get("inertia", {}).get("on", False)
    context["curves"]["body_history"] = history_curve(shape.history, moves)
    path = run_folder / "reflow" / "path.json"
    if path.exists() and "pull" not in shape.history:
        context["curves"]["path"] = path_curve(json.loads(path.read_text(encoding="utf-8")))


def add_oscillation(run_folder: Path, _case: OscillationCase, context: dict, summary: dict) -> None:
    """Add the section of an oscillating drop to the context of the report: headline, table of metrics, charts, scene.

    Args:
        run_folder: Run folder with the products.
        _case: Not used; all functions that add sections take the case.
        context: Context of the page's template, changed in place: ``headline``, ``tables``, ``curves``, ``scenes``.
        summary: Content of ``summary.json``.
    """
    shape, _ = _add_body(run_folder, context, summary)
    context["curves"]["swing"] = oscillation_curve(shape.history, summary["metrics"])


def _add_body(run_folder: Path, context: dict, summary: dict) -> "tuple[JointShape, np.ndarray | None]":
    """Add headline, metrics and particles; return the shape and the exact meridian, shape (2, k) [m]."""
    from reflowshock.particles.scenes.products import read_body

    shape, meridian = read_body(run_folder / "reflow")
    context["headline"] = figures_of(HEADLINE, summary["metrics"], _text)
    context["tables"]["body"] = limited_metrics(summary["metrics"], summary["health"], _text)
    context["scenes"]["body"] = particle_scene(shape)
    return shape, meridian


def vertical_axis(points: np.ndarray) -> np.ndarray:
    """Return the horizontal centre of a body's bounding box, shape (3,) [m], with z = 0.

    Args:
        points: Points of the body, shape (n, 3) [m].
    """
    return 0.5 * (points.min(axis=0) + points.max(axis=0)) * np.array([1.0, 1.0, 0.0])


def profile_curve(points: np.ndarray, meridian: np.ndarray | None, is_plane: bool = False) -> list[Chart]:
    """Return the chart of radius over height with the exact meridian.

    Args:
        points: Surface particles around the z axis, shape (s, 3) [m].
        meridian: Radius and height of the exact meridian, shape (2, k) [m]; None if it is unknown.
        is_plane: Whether the body is the same along y; the radius is then the distance from the plane x = 0.

    Returns:
        Interactive charts for the report page.
    """
    order, sideways = np.argsort(points[:, 2]), 0.0 if is_plane else 1.0
    radius, height = np.hypot(points[:, 0], sideways * points[:, 1])[order] / MILLI, points[order, 2] / MILLI
    lines = [Series("surface particles", height, radius, line="none", marks=True)]
    if meridian is not None:
        upwards = np.argsort(meridian[1], kind="stable")
        lines.append(Series("Young-Laplace", meridian[1][upwards] / MILLI, meridian[0][upwards] / MILLI, RED))
    label = "distance from the centre [mm]" if is_plane else "radius [mm]"
    return [Chart(Axis("height [mm]"), Axis(label), lines, is_upright=True)]


def history_curve(history: Mapping[str, np.ndarray], moves: bool) -> list[Chart]:
    """Return charts of size, energy, capillary number and time step, and of the force of a pull.

    Args:
        history: Arrays of shape (k,) by name: ``time`` [s], ``step``, ``height``, ``width`` [m], ``energy`` [J],
            ``capillary_number``, ``time_step`` [s] and, for a pull, ``pull`` [N].
        moves: Whether the liquid has inertia. Without it, the charts are over steps, since times have no meaning.

    Returns:
        Interactive charts for the report page.
    """
    axis, x = (TIME, history["time"] / MILLI) if moves else (Axis("step"), history["step"])
    sizes = [
        Series(name, x, history[name] / MILLI, colour)
        for name, colour in (("height", BLUE), ("width", ORANGE))
        if name in history
    ]
    energy = [Series("energy", x, history["energy"] / MICRO)]
    capillary = [Series("capillary number", x, history["capillary_number"])]
    charts = [
        Chart(axis, Axis("size [mm]"), sizes),
        Chart(axis, Axis("energy of surface, wetting and weight [µJ]"), energy),
        Chart(axis, Axis("capillary number", log=True), capillary),
        Chart(axis, Axis("time step [µs]", log=True), [Series("time step", x, history["time_step"] / MICRO)]),
    ]
    if "pull" in history:
        charts.insert(0, pull_chart(history))
    return charts


def pull_chart(history: Mapping[str, np.ndarray]) -> Chart:
    """Return the chart of pulling and equilibrium force, over the standoff, or over time if it is fixed.

    Args:
        history: Arrays of shape (k,) by name: ``time`` [s], ``standoff`` [m], ``pull`` and ``pull_exact`` [N]; nan
            where no equilibrium is known.
    """
    standoff, (axis, x) = history["standoff"], (TIME, history["time"] / MILLI)
    if np.ptp(standoff) > 1e-6 * standoff.max():
        axis, x = Axis("standoff [mm]"), standoff / MILLI
    order = np.argsort(x, kind="stable")  # the standoff may decrease
    forces = [Series("particles", x[order], history["pull"][order] / MILLI)]
    if not np.isnan(exact := history["pull_exact"]).all():
        forces.append(Series("Young-Laplace", x[order], exact[order] / MILLI, RED))
    return Chart(axis, Axis("pulling force on the package [mN]"), forces)


def path_curve(positions: Sequence[Mapping]) -> list[Chart]:
    """Return charts of force and widths of a joint along the path of the package.

    Args:
        positions: Records of the joint at each position of the package: ``standoff``, ``offset`` [m], ``tilt`` [rad],
            ``axial_force``, ``axial_force_exact`` [N], ``waist``, ``max_width`` [m]; None where unknown. The x axis is
            the first of standoff, offset and tilt that varies.

    Returns:
        Interactive charts for the report page.
    """
    axis_of = {"standoff": ("standoff [mm]", MILLI), "offset": ("offset [mm]", MILLI), "tilt": ("tilt [deg]", DEGREE)}
    name = next((name for name in axis_of if positions[0][name] != positions[-1][name]), "standoff")
    axis_label, scale = axis_of[name]
    ordered = sorted(positions, key=lambda position: position[name])
    x = [position[name] / scale for position in ordered]

    def values(key: str) -> list[float]:
        return [np.nan if position[key] is None else position[key] / MILLI for position in ordered]

    force = [Series("particles", x, values("axial_force"), line="none", marks=True)]
    if not np.isnan(exact := values("axial_force_exact")).all():
        force.append(Series("Young-Laplace", x, exact, RED, marks=True))
    widths = [
        Series(label, x, values(key), colour, marks=True)
        for key, label, colour in (("waist", "waist", BLUE), ("max_width", "width", ORANGE))
    ]
    return [
        Chart(Axis(axis_label), Axis("upward force on the package [mN]"), force),
        Chart(Axis(axis_label), Axis("size [mm]"), widths),
    ]


def oscillation_curve(history: Mapping[str, np.ndarray], metrics: Mapping[str, dict]) -> list[Chart]:
    """Return charts of the second mode's amplitude, with Reid's solution for small amplitude, and of the energies.

    Args:
        history: Arrays of shape (k,) by name: ``time`` [s], ``amplitude`` over the radius, energies [J].
        metrics: Name -> record with ``value`` (SI) and ``unit``: period and decay rate with their errors.

    Returns:
        Interactive charts for the report page.
    """
    time, value = history["time"], {name: metric["value"] for name, metric in metrics.items()}
    period = value["period"] / (1.0 + value["period_error"])
    decay = value["decay_rate"] / (1.0 + value["decay_rate_error"])
    amplitude = history["amplitude"]
    first = amplitude[time <= period]
    scale = 0.5 * (first.max() - first.min()) * np.exp(0.5 * decay * period)
    exact = scale * np.exp(-decay * time) * np.sin(2.0 * np.pi * time / period)
    swing = [
        Series("particles", time / MILLI, amplitude),
        Series("Reid", time / MILLI, exact, RED, line="dashed"),
    ]
    total, kinetic = history["energy"], history["kinetic_energy"]
    rest = total[0] - kinetic[0]
    energies = [
        Series("kinetic + surface", time / MILLI, (total - rest) / kinetic[0]),
        Series("kinetic", time / MILLI, kinetic / kinetic[0], ORANGE),
    ]
    return [
        Chart(TIME, Axis("amplitude of the second mode / R"), swing),
        Chart(TIME, Axis("energy above rest / initial kinetic energy"), energies),
    ]


def _text(name: str, metric: dict) -> str:
    if metric["unit"] == "" and name.endswith(("_error", "_drift", "_scatter")):
        return percent(metric["value"])
    if name == "at_rest":
        return "yes" if metric["value"] else "no"
    return f"{number(metric['value'])} Pa" if metric["unit"] == "Pa" else quantity(metric)
