"""Companions of a point: the same case on coarser meshes, from which the stage errors estimates its errors."""

from collections.abc import Iterable

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.kinds import kind_of, stage_seconds
from reflowshock.workflow.process.environment import available_cores
from reflowshock.workflow.store.companions import UNTIL
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store

OWN = ("geometry", "solder_mesh", UNTIL)  # stages of a companion that depend on its meshes; it shares the others


def companion_points(store: Store, point: Point) -> dict[float, Point]:
    """Return the companions of a point by element size; none before its shock is complete, which decides them."""
    names = point.case.pipeline.names
    if UNTIL not in names or store.record(point, UNTIL) is None:
        return {}
    copies = kind_of(point.case).companions(point.case, store.product(point, UNTIL))
    return {size: Point({}, case) for size, case in copies.items()}


def companion_seconds(store: Store, point: Point) -> dict[float, float]:
    """Predict the wall time of each missing companion on one core [s]; empty if the case has none."""
    points = companion_points(store, point)
    if not points:
        expected = kind_of(point.case).companions(point.case, None)
        return {size: _seconds(case, OWN) for size, case in expected.items()}
    missing = {size: [stage for stage in OWN if not store.has(one, stage)] for size, one in points.items()}
    return {size: _seconds(points[size].case, stages) for size, stages in missing.items() if stages}


def at_once(seconds: Iterable[float]) -> float:
    """Return the wall time of companions that run at once, one core each [s]."""
    times = list(seconds)
    return max(max(times, default=0.0), sum(times) / available_cores())


def _seconds(case: Case, stages: Iterable[str]) -> float:
    """Predict the wall time of some stages of a companion [s]."""
    predicted = stage_seconds(case)
    return sum(predicted[stage] for stage in stages)
