"""The first table of the report of a drop: each headline figure with its errors and what is left out."""

from collections.abc import Mapping
from typing import Any

from reflowshock.fem.problem.shock import Shock
from reflowshock.workflow.report import tables
from reflowshock.workflow.report.errors import NOT_KNOWN, Discretisation, left_out, scheme_error

FIGURES = (
    ("critical_joint", "critical joint"),
    ("peel_stress", "peel stress, mean over its worse pad, peak"),
    ("layer_von_mises", "von Mises stress of the solder layer there, peak"),
    ("layer_plastic_work", "plastic work density of the solder layer there"),
    ("section_axial_force", "axial force of this joint, peak"),
    ("section_bending_moment", "bending moment of this joint, peak"),
    ("peak_acceleration@package", "peak acceleration of the package"),
    ("peak_board_strain", "peak board strain under the package"),
    ("peak_board_displacement", "peak deflection of the board's centre"),
    ("peak_element_stress", "largest von Mises stress of an element; grows with a finer mesh, ranks nothing"),
)
HEAD = ("", "value", "discretisation error", "error of two scales", "left out, expected influence")
NOTE = (
    "Discretisation error: grid convergence index (Roache 1994), 1.25 times the difference from the Richardson limit of"
    " three meshes, 3 times that from the finest mesh where they show no order. Error of two scales: difference from"
    " one model on the same mesh."
)


def later_swings(shock: Shock, end: float) -> str:
    """Say that swings after the end of a run [s] may bring more, where it ended by itself and nothing damps it."""
    if shock.duration != "auto" or any(shock.damping.coefficients):
        return ""
    return (
        f" The run ends at {1e3 * end:.3g} ms, half a swing after the largest stress. Nothing damps the board: later"
        " swings may bring more (shock.damping damps it, shock.duration follows it further)."
    )


def headline(metrics: Mapping[str, dict], known: Discretisation, summary: Mapping, results: Mapping[str, Any]) -> dict:
    """Return rows of figure, value and errors; what is left out is the same for all of them.

    Args:
        metrics: of the run.
        known: discretisation errors.
        summary: of the run, with its effects.
        results: ``result.json`` of the modes, the one whose figures count first.
    """
    found = {name: label for name, label in FIGURES if name in metrics}
    rows = [
        [
            label,
            tables.named_quantity(dict(metrics), name),
            "–" if isinstance(metrics[name]["value"], str) else known.text(name),
            scheme_error(name, results),
        ]
        for name, label in found.items()
    ]
    note = NOTE
    if any(row[2] == NOT_KNOWN for row in rows):
        note += f" Discretisation error not known: {known.unknown}."
    if any(row[3] == NOT_KNOWN for row in rows) and len(results) == 1:
        note += ' Error of two scales not known: shock.numerics.modes has no "dns", one model at the small step.'
    return {"head": HEAD, "rows": rows, "left_out": left_out(summary["effects"]), "note": note}
