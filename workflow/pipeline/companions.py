"""Companions of a point: the same case on coarser meshes, run so that the stage errors can estimate its errors."""

from collections.abc import Iterable

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.kinds import kind_of, stage_seconds
from reflowshock.workflow.process.environment import available_cores
from reflowshock.workflow.store.companions import UNTIL
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store


def companion_points(store: Store, point: Point) -> dict[str, Point]:
    """Return the companions of a point by name: the same case on coarser meshes, run to estimate its errors.

    Args:
        store: Store of the products.
        point: Case with settings.

    Returns:
        Points such as ``size_1.5`` and ``size_2``; empty if the case estimates no errors, or before its shock is
        complete, because the shock decides their joints and duration.
    """
    names = point.case.pipeline.names
    if UNTIL not in names or store.record(point, UNTIL) is None:
        return {}
    copies = kind_of(point.case).companions(point.case, store.product(point, UNTIL))
    return {name: Point({}, case) for name, case in copies.items()}


def companion_seconds(store: Store, point: Point) -> dict[str, float]:
    """Predict the wall time of each missing companion (same case on a coarser mesh) on one core, by name [s].

    Stages whose products are shared with the point do not count, nor, once its shock is complete, those in the store.

    Args:
        store: Store of the products.
        point: Case with settings, whose shock may be complete or not.

    Returns:
        Times [s]; empty if the case has no companions or none is missing.
    """
    points = companion_points(store, point)
    if not points:
        expected = kind_of(point.case).companions(point.case, None)
        return {name: _seconds(case, _own_stages(Point({}, case), point)) for name, case in expected.items()}
    missing = {
        name: [stage for stage in _own_stages(companion, point) if not store.has(companion, stage)]
        for name, companion in points.items()
    }
    return {name: _seconds(points[name].case, stages) for name, stages in missing.items() if stages}


def at_once(seconds: Iterable[float]) -> float:
    """Return the wall time of runs that share the cores of this machine, one core each [s].

    It is the longest time, or the sum over the number of available cores if that is larger.

    Args:
        seconds: Wall time of each run on one core [s]; without any the result is 0.
    """
    times = list(seconds)
    return max(max(times, default=0.0), sum(times) / available_cores())


def _own_stages(companion: Point, point: Point) -> list[str]:
    """Return the stages of a companion whose products it does not share with its point."""
    stages = (stage.name for stage in companion.case.pipeline.upstream(UNTIL))
    return [stage for stage in stages if companion.digests[stage] != point.digests[stage]]


def _seconds(case: Case, stages: Iterable[str]) -> float:
    """Predict the wall time of some stages of a companion [s]."""
    predicted = stage_seconds(case)
    return sum(predicted[stage] for stage in stages)
