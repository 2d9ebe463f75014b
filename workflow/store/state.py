"""What is there of a case's products: intact, damaged, missing, or made from others than those that are there now."""

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
    """Whether a stage has to run, and why.

    Attributes:
        stale: whether it has to run.
        missing: whether the run folder shows no product of it, of these parameters or others.
        changes: its own parameters that differ from those of the product that the run folder shows.
        because_of: stages before it that have to run, or have made something else than what it read.
        damaged: what is wrong with the files of its product, in words.
    """

    stale: bool
    missing: bool
    changes: tuple[Change, ...] = ()
    because_of: tuple[str, ...] = ()
    damaged: tuple[str, ...] = ()


def examine(store: Store, point: Point) -> dict[str, StageState]:
    """Say for each stage, in order, whether it has to run, and why; every file of every product is looked at.

    A product that is intact stays when one before it is made again, as long as that comes out the same.
    """
    states: dict[str, StageState] = {}
    shown = shown_records(store, point)
    for stage in point.case.pipeline.stages:
        if store.product(point, stage.name).exists():
            states[stage.name] = _of_product(store, point, stage.name, states)
        else:
            states[stage.name] = _of_absence(point, stage.name, shown, states)
    return states


def _of_product(store: Store, point: Point, name: str, before: Mapping[str, StageState]) -> StageState:
    """Judge a product that is there."""
    stage, product = point.case.pipeline[name], store.product(point, name)
    if found := damage(product):
        return StageState(stale=True, missing=False, damaged=found)
    folders = {one.name: store.product(point, one.name) for one in point.case.pipeline.stages}
    present = reads(folders, point.case, stage)
    was = (store.record(point, name) or {}).get("reads", {})
    redone = tuple(one for one in present if before[one].stale)
    changed = tuple(one for one in present if one not in redone and present[one] != was.get(one))
    if changed:
        return StageState(stale=True, missing=False, because_of=changed)
    # Whether the pads are the same is seen when the geometry is there.
    return StageState(stale=False, missing=False, because_of=() if stage.pads else redone)


def _of_absence(point: Point, name: str, shown: Mapping[str, dict], before: Mapping[str, StageState]) -> StageState:
    """Say why there is no product: what differs from the one that the run folder shows."""
    stage = point.case.pipeline[name]
    if name not in shown:
        return StageState(stale=True, missing=True)
    changes = compare(shown[name].get("inputs", {}), stage_inputs(point.case, stage))
    because_of = tuple(one for one in stage.follows if before[one].stale or _differs(shown, one, point))
    return StageState(stale=True, missing=False, changes=changes, because_of=because_of)


def _differs(shown: Mapping[str, dict], name: str, point: Point) -> bool:
    """Whether the run folder shows another product of a stage than the one that is wanted."""
    return name in shown and shown[name].get("key") != point.digests[name]


def why_stale(state: StageState) -> str:
    """Say in a few words why a stage has to run, but for its parameters."""
    if state.damaged:
        return "its product is damaged: " + ", ".join(state.damaged)
    if state.because_of:
        return "it follows " + ", ".join(state.because_of)
    return "it has no product yet"


def failed_checks(store: Store, point: Point, until: str) -> list[str]:
    """List the health checks of stages that did not hold, in words; a stage without a record has not held either."""
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
