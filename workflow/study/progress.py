"""How far a study is: what will be computed; points done, points failed, time left."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from reflowshock.workflow.case.text import duration
from reflowshock.workflow.jobs.batch import Job
from reflowshock.workflow.kinds import stage_seconds
from reflowshock.workflow.process.terminal import ProgressBar, console
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store


def teller(
    store: Store,
    points: Sequence[Point],
    jobs: Sequence[Job],
    bar: ProgressBar,
    at_first: Callable[[Point], None] = lambda _: None,
) -> Callable[[], None]:
    """Return what tells a progress bar, when called, how far a study is; without a terminal a line for each point.

    Time left: each missing product takes as long as the mean of those of its stage that were made since the start, and
    as many are made at a time as so far.

    Args:
        store: where products are made.
        points: all of them.
        jobs: the products that are missing.
        bar: the progress bar.
        at_first: called with the first point that is complete, once.
    """
    begin = time.monotonic()
    first = [at_first]
    waiting, seconds, shown = list(jobs), dict[str, list[float]](), [""]

    def tell() -> None:
        for job in [job for job in waiting if store.has(job.point, job.stage)]:
            record = store.record(job.point, job.stage)
            seconds.setdefault(job.stage, []).append(record["seconds"] if record else 0.0)
            waiting.remove(job)
        done = [point for point in points if store.is_complete(point, point.case.pipeline.names[-1])]
        failed = sum(
            any(store.message(point, stage) for stage in point.digests) for point in points if point not in done
        )
        if done and first:
            first.pop()(done[0])
        left = seconds_left([job.stage for job in waiting], seconds, time.monotonic() - begin)
        words = f"{len(done)} of {len(points)} points done, {failed} failed"
        line = words if left is None else f"{words}, about {duration(left)} left"
        bar(1.0 - len(waiting) / len(jobs), line)
        if not console.is_terminal and words != shown[0]:
            console.print(f"       {line}")
        shown[0] = words

    return tell


def seconds_left(waiting: Sequence[str], done: dict[str, list[float]], elapsed: float) -> float | None:
    """Return the wall time [s] that the rest will take; None before anything is done.

    Args:
        waiting: stages of the products that are missing.
        done: stage -> wall times [s] of its products made so far.
        elapsed: wall time [s] in which they were made.
    """
    every = [value for own in done.values() for value in own]
    if not every:
        return None
    mean = sum(every) / len(every)
    rest = sum(sum(own) / len(own) if (own := done.get(stage)) else mean for stage in waiting)
    return rest * elapsed / max(sum(every), 1e-9)


@dataclass(frozen=True, slots=True)
class StageOutlook:
    """Products of one stage.

    Attributes:
        stage: its name.
        points: number of points that need one.
        products: number of distinct ones.
        missing: number of those that will be computed.
        seconds: wall time [s] predicted for these, one after the other; None where there is no forecast.
    """

    stage: str
    points: int
    products: int
    missing: int
    seconds: float | None


def outlook(points: Sequence[Point], jobs: Sequence[Job]) -> list[StageOutlook]:
    """Predict what a study will compute.

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
