"""Preparation of a run that the user starts with Snakemake directly: the jobs, written into its store."""

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from reflowshock.workflow.jobs.batch import BATCH, Machine, list_missing, prepare, write_jobs
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.store.folders import lock_folder
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import discard
from reflowshock.workflow.store.store import Store

_locks = ExitStack()  # holds the lock of the run folder until Snakemake ends


def prepare_run(config: Mapping[str, Any], cores: int) -> tuple[Store, Point]:
    """Read a case and write the jobs for the missing products of its run.

    Args:
        config: Configuration of Snakemake: ``case`` (path) and, optionally, ``set`` (list of "key=value"), ``out`` (run
            folder), ``oversubscribe`` (0 or 1).
        cores: Number of cores for Snakemake.

    Returns:
        Store of the run folder, and the point to make; the folder stays locked until the process ends.

    Raises:
        CaseError: The case or the run folder is invalid.
        RunFolderBusy: Another run is active in the folder.
    """
    oversubscribe = bool(int(config.get("oversubscribe", 0)))
    case = read_case(Path(config["case"]), config.get("set", []), oversubscribe)
    folder = Path(config.get("out", f"runs/{case.run_name}")).resolve()
    store, point = Store(folder, one_run=True), Point({}, case)
    _locks.enter_context(lock_folder(folder, "run", case.case.name))
    jobs = list_missing(store, [point], case.pipeline.names[-1])
    discard(store.home / BATCH)
    for job in jobs:
        prepare(store, job)
    write_jobs(store, jobs, Machine(cores, exclusive=True, oversubscribe=oversubscribe, live=True))
    return store, point
