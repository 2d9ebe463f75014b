"""Staleness by content: what each stage used, what it would use now, and so whether it has to run."""

import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from workflow.case import kind_of
from workflow.case_kind import Case
from workflow.stage_table import Stage

CASE = "inputs/case.json"


@dataclass(frozen=True, slots=True)
class Change:
    """A parameter that has another value than when a stage last ran; SI values, None where it did not exist."""

    key: str
    old: object
    new: object


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a stage has to run, and why.

    Attributes:
        stale: whether it has to run.
        missing: whether it has no product at all.
        changes: its own parameters that changed.
        because_of: stages before it that will run, or ran after it.
    """

    stale: bool
    missing: bool
    changes: tuple[Change, ...]
    because_of: tuple[str, ...]


def stage_inputs(case: Case, stage: Stage) -> dict:
    """Return the parameters that a stage depends on, as dotted key -> SI value; of files, also what they hold."""
    contents = [(f"{key}.sha256", _digest(path)) for key, path in case.files.items()]
    return {
        key: value
        for key, value in [*_flat(case.model_dump(mode="json")), *contents]
        if any(key == prefix or key.startswith(prefix + ".") for prefix in stage.parameters)
    }


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "no such file"


def write_inputs(run_folder: Path, case: Case) -> None:
    """Write the parameters of each stage into ``inputs/``, for Snakemake to compare by modification time.

    A file is rewritten only if its content changes. If a value returns to what the present product was made with,
    the file's time is set back, so that this product counts as up to date again.
    """
    (run_folder / "inputs").mkdir(parents=True, exist_ok=True)
    _write_if_changed(run_folder / CASE, case.model_dump(mode="json"))
    for stage in case.pipeline.stages:
        path, content = run_folder / stage.inputs, stage_inputs(case, stage)
        _write_if_changed(path, content)
        record = read_record(run_folder, stage)
        if record is not None and record["inputs"] == content:
            oldest = min((run_folder / product).stat().st_mtime for product in (stage.record, *stage.products))
            os.utime(path, (oldest, oldest))


def read_case_of_run(run_folder: Path) -> Case:
    """Return the case whose inputs were last written."""
    table = json.loads((run_folder / CASE).read_text(encoding="utf-8"))
    return kind_of(table).model_validate(table)


def read_record(run_folder: Path, stage: Stage) -> dict | None:
    """Return what a stage said of itself; None where it or one of its products is missing."""
    if not all((run_folder / product).exists() for product in (stage.record, *stage.products)):
        return None
    return json.loads((run_folder / stage.record).read_text(encoding="utf-8"))


def examine(run_folder: Path, case: Case) -> dict[str, Verdict]:
    """Say for each stage, in order, whether it would run, and why."""
    verdicts: dict[str, Verdict] = {}
    for stage in case.pipeline.stages:
        record = read_record(run_folder, stage)
        changes = () if record is None else compare(record["inputs"], stage_inputs(case, stage))
        because_of = tuple(
            name for name in stage.follows if verdicts[name].stale or _is_newer(run_folder, case.pipeline[name], stage)
        )
        stale = record is None or bool(changes) or bool(because_of)
        verdicts[stage.name] = Verdict(stale, record is None, changes, because_of)
    return verdicts


def compare(old: dict, new: dict) -> tuple[Change, ...]:
    """List the keys of which two sets of inputs differ, in the order of the new one."""
    keys = [*new, *(key for key in old if key not in new)]
    return tuple(Change(key, old.get(key), new.get(key)) for key in keys if old.get(key) != new.get(key))


def _is_newer(run_folder: Path, before: Stage, after: Stage) -> bool:
    """Whether a stage ran after one that uses its products, as when a run was killed between the two."""
    paths = [run_folder / before.record, run_folder / after.record]
    return all(path.exists() for path in paths) and paths[0].stat().st_mtime > paths[1].stat().st_mtime


def _flat(table: dict, prefix: str = "") -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def _write_if_changed(path: Path, content: dict) -> None:
    text = json.dumps(content, indent=1) + "\n"
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        partial = path.with_suffix(".partial")
        partial.write_text(text, encoding="utf-8")
        partial.replace(path)
