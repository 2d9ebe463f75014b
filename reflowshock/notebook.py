"""How cases, plans and runs show themselves in a notebook: HTML of texts that are escaped, no numerical library."""

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

FIRST = 24  # rows of a table that are shown unfolded
HEIGHT = 720  # of a report in a notebook [px]


@dataclass(frozen=True, slots=True)
class ReportView:
    """A report that shows itself, 3D view and all; its scripts reach nothing but the report.

    Attributes:
        path: of ``report.html``.
    """

    path: Path

    def _repr_html_(self) -> str:
        page = escape(self.path.read_text(encoding="utf-8"))
        frame = f'sandbox="allow-scripts" width="100%" height="{HEIGHT}" style="border: 1px solid #ccd3da"'
        return f'<iframe title="report" {frame} srcdoc="{page}"></iframe>'


class Metrics(dict):
    """Results by name, each with its unit; it shows itself as a table."""

    def _repr_html_(self) -> str:
        records = {name: {"value": found.value, "unit": found.unit} for name, found in self.items()}
        return _metrics(records)


def case_html(name: str, title: str, values: Mapping[str, Any]) -> str:
    """Return a case: its title, and every value, folded."""
    return heading(name, title) + folded(f"{len(values)} parameters", table(("key", "value"), values.items()), False)


def plan_html(stages: Mapping[str, Any], effects: Mapping[str, Mapping[str, Any]], seconds: float) -> str:
    """Return a plan: what each stage would do and cost, and which effects act."""
    from reflowshock.workflow.case.text import duration

    rows = [
        (name, "run", duration(stage.seconds) if stage.seconds else "", stage.why)
        if stage.runs
        else (name, "skip", "", stage.why)
        for name, stage in stages.items()
    ]
    rows.append(("all", "", duration(seconds) if seconds else "", "with nothing else to do"))
    acting = [(_words(name), "on" if found["on"] else "off", found["why"]) for name, found in effects.items()]
    shown = table(("stage", "", "predicted", "why"), rows)
    return shown + folded(f"{len(acting)} effects", table(("effect", "", "why"), acting), False)


def run_html(summary: Mapping[str, Any], title: str, picture: bytes | None) -> str:
    """Return a run: its answer, its figures, its health, and a picture of the meshes where there is one.

    Args:
        summary: of ``summary.json``.
        title: of the case.
        picture: as PNG.
    """
    missed = [_words(name) for name, check in summary["health"].items() if not check["ok"]]
    held = f"all {len(summary['health'])} health checks held"
    health = f"health checks missed: {', '.join(missed)}" if missed else held
    parts = [heading(summary["case"], title), _paragraph(summary.get("answer", "")), _paragraph(health)]
    if picture is not None:
        encoded = base64.b64encode(picture).decode()
        parts.append(f'<img alt="mesh of board and package" width="480" src="data:image/png;base64,{encoded}">')
    return "".join([*parts, _metrics(summary["metrics"])])


def heading(name: str, title: str) -> str:
    """Return a case's name and title."""
    return f"<p><b>{escape(name)}</b> {escape(title)}</p>"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table of texts."""
    cells = "".join(f"<tr>{''.join(f'<td>{escape(str(cell))}</td>' for cell in row)}</tr>" for row in rows)
    titles = "".join(f"<th>{escape(one)}</th>" for one in head)
    return f"<table><thead><tr>{titles}</tr></thead><tbody>{cells}</tbody></table>"


def folded(title: str, inside: str, opened: bool = True) -> str:
    """Return something that a click unfolds."""
    return f"<details{' open' if opened else ''}><summary>{escape(title)}</summary>{inside}</details>"


def _metrics(records: Mapping[str, dict]) -> str:
    """Return metrics, each with its value and unit, in units that engineers read; many are folded."""
    from reflowshock.workflow.report.tables import named_quantity

    rows = [(_words(name), named_quantity(dict(records), name)) for name in records]
    return folded(f"{len(rows)} metrics", table(("", "value"), rows), len(rows) <= FIRST)


def _paragraph(text: str) -> str:
    return f"<p>{escape(text)}</p>" if text else ""


def _words(name: str) -> str:
    return name.replace("_", " ")
