"""Estimated errors of drops against the change to elements 0.75 times as large.

    PYTHONPATH=. python benchmarks/estimated_errors.py [CASE ...]  (half an hour on two cores; estimated_errors.json)

Each drop runs with its companions on coarser meshes, which give every figure an error, and once more with all elements
0.75 times as large. The error should cover the change for nine of ten figures, and be at most four times it in the
median. Figures of watch points count only if they are read at their point.
"""

import argparse
import tempfile
from pathlib import Path
from statistics import median

from benchmarks.support import results, turns
from reflowshock.workflow.convergence.drop_companions import resized_drop
from reflowshock.workflow.convergence.error_estimate import FILE, first_model
from reflowshock.workflow.convergence.figures import drop_figures, reading_distances
from reflowshock.workflow.jobs.batch import Machine, run_points
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.process.environment import available_cores
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.store.folders import lock_folder
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store

RESULTS = "estimated_errors"
ROOT = Path(__file__).parents[1]
FINER = 0.75  # element size relative to the case
COVERED, MEDIAN = 0.9, 4.0  # least share of covered figures, largest median of error over change
DROPS = {
    "small": (ROOT / "tests/pipeline/small.toml", ["numerics.error.method=estimate"]),
    "bga_drop": (ROOT / "cases/bga_drop/case.toml", ["scale=quick"]),
    "jedec_bga": (ROOT / "cases/jedec_bga/case.toml", ["scale=quick"]),
}


def check_drop(name: str, folder: Path) -> dict[str, dict]:
    """Return the estimated errors of each figure of a drop, and its relative change on the finer mesh.

    Args:
        name: Name of the drop, a key of ``DROPS``.
        folder: Empty folder of the run.
    """
    path, settings = DROPS[name]
    case = read_case(path, settings)
    assert isinstance(case, BoardDropCase)
    store, point, machine = Store(folder, one_run=True), Point({}, case), Machine(available_cores(), exclusive=True)
    with lock_folder(folder, "run", name) as lock:
        run_points(store, [point], "errors", machine, lock)
        shock = store.product(point, "shock")
        finer = Point({}, resized_drop(case, shock, FINER))
        run_points(store, [finer], "shock", machine, lock)
    main = first_model(shock)
    errors = read_json(store.product(point, "errors") / FILE)
    values, fine = drop_figures(main, main), drop_figures(first_model(store.product(finer, "shock")), main)
    moved = reading_distances(case, main)
    return {
        figure: errors[figure] | {"change": abs(fine[figure] / value - 1.0)}
        for figure, value in values.items()
        if errors[figure]["discretisation"] is not None and figure.partition("@")[2] not in moved
    }


def bars(checked: dict[str, dict[str, dict]]) -> dict[str, dict]:
    """Return covered share and median ratio of all figures of all drops, with their limits."""
    figures = [figure for drop in checked.values() for figure in drop.values() if figure["change"]]
    ratios = [figure["discretisation"] / figure["change"] for figure in figures]
    covered = sum(ratio >= 1.0 for ratio in ratios) / len(ratios)
    return {
        "share of figures whose error covers the change": turns.bar(covered, COVERED, True),
        "error over change, median": turns.bar(median(ratios), MEDIAN, False),
    }


def main() -> None:
    """Check the drops named on the command line and store their figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drops", nargs="*", metavar="CASE", help=f"cases among {', '.join(DROPS)} (default: all)")
    checked = results.read_figures(RESULTS).get("drops", {})
    for name in parser.parse_args().drops or DROPS:
        with tempfile.TemporaryDirectory() as folder:
            checked[name] = check_drop(name, Path(folder) / "run")
        results.write_and_print(RESULTS, {"drops": checked, "bars": bars(checked)})


if __name__ == "__main__":
    main()
