"""HTML of cases, plans and runs for notebooks, with escaped texts and without numerical libraries."""

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

FIRST = 24  # maximum number of rows of an unfolded table
HEIGHT = 720  # height of a report in a notebook [px]


@dataclass(frozen=True, slots=True)
class ReportView:
    """Report for a notebook, including its 3D view, in a sandboxed frame.

    Attributes:
        path: Path of ``report.html``.
    """

    path: Path

    def _repr_html_(self) -> str:
        page = escape(self.path.read_text(encoding="utf-8"))
        frame = f'sandbox="allow-scripts" width="100%" height="{HEIGHT}" style="border: 1px solid #ccd3da"'
        return f'<iframe title="report" {frame} srcdoc="{page}"></iframe>'


class Metrics(dict):
    """Metrics by name, displayed as a table in notebooks."""

    def _repr_html_(self) -> str:
        records = {name: {"value": metric.value, "unit": metric.unit} for name, metric in self.items()}
        return _metrics(records)


def case_html(name: str, title: str, values: Mapping[str, Any]) -> str:
    """Return the HTML of a case: title and folded table of all parameters.

    Args:
        name: Name of the case.
        title: Title of the case; may be empty.
        values: Dotted key -> value as shown in the table.
    """
    return heading(name, title) + fold(f"{len(values)} parameters", table(("key", "value"), values.items()), False)


def plan_html(stages: Mapping[str, Any], effects: Mapping[str, Mapping[str, Any]], seconds: float) -> str:
    """Return the HTML of a plan: actions and costs of stages, and active effects.

    Args:
        stages: Stage name -> planned stage, with the attributes ``runs`` (bool), ``seconds`` (predicted duration) and
            ``why`` (reason).
        effects: Effect name -> decision, with the keys ``on`` and ``why``.
        seconds: Predicted duration of all stages [s]; 0 if unknown.
    """
    from reflowshock.workflow.case.text import duration

    rows = [
        (name, "run", duration(stage.seconds) if stage.seconds else "", stage.why)
        if stage.runs
        else (name, "skip", "", stage.why)
        for name, stage in stages.items()
    ]
    rows.append(("all", "", duration(seconds) if seconds else "", "on an otherwise idle machine"))
    acting = [(_words(name), "on" if decision["on"] else "off", decision["why"]) for name, decision in effects.items()]
    stage_table = table(("stage", "", "predicted", "why"), rows)
    return stage_table + fold(f"{len(acting)} effects", table(("effect", "", "why"), acting), False)


def run_html(summary: Mapping[str, Any], title: str, picture: bytes | None) -> str:
    """Return the HTML of a run: answer, health checks, picture of the meshes and metrics.

    Args:
        summary: Contents of ``summary.json``; the keys ``case``, ``answer``, ``health`` and ``metrics`` are used.
        title: Title of the case.
        picture: PNG data, or None for a page without a picture.
    """
    failed = [_words(name) for name, check in summary["health"].items() if not check["ok"]]
    passed = f"all {len(summary['health'])} health checks passed"
    health = f"health checks failed: {', '.join(failed)}" if failed else passed
    parts = [heading(summary["case"], title), _paragraph(summary.get("answer", "")), _paragraph(health)]
    if picture is not None:
        encoded = base64.b64encode(picture).decode()
        parts.append(f'<img alt="mesh of board and package" width="480" src="data:image/png;base64,{encoded}">')
    return "".join([*parts, _metrics(summary["metrics"])])


def heading(name: str, title: str) -> str:
    """Return the HTML of name and title of a case, which are escaped."""
    return f"<p><b>{escape(name)}</b> {escape(title)}</p>"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return an HTML table of texts, which are escaped.

    Args:
        head: Titles of the columns.
        rows: Cells of each row; other objects are shown by ``str``.
    """
    cells = "".join(f"<tr>{''.join(f'<td>{escape(str(cell))}</td>' for cell in row)}</tr>" for row in rows)
    titles = "".join(f"<th>{escape(title)}</th>" for title in head)
    return f"<table><thead><tr>{titles}</tr></thead><tbody>{cells}</tbody></table>"


def fold(title: str, inside: str, opened: bool = True) -> str:
    """Return the HTML of a collapsible section.

    Args:
        title: Title, always visible; it is escaped.
        inside: HTML of the contents.
        opened: Whether the section is open at first.
    """
    return f"<details{' open' if opened else ''}><summary>{escape(title)}</summary>{inside}</details>"


def _metrics(records: Mapping[str, dict]) -> str:
    """Return the HTML of metrics in customary units, folded if there are many."""
    from reflowshock.workflow.report.tables import named_quantity

    rows = [(_words(name), named_quantity(dict(records), name)) for name in records]
    return fold(f"{len(rows)} metrics", table(("", "value"), rows), len(rows) <= FIRST)


def _paragraph(text: str) -> str:
    return f"<p>{escape(text)}</p>" if text else ""


def _words(name: str) -> str:
    return name.replace("_", " ")
