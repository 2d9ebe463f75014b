"""Report of solder alone: pictures, profile or oscillation against the exact one, histories, metrics with errors."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import pyplot

from reflowshock.workflow.case.text import number, percent, quantity
from reflowshock.workflow.report.curves import MICRO, MILLI, STYLE, plain_ticks, svg
from reflowshock.workflow.report.pictures import embedded, render_stages

if TYPE_CHECKING:
    from reflowshock.particles.steps.shape import JointShape, Snapshot

DEGREE = np.pi / 180.0
HEADLINE = (
    "height", "max_width", "waist", "contact_angle", "max_width_error", "axial_force", "offset",
    "collapse_height_error", "drops_left", "radius_error", "period", "period_error", "decay_rate", "decay_rate_error",
    "verdict", "at_rest", "particles", "seconds",
)  # fmt: skip


def add_solder(run_folder: Path, kind: str, context: dict, summary: dict) -> None:
    """Add the section on solder alone."""
    if not (run_folder / "reflow" / "shape.h5").exists():
        return
    from reflowshock.particles.scenes.products import read_body

    shape, meridian = read_body(run_folder / "reflow")
    context["headline"] = headline(summary["metrics"])
    context["tables"]["body"] = metric_table(summary["metrics"], summary["health"])
    if kind == "oscillation":
        context["curves"]["swing"] = swing_curve(shape.history, summary["metrics"])
    else:
        if shape.verdict != "apart":
            axis = middle(shape.surface_points) if kind == "drops" else 0.0
            context["curves"]["profile"] = profile_curve(shape.surface_points - axis, meridian)
        context["curves"]["body_history"] = history_curve(shape.history)
    path = run_folder / "reflow" / "path.json"
    if path.exists():
        kind, context["curves"]["path"] = "path", path_curve(json.loads(path.read_text(encoding="utf-8")))
    shown = stages(kind, shape)
    context["pictures"]["body"], _ = embedded(lambda picture: render_stages(shown, shape, picture))


def headline(metrics: dict) -> list[dict]:
    """The figures at the top of the page."""
    return [
        {"label": name.replace("_", " "), "value": _text(name, metrics[name])} for name in HEADLINE if name in metrics
    ]


def metric_table(metrics: dict, health: dict) -> dict:
    """All metrics, those with a limit beside it."""
    rows = [
        [name.replace("_", " "), _text(name, metric), _limit(name, metric, health)] for name, metric in metrics.items()
    ]
    return {"head": ["metric", "value", "limit"], "rows": rows}


def _limit(name: str, metric: dict, health: dict) -> str:
    return _text(name, metric | {"value": health[name]["limit"]}) if name in health else ""


def middle(points: np.ndarray) -> np.ndarray:
    """Place `(3,)` of the vertical axis through the middle of a drop that stands anywhere."""
    return 0.5 * (points.min(axis=0) + points.max(axis=0)) * np.array([1.0, 1.0, 0.0])


def profile_curve(points: np.ndarray, meridian: np.ndarray | None) -> str:
    """Draw radius against height of the surface particles `(s, 3)` [m] over the exact meridian `(2, k)` [m]."""
    with pyplot.rc_context(STYLE):
        figure, axis = pyplot.subplots(figsize=(6.2, 3.6), constrained_layout=True)
        radius = np.hypot(points[:, 0], points[:, 1])
        axis.plot(radius / MILLI, points[:, 2] / MILLI, ".", ms=3, color="#0b5fa5", label="surface particles")
        if meridian is not None:
            axis.plot(*(meridian / MILLI), color="#d1495b", lw=1.2, label="Young-Laplace")
        axis.set(xlabel="radius [mm]", ylabel="height [mm]", aspect="equal")
        axis.set_xlim(left=min(0.0, axis.get_xlim()[0]))
        figure.legend(frameon=False, loc="outside upper center", ncols=2)
        return svg(figure)


def history_curve(history: dict) -> str:
    """Draw height and width, energy, capillary number and time step against the steps."""
    step = history["step"]
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(2, 2, figsize=(9.2, 5.2), sharex=True, constrained_layout=True)
        axes[0, 0].plot(step, history["height"] / MILLI, label="height")
        if "width" in history:
            axes[0, 0].plot(step, history["width"] / MILLI, label="width")
        axes[0, 0].set_ylabel("[mm]")
        axes[0, 0].legend(frameon=False)
        axes[0, 1].plot(step, history["energy"] / MICRO)
        axes[0, 1].set_ylabel("energy [µJ]")
        axes[0, 1].ticklabel_format(useOffset=False)
        axes[1, 0].semilogy(step, history["capillary_number"])
        axes[1, 0].set_ylabel("capillary number")
        axes[1, 1].semilogy(step, history["time_step"] / MICRO)
        axes[1, 1].set_ylabel("time step [µs]")
        for axis in axes[1]:
            plain_ticks(axis.yaxis)
            axis.set_xlabel("step")
        return svg(figure)


def path_curve(places: Sequence[Mapping]) -> str:
    """Draw force and waist of a joint in the places of a path, over what changes first: standoff, offset or tilt."""
    axis_of = {"standoff": ("standoff [mm]", MILLI), "offset": ("offset [mm]", MILLI), "tilt": ("tilt [deg]", DEGREE)}
    name = next((name for name in axis_of if places[0][name] != places[-1][name]), "standoff")
    label, scale = axis_of[name]
    way = [place[name] / scale for place in places]
    exact = [(x, place["axial_force_exact"] / MILLI) for x, place in zip(way, places, strict=True)
             if place["axial_force_exact"] is not None]  # fmt: skip
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(1, 2, figsize=(9.2, 3.2), constrained_layout=True)
        axes[0].plot(way, [place["axial_force"] / MILLI for place in places], "o", ms=4, label="particles")
        if exact:
            axes[0].plot(*zip(*exact, strict=True), color="#d1495b", lw=1.2, marker=".", label="Young-Laplace")
        axes[0].set_ylabel("force on the package, upwards [mN]")
        axes[1].plot(way, [place["waist"] / MILLI for place in places], "o-", ms=4, label="waist")
        axes[1].plot(way, [place["max_width"] / MILLI for place in places], "s-", ms=4, label="width")
        axes[1].set_ylabel("[mm]")
        for axis in axes:
            axis.set_xlabel(label)
            axis.legend(frameon=False)
        return svg(figure)


def stages(kind: str, shape: "JointShape") -> "list[Snapshot]":
    """The states that a picture shows before the end: each quarter of the first oscillation, two of a path."""
    half = max(1, len(shape.snapshots) // 2)
    shown = {"oscillation": shape.snapshots[:7:2], "drops": shape.snapshots, "path": shape.snapshots[: half + 1 : half]}
    return shown.get(kind, shape.snapshots[:1])


def swing_curve(history: Mapping[str, np.ndarray], metrics: Mapping[str, dict]) -> str:
    """Draw the amplitude of the second mode beside that of Reid at small amplitude, and the energies."""
    time, value = history["time"], {name: metric["value"] for name, metric in metrics.items()}
    period = value["period"] / (1.0 + value["period_error"])
    decay = value["decay_rate"] / (1.0 + value["decay_rate_error"])
    amplitude = history["amplitude"]
    first = amplitude[time <= period]
    scale = 0.5 * (first.max() - first.min()) * np.exp(0.5 * decay * period)
    exact = scale * np.exp(-decay * time) * np.sin(2.0 * np.pi * time / period)
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(1, 2, figsize=(9.2, 3.2), constrained_layout=True)
        axes[0].plot(time / MILLI, amplitude, color="#0b5fa5", label="particles")
        axes[0].plot(time / MILLI, exact, "--", color="#d1495b", lw=1.0, label="Reid")
        axes[0].set_ylabel("amplitude of the second mode / R")
        total, kinetic = history["energy"], history["kinetic_energy"]
        rest = total[0] - kinetic[0]
        axes[1].plot(time / MILLI, (total - rest) / kinetic[0], label="kinetic + surface")
        axes[1].plot(time / MILLI, kinetic / kinetic[0], label="kinetic")
        axes[1].set_ylabel("energy above that at rest / at the start")
        for axis in axes:
            axis.set_xlabel("time [ms]")
            axis.legend(frameon=False, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))
        return svg(figure)


def _text(name: str, metric: dict) -> str:
    if metric["unit"] == "" and name.endswith(("_error", "_drift", "_scatter")):
        return percent(metric["value"])
    if name == "at_rest":
        return "yes" if metric["value"] else "no"
    return f"{number(metric['value'])} Pa" if metric["unit"] == "Pa" else quantity(metric)
