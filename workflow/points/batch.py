"""Computing points: one Snakemake job for each product that is missing; those that fail leave the others finished."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from workflow.cluster.executor import SAID, Executor, Jobs, Local, Slurm
from workflow.pipeline import locked, snakemake
from workflow.points.point import Point
from workflow.points.store import Store

SNAKEFILE = Path(__file__).parent / "Snakefile"
JOBS = "jobs.json"
UNTRIED = "was not reached"
UNTOLD = "ended without a word, as when it is killed; see {log}"


@dataclass(frozen=True, slots=True)
class Machine:
    """What points are computed with.

    Attributes:
        cores: number of cores that may be used.
        exclusive: one stage at a time, with all cores, for measurements that must not disturb each other.
        oversubscribe: whether MPI may have more ranks than cores.
        slurm: where stages are jobs of a cluster.
    """

    cores: int
    exclusive: bool = False
    oversubscribe: bool = False
    slurm: Slurm | None = None

    @property
    def executor(self) -> Executor:
        """Where stages run."""
        return self.slurm or Local(self.cores, self.oversubscribe)


def machine_of(executor: Local | Slurm) -> Machine:
    """Return what points are computed with where the user chose where stages run."""
    if isinstance(executor, Slurm):
        return Machine(executor.largest, oversubscribe=executor.oversubscribe, slurm=executor)
    return Machine(executor.cores, oversubscribe=executor.oversubscribe)


@dataclass(frozen=True, slots=True)
class Job:
    """A product that is missing.

    Attributes:
        stage: whose product it is.
        point: the first of the points that want it.
        needs: names of the jobs whose products its stage reads.
    """

    stage: str
    point: Point
    needs: tuple[str, ...]

    @property
    def name(self) -> str:
        """``<stage>-<digest>``."""
        return job_name(self.point, self.stage)


@dataclass(frozen=True, slots=True)
class _Task:
    """A job as the Snakefile reads it, paths relative to the store.

    ``pattern`` is the product with ``{digest}`` in place of it; ``moves``: whether it is made elsewhere, in ``work``;
    ``resources``: what it asks a cluster for, if it is a job there.
    """

    stage: str
    needs: tuple[str, ...]
    work: str
    product: str
    pattern: str
    moves: bool
    threads: int
    priority: int
    resources: dict[str, Any]


def job_name(point: Point, stage: str) -> str:
    """Return the name of the job that makes a product."""
    return f"{stage}-{point.digests[stage]}"


def missing(store: Store, points: Sequence[Point], until: str) -> list[Job]:
    """List the products, up to those of one stage, that points want and the store does not have; each once."""
    jobs: dict[str, Job] = {}
    for point in points:
        before: list[str] = []
        for stage in point.case.pipeline.upstream(until):
            name = job_name(point, stage.name)
            if not store.has(point, stage.name):
                jobs.setdefault(name, Job(stage.name, point, tuple(before)))
                before.append(name)
    return list(jobs.values())


def run_points(
    store: Store,
    points: Sequence[Point],
    until: str,
    machine: Machine,
    each_second: Callable[[], None] | None = None,
) -> dict[str, str]:
    """Compute what is missing of points; what is there is never computed again.

    Should this process be killed, all that is complete stays, and checkpoints of stages that were at work.

    Args:
        store: where products are.
        points: what is wanted.
        until: the last stage.
        machine: what they are computed with.
        each_second: called while points are computed, and once more in the end.

    Returns:
        Key of each point that is not complete -> the stage that failed, and why.

    Raises:
        RunFolderBusy: another process is at work in the store.
        CaseError: the store cannot be made or written to.
    """
    with locked(store.folder) as lock:
        jobs = missing(store, points, until)
        for point in points:
            store.prepare(point)
        if jobs:
            for job in jobs:
                store.prepare_work(job.point, job.stage)
                _log(store, job.name).unlink(missing_ok=True)
            _write(store, jobs, machine)
            options = ("--snakefile", str(SNAKEFILE), "--keep-going", "--scheduler", "greedy")
            config = ("--config", f"oversubscribe={int(machine.oversubscribe)}", f"cluster={int(bool(machine.slurm))}")
            snakemake(store.folder.resolve(), machine.executor, [*options, *config], lock, each_second)
    return {point.key: why(store, point, until) for point in points if not store.is_complete(point, until)}


def why(store: Store, point: Point, until: str) -> str:
    """Say why a point is not complete: the first of its stages without a product, and what it said when it failed."""
    stage = next(stage.name for stage in point.case.pipeline.upstream(until) if not store.has(point, stage.name))
    log = _log(store, job_name(point, stage))
    by_cluster = f"; see {store.folder / SAID}" if (store.folder / SAID).is_file() else ""
    untold = (UNTOLD.format(log=log) if log.exists() else UNTRIED) + by_cluster
    return f"stage {stage}: {store.message(point, stage) or untold}"


def _log(store: Store, job: str) -> Path:
    """Return the file that takes what a job says, as the Snakefile names it."""
    return store.folder / "logs" / f"{job}.txt"


def _write(store: Store, jobs: Sequence[Job], machine: Machine) -> None:
    """Write the jobs for the Snakefile; later stages first, so that points are complete one after the other."""
    tasks = {}
    wanted = {job.point.key: machine.executor.jobs(job.point.case) for job in jobs}
    for job in jobs:
        work, folder = store.work_folder(job.point, job.stage), store.stage_folder(job.point.case, job.stage)
        product = str(folder.relative_to(store.folder))
        tasks[job.name] = _Task(
            stage=job.stage,
            needs=job.needs,
            work=str(work.relative_to(store.folder)),
            product=product,
            pattern=product.replace(job.point.digests[job.stage], "{digest}"),
            moves=folder.parent != work,
            threads=_threads(job, jobs, machine, wanted[job.point.key]),
            priority=job.point.case.pipeline.names.index(job.stage),
            resources=wanted[job.point.key].get(job.stage, {}),
        )
    written = {name: asdict(task) for name, task in tasks.items()}
    (store.folder / JOBS).write_text(json.dumps(written, indent=1) + "\n", encoding="utf-8")


def _threads(job: Job, jobs: Sequence[Job], machine: Machine, wanted: Jobs) -> int:
    """Return the cores of a job: a shock's are its ranks, a reflow has its share, other stages are serial."""
    if machine.slurm:
        return wanted[job.stage]["cpus_per_task"] if job.stage in wanted else 1
    if machine.exclusive:
        return machine.cores
    if job.stage == "shock":
        return min(machine.cores, job.point.case.ranks)
    if job.stage == "reflow":
        return max(1, machine.cores // sum(other.stage == job.stage for other in jobs))
    return 1
