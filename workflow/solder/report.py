"""Report of solder alone: pictures, profile or oscillation against the exact one, histories, metrics with errors."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.text import number, percent, quantity
from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.colours import BLUE, ORANGE, RED
from reflowshock.workflow.report.curves import MICRO, MILLI, TIME
from reflowshock.workflow.report.particles import particle_scene
from reflowshock.workflow.report.tables import figures_of, limited_metrics
from reflowshock.workflow.solder.case import DropCase

DEGREE = np.pi / 180.0
HEADLINE = (
    "height", "max_width", "waist", "contact_angle", "max_width_error", "axial_force", "offset",
    "collapse_height_error", "standoff_at_break", "time_at_break", "drops_left", "radius_error",
    "period", "period_error", "decay_rate", "decay_rate_error", "verdict", "at_rest", "particles", "seconds",
)  # fmt: skip


def add_solder(run_folder: Path, case: Case, context: dict, summary: dict) -> None:
    """Add the section on solder alone."""
    if not (run_folder / "reflow" / "shape.h5").exists():
        return
    from reflowshock.particles.scenes.products import read_body

    shape, meridian = read_body(run_folder / "reflow")
    context["headline"] = figures_of(HEADLINE, summary["metrics"], _text)
    context["tables"]["body"] = limited_metrics(summary["metrics"], summary["health"], _text)
    if case.kind == "oscillation":
        context["curves"]["swing"] = swing_curve(shape.history, summary["metrics"])
    else:
        if shape.verdict != "apart":
            axis = middle(shape.surface_points) if case.kind == "drops" else 0.0
            is_plane = isinstance(case, DropCase) and case.drop.section == "plane"
            context["curves"]["profile"] = profile_curve(shape.surface_points - axis, meridian, is_plane)
        moves = summary["effects"].get("inertia", {}).get("on", False)
        context["curves"]["body_history"] = history_curve(shape.history, moves)
    path = run_folder / "reflow" / "path.json"
    if path.exists() and "pull" not in shape.history:
        context["curves"]["path"] = path_curve(json.loads(path.read_text(encoding="utf-8")))
    context["scenes"]["body"] = particle_scene(shape)


def middle(points: np.ndarray) -> np.ndarray:
    """Place `(3,)` of the vertical axis through the middle of a drop that stands anywhere."""
    return 0.5 * (points.min(axis=0) + points.max(axis=0)) * np.array([1.0, 1.0, 0.0])


def profile_curve(points: np.ndarray, meridian: np.ndarray | None, is_plane: bool = False) -> list[Chart]:
    """Return radius against height of the surface particles `(s, 3)` [m], and the exact meridian `(2, k)` [m].

    Of a drop that is the same along y the distance from its middle.
    """
    order, sideways = np.argsort(points[:, 2]), 0.0 if is_plane else 1.0
    radius, height = np.hypot(points[:, 0], sideways * points[:, 1])[order] / MILLI, points[order, 2] / MILLI
    lines = [Series("surface particles", height, radius, line="none", marks=True)]
    if meridian is not None:
        upwards = np.argsort(meridian[1], kind="stable")
        lines.append(Series("Young-Laplace", meridian[1][upwards] / MILLI, meridian[0][upwards] / MILLI, RED))
    label = "distance from the middle [mm]" if is_plane else "radius [mm]"
    return [Chart(Axis("height [mm]"), Axis(label), lines, is_upright=True)]


def history_curve(history: Mapping[str, np.ndarray], moves: bool) -> list[Chart]:
    """Return height and width, potential energy, capillary number and time step; the force of a pull first.

    Over the time of a liquid that moves by its inertia; else over the steps, whose times mean nothing.
    """
    axis, at = (TIME, history["time"] / MILLI) if moves else (Axis("step"), history["step"])
    sizes = [
        Series(name, at, history[name] / MILLI, colour)
        for name, colour in (("height", BLUE), ("width", ORANGE))
        if name in history
    ]
    energy = [Series("energy", at, history["energy"] / MICRO)]
    capillary = [Series("capillary number", at, history["capillary_number"])]
    charts = [
        Chart(axis, Axis("size [mm]"), sizes),
        Chart(axis, Axis("energy of surface, wetting and weight [µJ]"), energy),
        Chart(axis, Axis("capillary number", log=True), capillary),
        Chart(axis, Axis("time step [µs]", log=True), [Series("time step", at, history["time_step"] / MICRO)]),
    ]
    if "pull" in history:
        charts.insert(0, pull_chart(history))
    return charts


def pull_chart(history: Mapping[str, np.ndarray]) -> Chart:
    """Return the force that moves the package, beside that of balance, over the standoff, or over time if it stays."""
    standoff, (axis, way) = history["standoff"], (TIME, history["time"] / MILLI)
    if np.ptp(standoff) > 1e-6 * standoff.max():
        axis, way = Axis("standoff [mm]"), standoff / MILLI
    order = np.argsort(way, kind="stable")  # downwards the standoff falls
    forces = [Series("particles", way[order], history["pull"][order] / MILLI)]
    if not np.isnan(exact := history["pull_exact"]).all():
        forces.append(Series("Young-Laplace", way[order], exact[order] / MILLI, RED))
    return Chart(axis, Axis("force that moves the package [mN]"), forces)


def path_curve(places: Sequence[Mapping]) -> list[Chart]:
    """Return force and waist of a joint in the places of a path, over what changes first: standoff, offset or tilt."""
    axis_of = {"standoff": ("standoff [mm]", MILLI), "offset": ("offset [mm]", MILLI), "tilt": ("tilt [deg]", DEGREE)}
    name = next((name for name in axis_of if places[0][name] != places[-1][name]), "standoff")
    label, scale = axis_of[name]
    ordered = sorted(places, key=lambda place: place[name])
    way = [place[name] / scale for place in ordered]

    def values(key: str) -> list[float]:
        return [np.nan if place[key] is None else place[key] / MILLI for place in ordered]

    force = [Series("particles", way, values("axial_force"), line="none", marks=True)]
    if not np.isnan(exact := values("axial_force_exact")).all():
        force.append(Series("Young-Laplace", way, exact, RED, marks=True))
    widths = [
        Series(shown, way, values(key), colour, marks=True)
        for key, shown, colour in (("waist", "waist", BLUE), ("max_width", "width", ORANGE))
    ]
    return [
        Chart(Axis(label), Axis("force on the package, upwards [mN]"), force),
        Chart(Axis(label), Axis("size [mm]"), widths),
    ]


def swing_curve(history: Mapping[str, np.ndarray], metrics: Mapping[str, dict]) -> list[Chart]:
    """Return the amplitude of the second mode beside that of Reid at small amplitude, and the energies."""
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
        Chart(TIME, Axis("energy above that at rest / at the start"), energies),
    ]


def _text(name: str, metric: dict) -> str:
    if metric["unit"] == "" and name.endswith(("_error", "_drift", "_scatter")):
        return percent(metric["value"])
    if name == "at_rest":
        return "yes" if metric["value"] else "no"
    return f"{number(metric['value'])} Pa" if metric["unit"] == "Pa" else quantity(metric)
