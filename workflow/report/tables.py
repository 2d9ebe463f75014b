"""Tables of the report: products as rows of text with units."""

from collections.abc import Callable, Sequence
from importlib import metadata

import numpy as np

from reflowshock.workflow.case.text import against_limit, nano, number, percent, quantity

Text = Callable[[str, dict], str]
SHAPE_EFFECT = "shape_effect_on_peak_stress"
HEADLINE = (
    (SHAPE_EFFECT, "change of the peak peel stress due to the real joint shapes"),
    ("critical_joint_stress_error", "stress history, two-scale against DNS"),
    ("two_scale_dns_core_ratio", "core time, two-scale / DNS"),
    ("energy_balance_error", "largest energy imbalance"),
    ("joint_width_error_max", "joint width against Young-Laplace, worst"),
    ("joint_volume_error_max", "joint volume lost in meshing, worst"),
)
COMPARISON = (
    ("compared_duration", "compared duration (the DNS ends before the shock)"),
    ("compared_stress", "largest stress of the critical joint in this duration / whole shock"),
    ("critical_joint", "critical joint (from the DNS if it covers the whole shock)"),
    ("critical_joint_stress_error", "von Mises history of its solder layer, relative L2"),
    ("worst_joint_stress_error", "von Mises history, worst joint that is fine in both, relative L2"),
    ("critical_joint_peel_error", "peel history of the critical joint, relative L2"),
    ("critical_joint_work_error", "plastic work history of the critical joint, relative L2"),
    ("die_displacement_error", "die centre displacement, relative L2"),
    ("board_displacement_error", "board centre displacement, relative L2"),
    ("two_scale_dns_core_ratio", "core time of the windows, two-scale / DNS"),
    ("two_scale_ideal_ratio", "ideal ratio: equal cost per element update, no overhead"),
    ("coarse_run_dns_time_ratio", "wall time, coarse run / DNS"),
)
PACKAGES = (
    "numpy",
    "scipy",
    "numba",
    "gmsh",
    "meshio",
    "pyvista",
    "fenics-dolfinx",
    "petsc4py",
    "mpi4py",
    "pydantic",
    "pint",
    "snakemake",
)


MODEL_ROWS = (
    ("hexahedra", lambda model: " + ".join(f"{number(count)} {role}" for role, count in model["elements"].items())),
    ("nodes", lambda model: " + ".join(f"{number(count)} {role}" for role, count in model["nodes"].items())),
    ("MPI ranks", lambda model: number(model["ranks"])),
    ("joint nodes tied to non-matching facets", lambda model: number(model["tied_nodes"])),
    ("time step of the macro model", lambda model: nano(model["window"]) if model["mode"] == "two_scale" else "–"),
    ("time step of the meso model or DNS", lambda model: nano(model["step"])),
    ("step ratio m", lambda model: number(model["substeps"]) if model["mode"] == "two_scale" else "–"),
    ("steps", lambda model: number(model["windows"] * model["substeps"])),
    ("mass of the model", lambda model: quantity({"value": model["model_mass"], "unit": "kg"})),
    ("mass added by mass scaling", lambda model: quantity({"value": model["added_mass"], "unit": "kg"})),
)


def headline(metrics: dict) -> list[dict]:
    """Return the figures of ``HEADLINE`` that the run has: records with ``label`` and ``value`` as text.

    Args:
        metrics: Name -> record with ``value`` (SI) and ``unit``.
    """
    return [{"label": label, "value": named_quantity(metrics, name)} for name, label in HEADLINE if name in metrics]


def figures_of(names: Sequence[str], metrics: dict, text: Text) -> list[dict]:
    """Return the named metrics that the run has, as records with ``label`` and ``value`` as text; others are skipped.

    Args:
        names: Names of metrics, in the order of the result.
        metrics: Name -> record with ``value`` (SI) and ``unit``.
        text: Function of name and record of a metric that returns its text.
    """
    return [{"label": name.replace("_", " "), "value": text(name, metrics[name])} for name in names if name in metrics]


def limited_metrics(metrics: dict, health: dict, text: Text) -> dict:
    """Return the table of all metrics with their limits.

    Args:
        metrics: Name -> record with ``value`` (SI) and ``unit``.
        health: Name of a check -> record with ``value``, ``limit`` and ``ok``; a check limits the metric of the same
            name.
        text: Function of name and record of a metric that returns its text.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): metric, value and limit, which is empty for a
        metric without a check.
    """
    rows = []
    for name, metric in metrics.items():
        limit = text(name, metric | {"value": health[name]["limit"]}) if name in health else ""
        rows.append([name.replace("_", " "), text(name, metric), limit])
    return {"head": ["metric", "value", "limit"], "rows": rows}


