"""First table of a drop report: headline figures with discretisation error, two-scale error, neglected effects."""

from collections.abc import Mapping
from typing import Any

from reflowshock.fem.problem.shock import Shock
from reflowshock.workflow.report import tables
from reflowshock.workflow.report.errors import NOT_KNOWN, Discretisation, left_out, scheme_error

FIGURES = (
    ("critical_joint", "critical joint"),
    ("peel_stress", "peak peel stress, mean over the worse pad"),
    ("layer_von_mises", "peak von Mises stress, solder layer at this pad"),
    ("layer_plastic_work", "plastic work density, solder layer at this pad"),
    ("section_axial_force", "peak axial force of this joint"),
    ("section_bending_moment", "peak bending moment of this joint"),
    ("peak_acceleration@package", "peak acceleration of the package"),
    ("peak_board_strain", "peak board strain under the package"),
    ("peak_board_displacement", "peak deflection of the board centre"),
    ("peak_element_stress", "largest von Mises stress of an element (mesh-dependent, not for ranking)"),
)
HEAD = ("", "value", "discretisation error", "two-scale error", "neglected effects, expected influence")
NOTE = (
    "Discretisation error: grid convergence index (Roache 1994), 1.25 times the difference from the Richardson limit of"
    " three meshes, or 3 times the difference expected from the theoretical order if they show no order. Two-scale"
    " error: difference from one model on the same mesh."
)


def later_swings(shock: Shock, end: float) -> str:
    """Return a note that later swings may be larger, for an undamped run that ended automatically at ``end`` [s]."""
    if shock.duration != "auto" or any(shock.damping.coefficients):
        return ""
    return (
        f" The run ends at {1e3 * end:.3g} ms, half a swing after the largest stress. The board is undamped, so later"
        " swings may be larger; set shock.damping, or a longer shock.duration."
    )


def headline(metrics: Mapping[str, dict], known: Discretisation, summary: Mapping, results: Mapping[str, Any]) -> dict:
    """Return the table of headline figures with value and errors, the common neglected effects, and a note.

    Args:
        metrics: Metrics of the run.
        known: Discretisation errors of the metrics.
        summary: Summary of the run, with its effects.
        results: ``result.json`` of each mode, the main mode first.
    """
    figures = {name: label for name, label in FIGURES if name in metrics}
    rows = [
        [
            label,
            tables.named_quantity(dict(metrics), name),
            "–" if isinstance(metrics[name]["value"], str) else known.text(name),
            scheme_error(name, results),
        ]
        for name, label in figures.items()
    ]
    note = NOTE
    if any(row[2] == NOT_KNOWN for row in rows):
        note += f" Discretisation error unknown: {known.unknown}."
    if any(row[3] == NOT_KNOWN for row in rows) and len(results) == 1:
        note += ' Two-scale error unknown: add "dns" (one model at the small step) to shock.numerics.modes.'
    return {"head": HEAD, "rows": rows, "left_out": left_out(summary["effects"]), "note": note}
