"""Results of a study: one row per point, with the same columns in CSV and Parquet; column names have units."""

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
FORMULA = ("=", "+", "-", "@", "\t", "\r")  # first characters of a spreadsheet formula


@dataclass(frozen=True, slots=True)
class Row:
    """Result of a point.

    Attributes:
        number: Number of the point in the study, from 1.
        key: Key of its run folder; empty if its case is impossible.
        settings: Varied settings, dotted key -> text.
        verdict: "healthy", "unhealthy" (a health check failed), "failed" or "impossible".
        message: Failed checks, failure, or error of its case.
        seconds: Wall time of all its stages including shared ones [s]; None if the point is incomplete.
        metrics: Metric -> {"value", "unit"}.
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
        """Path of the report relative to the folder of the study; empty without one."""
        return f"points/{self.key}/report.html" if self.verdict in (HEALTHY, UNHEALTHY) else ""


def row_of(number: int, store: Store, point: Point, keys: Sequence[str], failure: str | None) -> Row:
    """Return the row of a point, from the summary of its run or from the message of its failure.

    Args:
        number: Number of the point in the study, from 1.
        store: Store of its products, from which ``summary.json`` is read.
        point: Case with its settings.
        keys: Dotted keys that the study varies.
        failure: Message of its failure; None if the point is complete.

    Returns:
        Number, key, varied settings, verdict ("healthy", "unhealthy", "failed"), message, wall time [s] and metrics.
    """
    texts = display_values(point.case)
    settings = {key: texts.get(key, point.settings[key]) for key in keys}
    if failure is not None:
        return Row(number, point.key, settings, FAILED, failure)
    summary = json.loads((store.run_folder(point) / "summary.json").read_text(encoding="utf-8"))
    failed_checks = [_check(name, check) for name, check in summary["health"].items() if not check["ok"]]
    return Row(
        number,
        point.key,
        settings,
        UNHEALTHY if failed_checks else HEALTHY,
        "; ".join(failed_checks),
        sum(summary["timings"]["wall"].values()),
        summary["metrics"],
    )


def columns(rows: Sequence[Row], study: Study) -> dict[str, list[Value]]:
    """Return the results of a study by column, for its CSV and Parquet tables.

    Args:
        rows: Results of the points.
        study: Study with its varied keys.

    Returns:
        Column title -> value of each row, None where it is missing. The columns are number and key of the point, varied
        parameters, result, message, wall time, report, and metrics in SI units; titles end with the unit in brackets.
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
    """Return the common unit of quantities such as "0.8 mm", and their numbers in this unit.

    Args:
        texts: Values as written in a case file.

    Returns:
        Unit and numbers; without a common unit, an empty unit and the texts.
    """
    matches = [match for text in texts if (match := QUANTITY.fullmatch(text)) is not None]
    units = {match["unit"] for match in matches}
    if len(matches) < len(texts) or len(units) != 1:
        return "", list(texts)
    return units.pop(), [float(match["number"]) for match in matches]


def write_csv(path: Path, table: Mapping[str, Sequence[Value]]) -> None:
    """Write columns as CSV with their names in the first line; missing values are empty.

    An apostrophe precedes a text that a spreadsheet would evaluate as a formula.

    Args:
        path: File to write.
        table: Column title -> values, all of the same length.
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
    """Write columns as Parquet; missing values are null.

    Args:
        path: File to write.
        table: Column title -> values, all of the same length.
    """
    import pyarrow
    from pyarrow import parquet

    partial = path.with_suffix(".partial")
    parquet.write_table(
        pyarrow.table({name: pyarrow.array(_uniform(values)) for name, values in table.items()}), partial
    )
    partial.replace(path)


def _uniform(values: Sequence[Value]) -> list[Value]:
    """Return values of one type: mixed numbers become floats, other mixed values texts."""
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
