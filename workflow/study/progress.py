"""Progress of a study: forecast of its products; completed and failed points; remaining time."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from reflowshock.workflow.case.text import duration
from reflowshock.workflow.jobs.batch import Job
from reflowshock.workflow.kinds import stage_seconds
from reflowshock.workflow.process.terminal import ProgressBar, console
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store


def progress_reporter(
    store: Store,
    points: Sequence[Point],
    jobs: Sequence[Job],
    bar: ProgressBar,
    at_first: Callable[[Point], None] = lambda _: None,
) -> Callable[[], None]:
    """Return a function that updates a progress bar, or without a terminal prints a line for each completed point.

    The remaining time assumes that a missing product takes as long as the mean product of its stage so far, and that
    the number of parallel jobs stays the same.

    Args:
        store: Store: the folder of all products of a run or study.
        points: All points of the study (cases with their settings).
        jobs: Missing products.
        bar: Progress bar.
        at_first: Function that is called once, with the first complete point.

    Returns:
        Function without arguments, to be called every second.
    """
    begin = time.monotonic()
    first = [at_first]
    waiting, seconds, printed = list(jobs), dict[str, list[float]](), [""]

    def report() -> None:
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
        if not console.is_terminal and words != printed[0]:
            console.print(f"       {line}")
        printed[0] = words

    return report


def seconds_left(waiting: Sequence[str], done: dict[str, list[float]], elapsed: float) -> float | None:
    """Return the remaining wall time [s]; None before the first product.

    Args:
        waiting: Stages of the missing products.
        done: Stage -> wall times of its products so far [s].
        elapsed: Wall time in which these were computed [s].
    """
    times = [value for stage_times in done.values() for value in stage_times]
    if not times:
        return None
    mean = sum(times) / len(times)
    rest = sum(sum(stage_times) / len(stage_times) if (stage_times := done.get(stage)) else mean for stage in waiting)
    return rest * elapsed / max(sum(times), 1e-9)


@dataclass(frozen=True, slots=True)
class StageForecast:
    """Forecast of the products of one stage.

    Attributes:
        stage: Name of the stage.
        points: Number of points that need a product.
        products: Number of distinct products.
        missing: Number of products to compute.
        seconds: Predicted wall time of the missing products, computed one after the other [s]; None without a forecast.
    """

    stage: str
    points: int
    products: int
    missing: int
    seconds: float | None


def forecast_stages(points: Sequence[Point], jobs: Sequence[Job]) -> list[StageForecast]:
    """Predict the products of a study and their cost, stage by stage.

    Args:
        points: All points of the study (cases with their settings).
        jobs: Missing products.

    Returns:
        One forecast per stage: numbers of points and products, and predicted wall time [s].
    """
    forecasts = []
    for stage in dict.fromkeys(name for point in points for name in point.case.pipeline.names):
        digests = [point.digests[stage] for point in points if stage in point.digests]
        stage_jobs = [job for job in jobs if job.stage == stage]
        predicted = [stage_seconds(job.point.case).get(stage) for job in stage_jobs]
        times = [seconds for seconds in predicted if seconds is not None]
        total = sum(times) if times else None
        forecasts.append(StageForecast(stage, len(digests), len(set(digests)), len(stage_jobs), total))
    return forecasts