def health_rows(health: dict) -> list[dict]:
    """Return one record for each health check: name, value and limit as text, and ok.

    Args:
        health: Name of a check -> record with ``value``, ``limit`` and ``ok``.
    """
    texts = {name: against_limit(name, check) for name, check in health.items()}
    return [
        {"name": name.replace("_", " "), "value": value, "limit": limit, "ok": health[name]["ok"]}
        for name, (value, limit) in texts.items()
    ]


def versions() -> dict:
    """Return the table of installed versions of the numerical libraries.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): library and version, "not found" if it is
        missing.
    """
    rows = []
    for name in PACKAGES:
        try:
            rows.append([name, metadata.version(name)])
        except metadata.PackageNotFoundError:
            rows.append([name, "not found"])
    return {"head": ["library", "version"], "rows": rows}


def comparison(metrics: dict) -> dict | None:
    """Return the table of the two-scale run against the DNS (one model on one mesh); None unless both were run.

    Args:
        metrics: Name -> record with ``value`` (SI) and ``unit``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): label and value; None unless both modes were
        run.
    """
    if "two_scale_dns_core_ratio" not in metrics:
        return None
    rows = [[label, named_quantity(metrics, name)] for name, label in COMPARISON if name in metrics]
    return {"head": ["two-scale against DNS", "value"], "rows": rows}


def energies(histories: dict[str, dict]) -> dict:
    """Return the table of the largest magnitude of each energy over time, one column for each mode.

    Args:
        histories: Mode -> arrays of its ``history.npz``: ``time``, shape (k,) [s], and k rows of each quantity, among
            them the energies [J].

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per energy (kinetic, internal,
        plastic, …, balance) [mJ]; some that are zero are left out.
    """
    terms = ("kinetic", "internal", "plastic", "hourglass", "damping", "external", "interface", "balance")
    largest = {
        term: [float(np.max(np.abs(history[term]))) for history in histories.values()]
        for term in terms
        if all(term in history for history in histories.values())
    }
    always = ("kinetic", "internal", "external", "interface", "balance")
    rows = [
        [term, *(f"{1e3 * value:.4g} mJ" for value in values)]
        for term, values in largest.items()
        if any(values) or term in always
    ]
    return {"head": ["largest magnitude", *(mode_name(mode) for mode in histories)], "rows": rows}


def models(results: dict[str, dict]) -> dict:
    """Return the table of model sizes and time steps, one column for each mode.

    Args:
        results: Mode -> content of its ``result.json``, of which ``model`` is read.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per property: hexahedra, nodes, MPI
        ranks, tied nodes, time steps, masses, and critical time step of each material role.
    """
    records = [result["model"] for result in results.values()]
    rows = [[label, *(text(record) for record in records)] for label, text in MODEL_ROWS]
    roles = dict.fromkeys(role for record in records for role in record["critical_steps"])
    rows += [
        [f"critical time step, {role}", *(nano(record["critical_steps"].get(role)) for record in records)]
        for role in roles
    ]
    return {"head": ["model", *(mode_name(mode) for mode in results)], "rows": rows}


def costs(results: dict[str, dict]) -> dict:
    """Return the table of wall times [s], one row per activity and one column per run.

    Args:
        results: Mode or solver -> content of its ``result.json``, of which ``timings`` (activity -> time [s]) is read.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text).
    """
    return _side_by_side(results, "timings", "seconds")


def _side_by_side(results: dict[str, dict], section: str, title: str) -> dict:
    keys = list(dict.fromkeys(key for result in results.values() for key in _flat(result[section])))
    flat = [_flat(result[section]) for result in results.values()]
    rows = [[key.replace("_", " "), *(_cell(record.get(key)) for record in flat)] for key in keys]
    return {"head": [title, *(mode_name(mode) for mode in results)], "rows": rows}


def _flat(record: dict, prefix: str = "") -> dict:
    flat: dict = {}
    for key, value in record.items():
        if isinstance(value, dict) and not {"value", "unit"} <= value.keys():
            flat.update(_flat(value, f"{prefix}{key}: "))
        else:
            flat[prefix + key] = value
    return flat


def _cell(value) -> str:
    if value is None:
        return "–"
    return quantity(value) if isinstance(value, dict) else number(value)


def mode_name(mode: str) -> str:
    """Return the display name of a mode: "two-scale", "DNS", or the name itself for others."""
    return {"two_scale": "two-scale", "dns": "DNS"}.get(mode, mode)


def named_quantity(metrics: dict, name: str) -> str:
    """Format the value of a named metric for a reader, with its unit.

    Args:
        metrics: Metrics of a run by name, each a record with ``value`` and ``unit``.
        name: Name of the metric, which must exist and decides on the format: errors and the shape effect in per cent,
            strains in microstrain, others in the usual unit of their quantity.
    """
    if name == SHAPE_EFFECT:
        return f"{100.0 * metrics[name]['value']:+.3g} %"
    if "_error" in name:
        return percent(metrics[name]["value"])
    if name.endswith("_strain"):
        return f"{1e6 * metrics[name]['value']:.0f} µm/m"
    return quantity(metrics[name])
