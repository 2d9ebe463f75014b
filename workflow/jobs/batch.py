"""Batches of products: one Snakemake job per missing product; a failed job does not stop independent jobs."""

import json
import shutil
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from reflowshock.workflow.case.stage import ERRORS
from reflowshock.workflow.jobs.engine import SNAKEMAKE_LOG, JobOutput, failures_of, last_lines, snakemake
from reflowshock.workflow.jobs.executor import Executor, Jobs, Local, Slurm
from reflowshock.workflow.pipeline.companions import companion_points
from reflowshock.workflow.process.terminal import console
from reflowshock.workflow.store.companions import FOLDER, UNTIL, link_companions
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import discard
from reflowshock.workflow.store.state import StageState, examine, why_stale
from reflowshock.workflow.store.store import Store
from reflowshock.workflow.store.view import show

BATCH = "batch"  # folder in the store: jobs, logs and marks of the last call
JOBS = f"{BATCH}/jobs.json"
NOT_STARTED = "was not started"
LEAST_FREE = 2**20  # free bytes below which a full device explains a silent end


@dataclass(frozen=True, slots=True)
class Machine:
    """Resources for computing points.

    Attributes:
        cores: Number of available cores.
        exclusive: Whether stages run one at a time with all cores, for undisturbed measurements.
        oversubscribe: Whether MPI may have more ranks than cores.
        slurm: Cluster executor, or None for this machine.
        live: Whether stages show their progress on the terminal.
        each_second: Function called every second during the computation, and once at the end.
    """

    cores: int
    exclusive: bool = False
    oversubscribe: bool = False
    slurm: Slurm | None = None
    live: bool = False
    each_second: Callable[[], None] | None = None

    @property
    def executor(self) -> Executor:
        """Executor of the stages."""
        return self.slurm or Local(self.cores, self.oversubscribe)


def machine_of(executor: Executor, *, one_run: bool = False) -> Machine:
    """Return the resources for computing points with a chosen executor.

    Args:
        executor: Executor of the stages.
        one_run: Whether only one point is computed: its stages show their progress and, on this machine, use all cores.
    """
    return Machine(
        cores=executor.largest,
        exclusive=one_run and executor.cluster is None,
        oversubscribe=executor.oversubscribe,
        slurm=executor.cluster,
        live=one_run,
    )


@dataclass(frozen=True, slots=True)
class Job:
    """Product to be made.

    Attributes:
        stage: Stage that makes the product.
        point: First point that needs the product.
        needs: Names of the jobs whose products the stage reads.
        is_of_companion: Whether the point is a companion, which runs at the same time as the others.
    """

    stage: str
    point: Point
    needs: tuple[str, ...]
    is_of_companion: bool = False

    @property
    def name(self) -> str:
        """``<stage>-<key>``."""
        return job_name(self.point, self.stage)


@dataclass(frozen=True, slots=True)
class _Task:
    """Job as the Snakefile reads it, paths relative to the home of the store.

    ``live``: whether the job shows its progress on the terminal; ``resources``: resources requested from a cluster.
    """

    stage: str
    needs: tuple[str, ...]
    threads: int
    priority: int
    live: bool
    resources: dict[str, Any]


def job_name(point: Point, stage: str) -> str:
    """Return the name of the job that makes the product of a stage: ``<stage>-<key>`` with the point's key."""
    return f"{stage}-{point.digests[stage]}"


def list_missing(store: Store, points: Sequence[Point], until: str, tried: Collection[str] = ()) -> list[Job]:
    """List the jobs for products of points that can be made now, without duplicates, in the order of the stages.

    A product is made if it is missing, stale or damaged. Errors are estimated in three steps: the shock decides the
    companions, these run, then the stage errors reads them.

    Args:
        store: Store of the products, which is examined.
        points: Points of the run or study.
        until: Last stage to make.
        tried: Names of jobs that have been tried; a companion whose job has failed is not tried again.
    """
    jobs: dict[str, Job] = {}
    for point in points:
        for job in _next_jobs(store, point, until, tried):
            jobs.setdefault(job.name, job)
    return list(jobs.values())


