"""Report of a structure: deformation, natural modes, histories, reactions, energy balance, references and cost."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.workflow.case.text import number, percent, quantity, short
from reflowshock.workflow.report import two_scales
from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.colours import BLUE, GREEN, RED
from reflowshock.workflow.report.curves import ENERGIES, MILLI, TIME
from reflowshock.workflow.report.fitted import gauge_curves, gauge_table
from reflowshock.workflow.report.spectra import mode_table
from reflowshock.workflow.report.tables import costs
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.findings import read_history, read_modes
from reflowshock.workflow.structure.record_curves import acceleration_curves, input_spectra
from reflowshock.workflow.structure.stages import read_results

SOLVER_STYLE: dict[str, dict[str, Any]] = {
    "explicit": {"name": "explicit", "colour": BLUE},
    "implicit": {"name": "implicit", "colour": RED, "line": "dashed"},
    "dns": {"name": "DNS", "colour": GREEN, "line": "dotted"},
}
COMPONENTS = {3: ("x", "y", "z"), 6: ("xx", "yy", "zz", "xy", "yz", "xz")}
UNITS = {"displacement": "m", "velocity": "m/s", "strain": "m/m", "stress": "Pa", "reaction": "N"}
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))

Histories = Mapping[str, Mapping[str, NDArray]]


HEADLINE = (
    "first_frequency", "peak_acceleration", "second_peak_acceleration", "peak_displacement", "displacement_range",
    "peak_strain", "displacement_difference", "strain_difference", "two_scale_dns_core_ratio",
    "two_scale_displacement_error", "wave_speed_error", "transmitted_velocity_error", "reflected_velocity_error",
    "tip_deflection_error", "swing_frequency_error", "energy_balance_error",
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
    """Add the tables, charts and scenes of a structure to the context of the report template.

    Args:
        run_folder: Run folder; without the product of the shock nothing is added.
        case: Case of the run.
        context: Context of the page's template, changed in place: ``headline``, ``points``, ``curves``, ``tables``,
            ``scenes`` and others.
        metrics: Name -> record with ``value`` (SI) and ``unit``.
    """
    folder = run_folder / "shock"
    if not folder.is_dir():
        return
    results = read_results(folder)
    histories = {solver: read_history(folder / solver) for solver in results}
    context["headline"] = headline(metrics)
    context["meshed"] = meshed_part(case)
    context["points"] = [{"name": name, "curve": point_curves(histories, name)} for name in case.watch]
    context["curves"]["energy"] = energy_curves(histories)
    context["curves"]["accelerations"] = acceleration_curves(case, histories, SOLVER_STYLE)
    context["curves"]["gauges"] = gauge_curves(histories, case.gauges, SOLVER_STYLE)
    context["curves"]["spectrum"] = input_spectra(case)
    context["filter"] = case.dynamics.filter.label
    if case.supports:
        context["curves"]["reactions"] = reaction_curves(histories, list(case.supports))
    context["tables"] |= {
        "structure": model_table(results),
        "metrics": metric_table(metrics),
        "references": reference_table(metrics),
        "published": published_table(case, metrics),
        "cost": costs(results),
    }
    first = next(iter(results))
    context["tables"]["gauges"] = gauge_table(case.gauges, metrics, results[first]["model"].get("gauge_lengths", {}))
    add_two_scales(results[first], context)
    _add_scenes(folder / first, case, histories[first], context)


def add_two_scales(result: Mapping, context: dict) -> None:
    """Add the tables of coupling, step levels and rank placement of a two-scale run.

    Args:
        result: Content of a solver's ``result.json``; without ``coupling`` nothing is added.
        context: Context of the page's template, changed in place: ``tables``.
    """
    coupling = result.get("coupling")
    if coupling is None:
        return
    context["tables"] |= {
        "two_scales": two_scales.two_scales(coupling, result["model"]),
        "levels": two_scales.levels(coupling),
        "placement": two_scales.placement(coupling),
    }


def meshed_part(case: StructureCase) -> str:
    """Return the part of the body that symmetry leaves to be meshed: "half", "quarter", or empty for the whole body.

    Args:
        case: Case of a structure with its symmetry planes.
    """
    return ("", "half", "quarter")[len(set(case.structure.symmetry))]


def headline(metrics: dict) -> list[dict]:
    """Return the figures at the top of the page: for each quantity of ``HEADLINE`` the first metric of the run.

    Args:
        metrics: Name -> record with ``value`` (SI) and ``unit``; names are ``<quantity>`` or ``<quantity>@<location>``.

    Returns:
        Records with ``label`` and ``value`` as text; quantities without a metric are left out.
    """
    figures = []
    for quantity_name in HEADLINE:
        name = next((name for name in metrics if name.split("@")[0] == quantity_name), None)
        if name is not None:
            figures.append({"label": label(name), "value": text(name, metrics[name])})
    return figures


def label(name: str) -> str:
    """Return the name of a metric as readable text: "peak strain at P1" for ``peak_strain@P1``."""
    quantity_name, _, location = name.partition("@")
    return quantity_name.replace("_", " ") + (f" at {location}" if location else "")


def text(name: str, metric: dict) -> str:
    """Format the value of a metric: errors and differences in per cent, strains in microstrain.

    Args:
        name: Name of the metric, which decides on the format.
        metric: Record with ``value`` (SI) and ``unit``.
    """
    quantity_name = name.partition("@")[0]
    if quantity_name.endswith(FRACTIONS):
        return percent(metric["value"])
    if quantity_name.endswith("strain"):
        return f"{1e6 * metric['value']:.0f} µm/m"
    is_short = metric["unit"] == "m" and 0.0 < metric["value"] < SHORTEST_IN_MM
    return f"{number(1e6 * metric['value'])} µm" if is_short else quantity(metric)


def metric_table(metrics: dict) -> dict:
    """Return a table of all metrics: readable name, and value with its unit.

    Args:
        metrics: Name -> record with ``value`` (SI) and ``unit``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text).
    """
    return {"head": ["metric", "value"], "rows": [[label(name), text(name, value)] for name, value in metrics.items()]}


def reference_table(metrics: dict) -> dict | None:
    """Return the table of computed and exact values, or None without exact values.

    Args:
        metrics: Name -> record with ``value`` (SI) and ``unit``; a value ``x`` with an exact one has ``x_exact`` and
            ``x_error``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): quantity, computed, exact value and error [%].
    """
    rows = []
    for name, metric in metrics.items():
        if f"{name}_exact" in metrics:
            exact, error = metrics[f"{name}_exact"], metrics[f"{name}_error"]
            rows.append([label(name), text(name, metric), text(name, exact), percent(error["value"])])
    return {"head": ["quantity", "computed", "exact", "error"], "rows": rows} if rows else None


def published_table(case: StructureCase, metrics: dict) -> dict | None:
    """Return the table of computed and published values, or None without published values.

    Args:
        case: Case with its references.
        metrics: Name -> record with ``value`` (SI) and ``unit``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): quantity, computed and published value,
        source.
    """
    rows = [
        [
            label(published.metric),
            text(published.metric, metrics[published.metric]) if published.metric in metrics else "–",
            published.value,
            published.source,
        ]
        for reference in case.references.values()
        if (published := reference.published) is not None
    ]
    return {"head": ["quantity", "computed", "published", "source"], "rows": rows} if rows else None


def model_table(results: Mapping[str, dict]) -> dict:
    """Return the table of model size and time steps, one row per property and one column per solver.

    Args:
        results: Solver -> content of its ``result.json``, of which ``model`` is read.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): elements, nodes, ranks, time steps, masses.
    """
    records = [result["model"] for result in results.values()]
    return {
        "head": ["model", *results],
        "rows": [[name, *(row(record) for record in records)] for name, row in MODEL_ROWS],
    }


def _add_scenes(folder: Path, case: StructureCase, history: Mapping[str, np.ndarray], context: dict) -> None:
    from reflowshock.workflow.structure.scenes import deformation_scene, modes_scene

    modes, parts = read_modes(folder), list(case.structure.layers)
    context["scenes"]["view"] = deformation_scene(model_series(folder), parts, _peak_time(case, history))
    context["view_caption"] = (
        "The first frame shows the time of the largest strain energy. Displacements are relative to the supports."
    )
    if modes:
        context["tables"]["modes"] = mode_table(modes)
        context["scenes"]["modes"] = modes_scene(folder / "modes.pvd", parts, modes)


def model_series(folder: Path) -> list[Path]:
    """Return the existing field series (PVD files) of a solver, one for each model.

    Args:
        folder: Folder of the solver.
    """
    return [path for role in ROLES if (path := folder / f"{role}.pvd").exists()]


def _peak_time(case: StructureCase, history: Mapping[str, np.ndarray]) -> float:
    """Return the time of the largest strain energy [s]."""
    return float(history["time"][np.argmax(history["internal"])])


def point_curves(histories: Histories, point: str) -> list[Chart]:
    """Return charts of displacement, velocity, strain and stress at a watch point, each of its largest component.

    Args:
        histories: Solver -> arrays of its ``history.npz``: ``time``, shape (k,) [s], and k rows of each quantity.
        point: Name of the watch point.

    Returns:
        Interactive charts for the report page.
    """
    return [component_chart(histories, name, point) for name in ("displacement", "velocity", "strain", "stress")]


def reaction_curves(histories: Histories, supports: list[str]) -> list[Chart]:
    """Return one chart per support with the largest component of its reaction.

    Args:
        histories: Solver -> arrays of its ``history.npz``: ``time``, shape (k,) [s], and k rows of each quantity.
        supports: Names of the supports.

    Returns:
        Interactive charts for the report page.
    """
    return [component_chart(histories, "reaction", support, support) for support in supports]


def energy_curves(histories: Histories) -> list[Chart]:
    """Return charts of each solver's nonzero energies, and of the balance relative to the largest energy.

    Args:
        histories: Solver -> arrays of its ``history.npz``: ``time``, shape (k,) [s], and k rows of each quantity;
            energies in J.

    Returns:
        Interactive charts for the report page.
    """
    charts = []
    for solver, history in histories.items():
        time, largest = history["time"] / MILLI, _largest(history)
        factor, prefix = _prefix(largest)
        terms = [
            Series(name, time, history[name] / factor, colour)
            for name, colour in ENERGIES.items()
            if np.abs(history[name]).max() > 1e-6 * largest
        ]
        balance = Series("balance", time, 100.0 * history["balance"] / (largest or 1.0), RED)
        charts += [Chart(TIME, Axis(f"energy [{prefix}J]"), terms, title=solver)] if terms else []
        charts.append(Chart(TIME, Axis("share of the largest energy [%]"), [balance], title=solver))
    return charts


def component_chart(histories: Histories, quantity: str, location: str, title: str = "") -> Chart:
    """Return a chart of one component of a vector or tensor: the largest one in the first history.

    Args:
        histories: Solver -> arrays of its ``history.npz``: ``time``, shape (k,) [s], and ``quantity@location``, shape
            (k, 3) or (k, 6).
        quantity: Key of ``UNITS``.
        location: Name of a watch point or support.
        title: Title of the chart.

    Returns:
        Chart of the component with the largest absolute value in the first history, one curve for each solver.
    """
    name = f"{quantity}@{location}"
    first = next(iter(histories.values()))[name]
    component = int(np.argmax(np.abs(first).max(axis=0)))
    factor, prefix = _prefix(float(np.abs(first[:, component]).max()))
    lines = [
        Series(x=history["time"] / MILLI, y=history[name][:, component] / factor, **SOLVER_STYLE[solver])
        for solver, history in histories.items()
    ]
    label = f"{quantity} {COMPONENTS[first.shape[1]][component]} [{prefix}{UNITS[quantity]}]"
    return Chart(TIME, Axis(label), lines, title=title)


def _prefix(largest: float) -> tuple[float, str]:
    """Return the power of a thousand and its SI prefix that scale a value to between 1 and 1000."""
    return next(((factor, prefix) for factor, prefix in PREFIXES if largest >= factor), (1.0, ""))


def _largest(history: Mapping[str, NDArray]) -> float:
    return max(float(np.abs(history[name]).max()) for name in ENERGIES)
