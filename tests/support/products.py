"""Synthetic products of a store: every file of a stage, with its name as content."""

import shutil
from collections.abc import Iterable
from pathlib import Path

from reflowshock.workflow.case.run import Findings, Run
from reflowshock.workflow.jobs.batch import show_products
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.stage_runner import run_stage
from reflowshock.workflow.store.folders import lock_folder
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import seal
from reflowshock.workflow.store.store import Store
from tests.support.workflow_command import SMALL_CASE

POINT = Point({}, read_case(SMALL_CASE))
OTHER = Point({}, read_case(SMALL_CASE, ["shock.peak_acceleration=1000 G"]))


def make(
    store: Store, point: Point, names: Iterable[str], *, content: str = "", findings: Findings | None = None
) -> None:
    """Make products of stages in order, as their jobs do; each file contains its own name.

    Args:
        store: Store of the products.
        point: Case with its settings.
        names: Names of the stages.
        content: Text appended to the contents of each file.
        findings: Metrics and checks of each stage; None for none.
    """
    for name in names:
        store.prepare_work(point, name)
        work = store.work_folder(point, name)

        def write(run: Run, folder: Path) -> Findings:
            for product in run.case.pipeline[folder.name.split(".")[1]].products:
                path = folder / product.partition("/")[2]
                path.parent.mkdir(exist_ok=True, parents=True)
                path.write_text(product + content)
            return findings or Findings()

        run_stage(name, write, Run(work, point.case, 1), store.product(point, name))
        shutil.rmtree(work)


def record_of(product: Path, **entries: object) -> None:
    """Create a product's folder and seal it with a record, in which ``entries`` replace or add keys."""
    product.mkdir(parents=True, exist_ok=True)
    entries.pop("sha256", None)
    usual = {"seconds": 1.0, "core_seconds": 1.0, "forecast": 2.0, "metrics": {}, "health": {}, "effects": {}}
    seal(product, usual | entries)


def shown_run(folder: Path) -> Store:
    """Make all products of the shortened case in a new run folder, show them there, and return the store."""
    store = Store(folder, one_run=True)
    with lock_folder(store.folder, "run", "small"):
        make(store, POINT, POINT.case.pipeline.names)
        show_products(store, POINT)
    return store
