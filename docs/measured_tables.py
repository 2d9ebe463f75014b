"""Tables of measurements for the site: results of benchmarks and convergence studies, as Markdown.

Nothing is computed here. Figures come from ``benchmarks/results/*.json`` and ``cases/*/accuracy.json``.
"""

import ast
import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from reflowshock.workflow.convergence.accuracy_file import read_accuracy
from reflowshock.workflow.convergence.page import PICTURE, markdown

ROOT = Path(__file__).resolve().parent.parent
LONGEST_LIST = 60  # rows of a table; longer lists are data, not tables


def benchmark_tables() -> Iterator[str]:
    """Yield the Markdown lines of a page with a section for each stored benchmark: purpose, conditions and figures."""
    yield from ("# Results of benchmarks", "")
    yield "The last measurement of each script in [benchmarks](../../benchmarks/README.md). The load is the mean"
    yield from ("number of runnable processes over five minutes, at the start and the end.", "")
    for path in sorted((ROOT / "benchmarks/results").glob("*.json")):
        stored = json.loads(path.read_text())
        yield from (f"## {_words(path.stem).capitalize()}", "", _purpose(path.stem), "")
        yield from (f"*{_conditions(stored['conditions'])}*", "")
        yield from _tables(stored["figures"], path.stem)


def accuracy_tables() -> Iterator[str]:
    """Yield the Markdown lines of a page of stored convergence studies: error against cost, orders, recommendation."""
    yield from ("# Error against cost", "", "Measured by `reflowshock accuracy` for the shipped cases.", "")
    for path in sorted((ROOT / "cases").glob("*/accuracy.json")):
        accuracy = read_accuracy(path)
        if accuracy is None:
            continue
        name = path.parent.name
        yield from (f"## [{name}](../../cases/{name}/README.md)", "")
        if (path.parent / PICTURE).exists():
            yield from (f"![Error against cost of {name}](../../cases/{name}/{PICTURE})", "")
        yield from (markdown(accuracy), "")


def table(head: Iterable[str], rows: Iterable[tuple[str, ...]]) -> Iterator[str]:
    """Yield the lines of a Markdown table, or nothing if it has no rows.

    Args:
        head: Titles of the columns.
        rows: Cells of each row, as texts; vertical bars in them are escaped.
    """
    cells = [[cell.replace("|", r"\|") for cell in row] for row in rows]
    if cells:
        titles = list(head)
        yield from ("| " + " | ".join(row) + " |" for row in (titles, ["---"] * len(titles), *cells))
        yield ""


def _purpose(script: str) -> str:
    """Return the first paragraph of the docstring of a benchmark, with the name of its file."""
    source = ROOT / f"benchmarks/{script}.py"
    words = (ast.get_docstring(ast.parse(source.read_text())) or "") if source.exists() else ""
    return f"`{script}.py`: " + " ".join(words.partition("\n\n")[0].split())


def _conditions(conditions: dict[str, Any]) -> str:
    """Return date, machine and load as one line."""
    loads = (conditions["load_at_start"], conditions["load_at_end"])
    load = "load not recorded" if None in loads else f"load {loads[0]:g} to {loads[1]:g}"
    return f"{conditions['date']}, {conditions['processor']}, {conditions['cores']} cores, {load}"


def _tables(figures: Any, title: str) -> Iterator[str]:
    """Yield the figures of a JSON value: scalars as one table, lists and tables of equal rows as another."""
    if isinstance(figures, list):
        figures = {title: figures}
    scalars = {name: value for name, value in figures.items() if not isinstance(value, dict | list)}
    yield from table(("figure", "value"), ((_words(name), _text(value)) for name, value in scalars.items()))
    for name, value in figures.items():
        rows = _rows(value)
        if rows:
            columns = list(dict.fromkeys(column for row in rows for column in row))
            if name != "rows":
                yield from (f"**{_words(name)}**", "")
            yield from table(map(_words, columns), (tuple(_text(row.get(c)) for c in columns) for row in rows))
        elif isinstance(value, dict) and value:
            yield from (f"**{_words(name)}**", "")
            yield from _tables(value, name)


def _rows(value: Any) -> list[dict[str, Any]]:
    """Return the rows of a table in a JSON value; empty if it is not one."""
    if isinstance(value, dict) and value and all(isinstance(row, dict) and _is_flat(row) for row in value.values()):
        return [{"": name, **row} for name, row in value.items()]
    if isinstance(value, list) and 0 < len(value) <= LONGEST_LIST and all(isinstance(row, dict) for row in value):
        return [{name: cell for name, cell in row.items() if not isinstance(cell, dict | list)} for row in value]
    return []


def _is_flat(row: dict[str, Any]) -> bool:
    return not any(isinstance(cell, dict) or (isinstance(cell, list) and len(cell) > 3) for cell in row.values())


def _words(name: str) -> str:
    return str(name).replace("_", " ")


def _text(value: Any) -> str:
    """Return a JSON value as text, numbers with four digits."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ", ".join(map(_text, value))
    return str(value)