def _next_jobs(store: Store, point: Point, until: str, tried: Collection[str]) -> Iterator[Job]:
    states = examine(store, point)
    stages = [stage.name for stage in point.case.pipeline.upstream(until) if states[stage.name].stale]
    if ERRORS.name not in stages:
        yield from _jobs(point, stages)
    elif states[UNTIL].stale:
        yield from _jobs(point, stages[: stages.index(ERRORS.name)])
    else:
        waiting = [job for other in companion_points(store, point).values() for job in _companion_jobs(store, other)]
        yield from _untried(waiting, tried) or _jobs(point, stages)


def _companion_jobs(store: Store, companion: Point) -> list[Job]:
    """Return the jobs of the missing products of a companion."""
    states = examine(store, companion)
    stages = [stage.name for stage in companion.case.pipeline.upstream(UNTIL) if states[stage.name].stale]
    return _jobs(companion, stages, is_of_companion=True)


def _jobs(point: Point, stages: Sequence[str], *, is_of_companion: bool = False) -> list[Job]:
    """Return the jobs of some stages, each of which needs those before it."""
    names = [job_name(point, stage) for stage in stages]
    return [Job(stage, point, tuple(names[:k]), is_of_companion) for k, stage in enumerate(stages)]


def show_products(store: Store, point: Point) -> list[str]:
    """Link all intact, current products of a point and its companions into its run folder; return restored files."""
    companions = {
        f"{FOLDER}/{name}": (companion, _current(store, companion))
        for name, companion in companion_points(store, point).items()
    }
    return show(store, point, _current(store, point), companions)


def _current(store: Store, point: Point) -> list[str]:
    """Return the stages whose products are intact and current."""
    return [name for name, state in examine(store, point).items() if not (state.stale or state.because_of)]


def prepare(store: Store, job: Job) -> None:
    """Create the work folder of a job with links to the products that its stage reads."""
    store.prepare_work(job.point, job.stage)
    if job.stage == ERRORS.name:
        link_companions(store, store.work_folder(job.point, job.stage), companion_points(store, job.point))


def run_points(
    store: Store,
    points: Sequence[Point],
    until: str,
    machine: Machine,
    lock: int,
) -> dict[str, str]:
    """Make all missing or damaged products of points; intact products are never computed again.

    If this process is killed, complete products and the checkpoints of running stages stay. A product made from a
    damaged one is rebuilt only if the repaired product differs from the original.

    Args:
        store: Store of the products.
        points: Points to complete.
        until: Last stage to run.
        machine: Cores and executor.
        lock: File descriptor that ``locked`` yields for the folder of the store.

    Returns:
        Product key of each incomplete point -> reason of its failure; empty if all are complete.

    Raises:
        RunFolderBusy: Jobs of an earlier command are still running in the store.
    """
    tried: set[str] = set()
    try:
        while jobs := _untried(list_missing(store, points, until, tried), tried):
            tried |= {job.name for job in jobs}
            for point in points:
                show_products(store, point)
            _run(store, jobs, machine, lock)
    finally:
        for point in points:
            show_products(store, point)
    return {point.key: reason for point in points if (reason := failure_message(store, point, until))}


def _untried(jobs: Sequence[Job], tried: Collection[str]) -> list[Job]:
    """Return the jobs that have not been tried and do not need one that has been tried in vain."""
    return [job for job in jobs if job.name not in tried and not any(name in tried for name in job.needs)]


def failure_message(store: Store, point: Point, until: str) -> str:
    """Return the first missing stage of an incomplete point and its message; empty if the point is complete.

    Args:
        store: Store of the products.
        point: Point to examine.
        until: Last stage that was requested.
    """
    failure = failure_of(store, point, until)
    return f"stage {failure[0]}: {failure[1]}" if failure else ""


