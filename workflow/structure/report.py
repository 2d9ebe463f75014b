"""Report of a structure: what moved how, against what, at what cost."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from reflowshock.workflow.case.text import number, percent, quantity, short
from reflowshock.workflow.report import two_scales
from reflowshock.workflow.report.tables import costs
from reflowshock.workflow.structure import curves as structure_curves
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.findings import read_history, read_modes
from reflowshock.workflow.structure.launch import read_results
from reflowshock.workflow.structure.references import Published

HEADLINE = (
    "first_frequency", "peak_displacement", "displacement_range", "peak_strain", "displacement_difference",
    "strain_difference", "two_scale_dns_time_ratio", "two_scale_displacement_error", "wave_speed_error",
    "transmitted_velocity_error", "reflected_velocity_error", "tip_deflection_error", "swing_frequency_error",
    "energy_balance_error",
)  # fmt: skip
FRACTIONS = ("_error", "_difference", "_fraction")
SHORTEST_IN_MM = 1e-5  # m
ROLES = ("structure", "macro", "meso")
MODEL_ROWS = (
    ("elements", lambda model: f"{number(model['elements'])} ({model['element']} {model['formulation']})"),
    ("models", lambda model: ", ".join(f"{role} {number(count)}" for role, count in model["models"].items())),
    ("nodes", lambda model: number(model["nodes"])),
    ("MPI ranks", lambda model: number(model["ranks"])),
    ("critical time step", lambda model: short(model["critical_step"])),
    ("time step", lambda model: short(model["step"])),
    ("steps", lambda model: number(model["steps"])),
    ("mass", lambda model: f"{number(1e3 * model['model_mass'])} g"),
    ("mass added by mass scaling", lambda model: f"{number(1e3 * model['added_mass'])} g"),
)


def add_structure(run_folder: Path, case: StructureCase, context: dict, metrics: dict) -> None:
    """Add what is told of a structure that has moved."""
    folder = run_folder / "shock"
    if not folder.is_dir():
        return
    results = read_results(folder)
    histories = {solver: read_history(folder / solver) for solver in results}
    context["headline"] = headline(metrics)
    context["meshed"] = meshed_part(case)
    context["points"] = [{"name": name, "curve": structure_curves.point_curves(histories, name)} for name in case.watch]
    context["curves"]["energies"] = structure_curves.energy_curves(histories)
    if case.supports:
        context["curves"]["reactions"] = structure_curves.reaction_curves(histories, list(case.supports))
    context["tables"] |= {
        "structure": models(results),
        "metrics": metric_table(metrics),
        "references": references(metrics),
        "published": published(case, metrics),
        "cost": costs(results),
    }
    first = next(iter(results))
    add_two_scales(results[first], context)
    _add_pictures(folder / first, case, histories[first], context)


def add_two_scales(result: Mapping, context: dict) -> None:
    """Add how the models of a run are coupled, where there are two."""
    coupling = result.get("coupling")
    if coupling is None:
        return
    context["tables"] |= {
        "two_scales": two_scales.two_scales(coupling, result["model"]),
        "levels": two_scales.levels(coupling),
        "placement": two_scales.placement(coupling),
    }


def meshed_part(case: StructureCase) -> str:
    """Return what planes of symmetry leave to be meshed, in words; empty where all of the body is."""
    return ("", "half", "quarter")[len(set(case.structure.symmetry))]


def headline(metrics: dict) -> list[dict]:
    """The figures at the top of the page: of every kind the first one that the run has."""
    shown = []
    for wanted in HEADLINE:
        name = next((name for name in metrics if name.split("@")[0] == wanted), None)
        if name is not None:
            shown.append({"label": label(name), "value": text(name, metrics[name])})
    return shown


def label(name: str) -> str:
    """Write the name of a metric in words."""
    what, _, where = name.partition("@")
    return what.replace("_", " ") + (f" at {where}" if where else "")


def text(name: str, metric: dict) -> str:
    """Write the value of a metric: differences as per cent, strains in microstrain."""
    what = name.partition("@")[0]
    if what.endswith(FRACTIONS):
        return percent(metric["value"])
    if what.endswith("strain"):
        return f"{1e6 * metric['value']:.0f} µm/m"
    is_short = metric["unit"] == "m" and 0.0 < metric["value"] < SHORTEST_IN_MM
    return f"{number(1e6 * metric['value'])} µm" if is_short else quantity(metric)


def metric_table(metrics: dict) -> dict:
    """All metrics."""
    return {"head": ["metric", "value"], "rows": [[label(name), text(name, found)] for name, found in metrics.items()]}


def references(metrics: dict) -> dict | None:
    """What was measured beside its exact value."""
    rows = []
    for name, metric in metrics.items():
        if f"{name}_exact" in metrics:
            exact, error = metrics[f"{name}_exact"], metrics[f"{name}_error"]
            rows.append([label(name), text(name, metric), text(name, exact), percent(error["value"])])
    return {"head": ["quantity", "computed", "exact", "error"], "rows": rows} if rows else None


def published(case: StructureCase, metrics: dict) -> dict | None:
    """What was computed beside what others published."""
    rows = [
        [
            label(one.metric),
            text(one.metric, metrics[one.metric]) if one.metric in metrics else "–",
            one.value,
            one.source,
        ]
        for one in case.references.values()
        if isinstance(one, Published)
    ]
    return {"head": ["quantity", "computed", "published", "source"], "rows": rows} if rows else None


def models(results: Mapping[str, dict]) -> dict:
    """What was computed, each solver a column."""
    records = [result["model"] for result in results.values()]
    return {
        "head": ["model", *results],
        "rows": [[name, *(row(record) for record in records)] for name, row in MODEL_ROWS],
    }


def mode_table(modes: list[dict]) -> dict:
    """Natural frequencies, and how much of the mass moves with each mode when the supports are shaken."""
    rows = [
        [
            f"{mode['mode']}",
            f"{mode['frequency']:.2f}",
            *(f"{100 * mode['mass_fraction'][axis]:.1f} %" for axis in "xyz"),
        ]
        for mode in modes
    ]
    return {"head": ["mode", "frequency [Hz]", "mass along x", "along y", "along z"], "rows": rows}


def _add_pictures(folder: Path, case: StructureCase, history: Mapping[str, np.ndarray], context: dict) -> None:
    from reflowshock.workflow.report.pictures import embedded
    from reflowshock.workflow.structure.pictures import render_deformation, render_modes

    modes, series, time = read_modes(folder), model_series(folder), _peak_time(case, history)
    pictures = context["pictures"]
    pictures["bent"], context["bent_caption"] = embedded(lambda path: render_deformation(series, time, path))
    if modes:
        context["tables"]["modes"] = mode_table(modes)
        pictures["modes"], _ = embedded(lambda path: render_modes(folder / "modes.pvd", modes[:6], path))


def model_series(folder: Path) -> list[Path]:
    """Return the series of fields of all models of a run."""
    return [path for role in ROLES if (path := folder / f"{role}.pvd").exists()]


def _peak_time(case: StructureCase, history: Mapping[str, np.ndarray]) -> float:
    """Time [s] at which the strain energy is largest."""
    return float(history["time"][np.argmax(history["internal"])])
