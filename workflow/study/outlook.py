"""What a study will compute: products that are there, that are missing, and what these are foreseen to cost."""

from collections.abc import Sequence
from dataclasses import dataclass

from reflowshock.workflow.jobs.batch import Job
from reflowshock.workflow.kinds import stage_seconds
from reflowshock.workflow.store.point import Point


@dataclass(frozen=True, slots=True)
class StageOutlook:
    """Products of one stage.

    Attributes:
        stage: its name.
        points: number of points that need one.
        products: number of distinct ones.
        missing: number of those that will be computed.
        seconds: wall time [s] foreseen for these, one after the other; None where there is no forecast.
    """

    stage: str
    points: int
    products: int
    missing: int
    seconds: float | None


def outlook(points: Sequence[Point], jobs: Sequence[Job]) -> list[StageOutlook]:
    """Foresee what a study will compute.

    Args:
        points: all of them.
        jobs: the products that are missing.
    """
    found = []
    for stage in dict.fromkeys(name for point in points for name in point.case.pipeline.names):
        wanted = [point.digests[stage] for point in points if stage in point.digests]
        own = [job for job in jobs if job.stage == stage]
        seconds = [stage_seconds(job.point.case).get(stage) for job in own]
        known = [value for value in seconds if value is not None]
        found.append(StageOutlook(stage, len(wanted), len(set(wanted)), len(own), sum(known) if known else None))
    return found
