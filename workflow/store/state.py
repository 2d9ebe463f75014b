"""State of the products of a case: intact, damaged, missing or stale."""

from collections.abc import Mapping
from dataclasses import dataclass

from reflowshock.workflow.case.text import against_limit
from reflowshock.workflow.store.keys import Change, compare, stage_inputs
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import damage
from reflowshock.workflow.store.store import Store, reads
from reflowshock.workflow.store.view import shown_records


@dataclass(frozen=True, slots=True)
class StageState:
    """State of the product of a stage: whether the stage has to run, and why.

    Attributes:
        stale: Whether it has to run.
        missing: Whether the run folder contains no product of the stage, for any parameters.
        changes: Parameters of the stage whose values differ from the product in the run folder.
        because_of: Upstream stages that have to run, or whose products have changed since this stage read them.
        damaged: Messages about damaged or missing files of the product.
    """

    stale: bool
    missing: bool
    changes: tuple[Change, ...] = ()
    because_of: tuple[str, ...] = ()
    damaged: tuple[str, ...] = ()


def examine(store: Store, point: Point) -> dict[str, StageState]:
    """Return the state of each stage, in order, by checking every file of every product; nothing is changed.

    An intact product stays valid when an upstream product is rebuilt with the same content.

    Args:
        store: Store: the folder of all products of a run or study.
        point: Case with its settings.

    Returns:
        Name of a stage -> whether it has to run, and why: missing, damaged files, changed parameters, upstream stages.
    """
    states: dict[str, StageState] = {}
    records = shown_records(store, point)
    for stage in point.case.pipeline.stages:
        if store.product(point, stage.name).exists():
            states[stage.name] = _of_product(store, point, stage.name, states)
        else:
            states[stage.name] = _of_absence(point, stage.name, records, states)
    return states


def _of_product(store: Store, point: Point, name: str, before: Mapping[str, StageState]) -> StageState:
    """Return the state of a stage whose product exists."""
    stage, product = point.case.pipeline[name], store.product(point, name)
    if damages := damage(product):
        return StageState(stale=True, missing=False, damaged=damages)
    folders = {name: store.product(point, name) for name in point.case.pipeline.names}
    present = reads(folders, point.case, stage)
    recorded = (store.record(point, name) or {}).get("reads", {})
    rebuilt = tuple(stage_name for stage_name in present if before[stage_name].stale)
    changed = tuple(key for key in present if key not in rebuilt and present[key] != recorded.get(key))
    if changed:
        return StageState(stale=True, missing=False, because_of=changed)
    # Whether the pads have changed can only be decided once the geometry has been rebuilt.
    return StageState(stale=False, missing=False, because_of=() if stage.pads else rebuilt)


def _of_absence(point: Point, name: str, records: Mapping[str, dict], before: Mapping[str, StageState]) -> StageState:
    """Return why a product is missing: its differences from the product in the run folder."""
    stage = point.case.pipeline[name]
    if name not in records:
        return StageState(stale=True, missing=True)
    changes = compare(records[name].get("inputs", {}), stage_inputs(point.case, stage))
    because_of = tuple(s for s in stage.follows if before[s].stale or _differs(records, s, point))
    return StageState(stale=True, missing=False, changes=changes, because_of=because_of)


def _differs(records: Mapping[str, dict], name: str, point: Point) -> bool:
    """Return whether the product in the run folder has another key than the current one."""
    return name in records and records[name].get("key") != point.digests[name]


def why_stale(state: StageState) -> str:
    """Return in a few words why a stage has to run.

    Args:
        state: State of its product; changed parameters are not listed.
    """
    if state.damaged:
        return "its product is damaged: " + ", ".join(state.damaged)
    if state.because_of:
        return "it follows " + ", ".join(state.because_of)
    return "it has no product yet"


def failed_checks(store: Store, point: Point, until: str) -> list[str]:
    """List the failed health checks of stages as messages; a stage without a record counts as failed.

    Args:
        store: Store: the folder of all products of a run or study.
        point: Point to check.
        until: Last stage to check.
    """
    failures = []
    for stage in point.case.pipeline.upstream(until):
        record = store.record(point, stage.name)
        if record is None:
            failures.append(f"{stage.name}: its product is missing or damaged")
            continue
        for check, result in record["health"].items():
            if not result["ok"]:
                value, limit = against_limit(check, result)
                failures.append(f"{stage.name}: {check.replace('_', ' ')} {value}, limit {limit}")
    return failures
