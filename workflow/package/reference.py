"""Reference design of a verdict: the run of a design that is known to survive, and checks that its figures are usable.

The figures are the metrics of its shock, whose record is an input file of the report alone.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from reflowshock.problem import Problem
from reflowshock.workflow.case.case import FULL, Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.run import StageError
from reflowshock.workflow.case.toml_file import read_toml, resolved_path
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import RECORD, read_record
from reflowshock.workflow.store.state import StageState, examine, why_stale
from reflowshock.workflow.store.store import HOME, Store, read_case_table

if TYPE_CHECKING:
    from reflowshock.fem.problem.failure import Reference

KEY = "shock.failure.reference.run"
STAGE = "shock"
RUNS = Path("runs")  # where a case runs without --out
ALLOWED = "folder of a complete run of a dropped package, or its case file, relative to the folder of this case file"


def located(shock: dict, folder: Path) -> None:
    """Replace, in place, the run of a reference in the table ``shock`` by the absolute path of its run folder.

    Args:
        shock: Table of a case file.
        folder: Folder of the case file, which relative paths refer to.

    Raises:
        CaseError: The run is a case file that cannot be read.
    """
    failure = shock.get("failure")
    reference = failure.get("reference") if isinstance(failure, dict) else None
    if not isinstance(reference, dict) or not isinstance(reference.get("run"), str) or not reference["run"]:
        return
    path = Path(resolved_path(folder, reference["run"]))
    reference["run"] = str(_run_folder(path) if path.suffix == ".toml" else path)


def _run_folder(case_file: Path) -> Path:
    """Return the default run folder of a case file."""
    try:
        table = read_toml(case_file)
        name, scale = table["case"]["name"], table.get("scale", FULL)
    except CaseError as error:
        raise CaseError(str(case_file), [Problem(KEY, error.problems[0].message, str(case_file), ALLOWED)]) from error
    except (KeyError, TypeError) as error:
        message = "is a case file without case.name"
        raise CaseError(str(case_file), [Problem(KEY, message, str(case_file), ALLOWED)]) from error
    return (RUNS / (f"{name}" if scale == FULL else f"{name}-{scale}")).resolve()


def files(reference: "Reference | None") -> dict[str, Path]:
    """Return the file of a case's reference on which the case depends: the record of the reference's shock.

    Args:
        reference: Run folder of a design with which this one is compared; None without one.

    Returns:
        Dotted key -> path of the record; empty without a reference or without that file.
    """
    path = None if reference is None else Path(reference.run) / STAGE / RECORD
    return {KEY: path} if path is not None and path.is_file() else {}


def metrics_of(reference: "Reference | None") -> Mapping[str, dict] | None:
    """Return the metrics of the shock of a reference design.

    Args:
        reference: Run folder of the design with which this one is compared; None without one.

    Returns:
        Name -> record with ``value`` (SI) and ``unit``; None without a reference.

    Raises:
        StageError: The record is missing or damaged.
    """
    if reference is None:
        return None
    record = read_record(Path(reference.run) / STAGE)
    if record is None:
        raise StageError(f"{KEY} = {reference.run}: the record of its shock is missing or damaged; run it again")
    metrics: Mapping[str, dict] = record["metrics"]
    return metrics


def problems(reference: "Reference | None", kind: type[Case]) -> Iterator[Problem]:
    """Yield the problem of a reference that is missing, of another kind, damaged, stale or not healthy.

    Args:
        reference: Reference of a case; None without one.
        kind: Model of the case, which the case of the reference must have, too.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    if reference is not None and (why := _unusable(Path(reference.run), kind)):
        yield Problem(KEY, why, reference.run, ALLOWED)


def _unusable(folder: Path, kind: type[Case]) -> str:
    """Return why a folder cannot be the reference for cases of a kind; empty if it is usable."""
    try:
        table = read_case_table(folder)
    except CaseError as error:
        message = error.problems[0].message if folder.is_dir() else "does not exist"
        return message if error.source == str(folder) else f"is damaged: {error.source} {message}"
    absent = [name for name in (kind.kind, STAGE) if name not in table]
    if absent:
        return f"is not the run of a dropped package: its case has no [{absent[0]}]"
    try:
        point = Point({}, kind.model_validate(table))
    except ValueError:
        return "is stale: it was computed by another version of the program; run it again"
    store = Store(folder, one_run=True)
    if not store.home.is_dir() and (folder.parents[1] / HOME).is_dir():  # a point of a study
        store = Store(folder.parents[1])
    states = examine(store, point)
    stages = [stage.name for stage in point.case.pipeline.upstream(STAGE)]
    return next((text for name in stages if (text := _fault(name, states[name]))), "") or _unhealthy(store, point)


def _fault(stage: str, state: StageState) -> str:
    """Return the fault of the product of a stage of the reference; empty if it is up to date."""
    if state.damaged:
        return f"is damaged: {stage}: {', '.join(state.damaged)}; run it again"
    if state.changes:
        keys = ", ".join(change.key for change in state.changes[:3])
        return f"is stale: {stage}: {keys} changed after it was computed; run it again"
    return f"is stale: {stage}: {why_stale(state)}; run it again" if state.stale else ""


def _unhealthy(store: Store, point: Point) -> str:
    """Return the failed health checks of the reference's shock; empty if all passed."""
    health = (store.record(point, STAGE) or {"health": {}})["health"]
    failed = [name.replace("_", " ") for name, check in health.items() if not check["ok"]]
    return f"failed the health check {', '.join(failed)}, so its figures are unreliable" if failed else ""
