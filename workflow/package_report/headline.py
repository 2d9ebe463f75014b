"""Headline figures of a drop report with their errors, and the neglected effects."""

from collections.abc import Mapping
from typing import Any

from reflowshock.fem.problem.shock import Shock
from reflowshock.workflow.report import tables
from reflowshock.workflow.report.errors import Discretisation, left_out

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
HEAD = ("", "value", "discretisation error", "two-scale error")
NONE = "–"  # of a figure without this error
DISCRETISATION = (
    " Discretisation error: grid convergence index (Roache 1994), 1.25 times the difference from the Richardson limit"
    " of three meshes, or 3 times the difference expected from the theoretical order if they show no order."
)
TWO_SCALE = "difference from one model on the same mesh"


def later_swings(shock: Shock, end: float, why: str = "") -> str:
    """Return a note on the end of a run of automatic duration: its reason, or that later swings may be larger.

    Args:
        shock: Parameters of the shock.
        end: Time at which the run ended [s].
        why: Reason for the end of a damped board, if a coarse run decided it; not used for an undamped board.

    Returns:
        Sentence with a leading space: ``why`` for a damped board, the note on larger swings for an undamped one; empty
        if the duration is fixed, or the board is damped and no reason is given.
    """
    if shock.duration != "auto":
        return ""
    if shock.damping.acts:
        return f" The run ends at {1e3 * end:.3g} ms: {why}." if why else ""
    return (
        f" The run ends at {1e3 * end:.3g} ms, half a swing after the largest stress. The board is undamped, so later"
        " swings may be larger; set shock.damping, or a longer shock.duration."
    )


def headline(metrics: Mapping[str, dict], known: Discretisation, summary: Mapping, results: Mapping[str, Any]) -> dict:
    """Return the table of the main figures of a shock with their known errors, and a note on the neglected effects.

    Args:
        metrics: Name -> record with ``value`` (SI) and ``unit``.
        known: Discretisation errors of the metrics by name.
        summary: Content of ``summary.json``, of which ``effects`` is read.
        results: Mode -> content of its ``result.json`` (``model``, ``metrics``, ``health``, ``timings``, ``coupling``),
            the main mode first.

    Returns:
        Table with ``head``, ``rows`` (lists of text) and ``note``: figure, value, discretisation error and two-scale
        error; a column of errors in which none is known is left out.
    """
    rows = [
        [
            label,
            tables.named_quantity(dict(metrics), name),
            NONE if isinstance(metrics[name]["value"], str) else known.text(name) or NONE,
            known.two_scale_text(name, results) or NONE,
        ]
        for name, label in FIGURES
        if name in metrics
    ]
    columns = [0, 1, *(column for column in (2, 3) if any(row[column] != NONE for row in rows))]
    note = f"Neglected effects by expected influence: {left_out(summary['effects'])}."
    note += DISCRETISATION if known.errors else f" The discretisation error is not estimated: {known.unknown}."
    note += f" Two-scale error: {known.two_scale_how or TWO_SCALE}." if 3 in columns or known.two_scale_how else ""
    return {
        "head": [HEAD[column] for column in columns],
        "rows": [[row[column] for column in columns] for row in rows],
        "note": note,
    }
