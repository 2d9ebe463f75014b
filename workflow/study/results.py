"""Results of a study: one row a point; the same columns as CSV and as Parquet, units in their names."""

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from reflowshock.units import QUANTITY
from reflowshock.workflow.case.fields import display_values
from reflowshock.workflow.case.text import against_limit
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store
from reflowshock.workflow.study.study_file import Study

HEALTHY, UNHEALTHY, FAILED, IMPOSSIBLE = "healthy", "unhealthy", "failed", "impossible"
Value = str | float | int | bool | None
FORMULA = ("=", "+", "-", "@", "\t", "\r")  # with which a formula of a spreadsheet begins


@dataclass(frozen=True, slots=True)
class Row:
    """What became of a point.

    Attributes:
        number: its place in the study, from 1.
        key: of its run folder; empty where its case is impossible.
        settings: what varies, dotted key -> text.
        verdict: "healthy", "unhealthy" (a check did not hold), "failed" or "impossible".
        message: which check, why it failed, what is wrong with its case.
        seconds: wall time of all its stages, shared ones included; None where it is not complete.
        metrics: name -> {"value", "unit"}.
    """

    number: int
    key: str
    settings: Mapping[str, str]
    verdict: str
    message: str = ""
    seconds: float | None = None
    metrics: Mapping[str, dict] = field(default_factory=dict)

    @property
    def report(self) -> str:
        """Its report, relative to the folder of the study."""
        return f"points/{self.key}/report.html" if self.verdict in (HEALTHY, UNHEALTHY) else ""


def row_of(number: int, store: Store, point: Point, keys: Sequence[str], failure: str | None) -> Row:
    """Return the row of a point.

    Args:
        number: its place in the study.
        store: where its products are.
        point: the point.
        keys: those that vary.
        failure: why it is not complete; None where it is.
    """
    shown = display_values(point.case)
    settings = {key: shown.get(key, point.settings[key]) for key in keys}
    if failure is not None:
        return Row(number, point.key, settings, FAILED, failure)
    summary = json.loads((store.run_folder(point) / "summary.json").read_text(encoding="utf-8"))
    missed = [_check(name, check) for name, check in summary["health"].items() if not check["ok"]]
    return Row(
        number,
        point.key,
        settings,
        UNHEALTHY if missed else HEALTHY,
        "; ".join(missed),
        sum(summary["timings"].values()),
        summary["metrics"],
    )


def columns(rows: Sequence[Row], study: Study) -> dict[str, list[Value]]:
    """Return the results by column; a unit stands in brackets after the name, metrics are in SI units.

    Columns about points have names that no metric has: a drop's metrics have a ``verdict``, and ``seconds``.
    """
    metrics = dict.fromkeys((name, metric["unit"]) for row in rows for name, metric in row.metrics.items())
    table: dict[str, list[Value]] = {"number": [row.number for row in rows], "point": [row.key for row in rows]}
    for key in study.design.keys:
        unit, values = numbers([row.settings[key] for row in rows])
        table[_titled(key, unit)] = values
    table |= {
        "result": [row.verdict for row in rows],
        "message": [row.message for row in rows],
        "wall_time [s]": [row.seconds for row in rows],
        "report": [row.report for row in rows],
    }
    for name, unit in metrics:
        table[_titled(name, unit)] = [row.metrics.get(name, {"value": None})["value"] for row in rows]
    return table


def numbers(texts: Sequence[str]) -> tuple[str, list[Value]]:
    """Return quantities of one unit as numbers and this unit; other values as they are, without one."""
    found = [QUANTITY.fullmatch(text) for text in texts]
    matches = [match for match in found if match is not None]
    units = {match["unit"] for match in matches}
    if len(matches) < len(texts) or len(units) != 1:
        return "", list(texts)
    return units.pop(), [float(match["number"]) for match in matches]


def write_csv(path: Path, table: Mapping[str, Sequence[Value]]) -> None:
    """Write columns as CSV, the first line has their names; what is missing is empty.

    A text that a spreadsheet would take for a formula has an apostrophe in front, as such programs write it.
    """
    partial = path.with_suffix(".partial")
    with partial.open("w", newline="", encoding="utf-8", errors="backslashreplace") as file:
        writer = csv.writer(file)
        writer.writerow(map(_no_formula, table))
        writer.writerows(map(_no_formula, row) for row in zip(*table.values(), strict=True))
    partial.replace(path)


def _no_formula(value: Value) -> Value:
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULA) else value


def write_parquet(path: Path, table: Mapping[str, Sequence[Value]]) -> None:
    """Write columns as Parquet; what is missing is null."""
    import pyarrow
    from pyarrow import parquet

    partial = path.with_suffix(".partial")
    parquet.write_table(pyarrow.table({name: pyarrow.array(_alike(values)) for name, values in table.items()}), partial)
    partial.replace(path)


def _alike(values: Sequence[Value]) -> list[Value]:
    """Return values of one type: whole numbers among others become floats, all else text."""
    types = {type(value) for value in values if value is not None}
    if len(types) < 2:
        return list(values)
    convert = float if types == {int, float} else str
    return [None if value is None else convert(value) for value in values]


def _titled(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _check(name: str, check: dict) -> str:
    value, limit = against_limit(name, check)
    return f"{name.replace('_', ' ')} {value}, limit {limit}"