def failure_of(store: Store, point: Point, until: str) -> tuple[str, str] | None:
    """Return the first missing stage of a point and the reason, or None if all stages exist.

    Args:
        store: Store of the products.
        point: Point to examine.
        until: Last stage that was requested.

    Returns:
        Name of the stage and reason, or None if the products of all stages up to the last one exist.
    """
    states = examine(store, point)
    stale_stages = [stage.name for stage in point.case.pipeline.upstream(until) if states[stage.name].stale]
    if not stale_stages:
        return None
    first = stale_stages[0]
    return first, store.message(point, first) or _describe_silent_end(store, point, first, states[first])


def log_of(store: Store, point: Point, stage: str) -> Path:
    """Return the path of the log file of a job, as named in the Snakefile; it need not exist."""
    return store.home / BATCH / "logs" / f"{job_name(point, stage)}.txt"


def _describe_silent_end(store: Store, point: Point, stage: str, state: StageState) -> str:
    """Describe the end of a stage that left no message."""
    name, output, log = job_name(point, stage), store.home / SNAKEMAKE_LOG, log_of(store, point, stage)
    if by_cluster := failures_of(output).get(name):
        return f"{by_cluster}; see {output}"
    if not log.exists():
        reason = NOT_STARTED if state.missing else f"{NOT_STARTED}: {why_stale(state)}"
        return f"{reason}; see {output}\n{last_lines(store.home)}" if output.is_file() else reason
    words = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    last = f'; last output: "{words[-1].strip()}"' if words else ""
    if shutil.disk_usage(store.home).free < LEAST_FREE:
        return f"no space left on the device of {store.home}"
    return f"ended without an error message (it may have been killed){last}; see {log}"


def _run(store: Store, jobs: Sequence[Job], machine: Machine, lock: int) -> None:
    """Run Snakemake once for some jobs; output of cluster jobs is shown as it arrives."""
    discard(store.home / BATCH)
    (store.home / BATCH / "logs").mkdir(parents=True)
    for job in jobs:
        prepare(store, job)
    write_jobs(store, jobs, machine)
    if machine.live and any(job.is_of_companion for job in jobs):
        console.print("the same case with larger elements, for its errors …")
    follow = machine.each_second
    if machine.live and machine.slurm:
        follow = JobOutput([log_of(store, job.point, job.stage) for job in jobs]).show
    config = ("--config", f"oversubscribe={int(machine.oversubscribe)}", f"cluster={int(bool(machine.slurm))}")
    try:
        snakemake(store.home.resolve(), machine.executor, ["--scheduler", "greedy", *config], lock, follow)
    finally:
        for job in jobs:
            store.drop_work(job.point, job.stage)


def write_jobs(store: Store, jobs: Sequence[Job], machine: Machine) -> None:
    """Write ``batch/jobs.json`` of a store, the jobs that the Snakefile runs.

    Later stages get priority, so that points complete one by one.
    """
    tasks = {}
    resources = {job.point.key: machine.executor.jobs(job.point.case) for job in jobs}
    for job in jobs:
        tasks[job.name] = _Task(
            stage=job.stage,
            needs=job.needs,
            threads=_threads(job, jobs, machine, resources[job.point.key]),
            priority=job.point.case.pipeline.names.index(job.stage),
            live=machine.live and not machine.slurm and not job.is_of_companion,
            resources=resources[job.point.key].get(job.stage, {}),
        )
    path = store.home / JOBS
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({name: asdict(task) for name, task in tasks.items()}, indent=1) + "\n", encoding="utf-8")


def _threads(job: Job, jobs: Sequence[Job], machine: Machine, resources: Jobs) -> int:
    """Return the cores of a job: the ranks of a shock, an equal share for each reflow, one for other stages.

    Of several shocks each has its least number of ranks, since together they use the cores better.
    """
    if machine.slurm:
        return resources[job.stage]["cpus_per_task"] if job.stage in resources else 1
    if machine.exclusive and job.is_of_companion:
        return max(1, machine.cores // sum(other.stage == job.stage for other in jobs))
    if machine.exclusive:
        return machine.cores
    alike = sum(other.stage == job.stage for other in jobs)
    if job.stage == "shock":
        case = job.point.case
        return min(machine.cores, case.ranks if alike == 1 else case.least_ranks)
    if job.stage == "reflow":
        return max(1, machine.cores // alike)
    return 1
