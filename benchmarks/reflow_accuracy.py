"""Work-precision of the sessile drop: error against cost for spacing, time step, basis, mode and scheme.

Run: .venv/bin/python benchmarks/reflow_accuracy.py --quick     (a minute; coarse drops)
     .venv/bin/python benchmarks/reflow_accuracy.py             (quarter of an hour; to benchmarks/results)
     .venv/bin/python benchmarks/reflow_accuracy.py --publish   (and to cases/sessile_drop: README, report)
     .venv/bin/python benchmarks/reflow_accuracy.py --publish --stored   (draws what is stored again)
Seconds are those of the processor: of one core with NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1. 1 mm^3 without gravity,
errors relative to the spherical cap. Runs with inertia take the values that Hu et al. print, and end when the drop is
at rest or at `end_time`; the table says which, and where a run fails.
"""

import argparse
import json
import platform
from collections.abc import Iterable
from pathlib import Path
from time import process_time

import numpy as np

from particles.drop_at_rest import flow_to_rest
from particles.flow import LiquidFlow
from particles.incompressibility import SolveFailed
from particles.mls import DegenerateStencil
from particles.parameters import Solder, SolderEffects, SolderNumerics
from particles.rest import CALM_STEPS, NoRest, Run
from particles.scenes import Drop
from particles.time_step import StepCollapsed
from particles.young_laplace import sessile_meridian
from workflow import work_precision

RESULTS = Path(__file__).parent / "results" / "reflow_accuracy.json"
FAILURES = (NoRest, DegenerateStencil, SolveFailed, StepCollapsed, FloatingPointError)
VOLUME = 1e-9
ORDER_FROM = 11
PAPER = {"surface_tension": 4.985, "viscosity": 0.227}
DEFAULTS = {
    "scheme": "energy",
    "mode": "quasi-static",
    "basis": "quadratic",
    "time_step_limit": 100.0,
    "end_time": 60.0,
}
INERTIA = {"vary": "mode", "mode": "inertia", "end_time": 0.1}
GRIPC = {"vary": "scheme", "scheme": "gripc", "mode": "inertia", "time_step_limit": 0.5, "end_time": 0.005}
LINEAR = GRIPC | {"vary": "basis", "basis": "linear"}
FULL = (
    *({"vary": "spacing", "contact_angle": d, "per_edge": n} for n in (7, 11, 15, 21) for d in (60, 120)),
    *({"vary": "time step", "contact_angle": 60, "per_edge": 11, "time_step_limit": x} for x in (5.0, 20.0)),
    *({"contact_angle": d, "per_edge": 11} | INERTIA for d in (60, 120)),
    *({"contact_angle": d, "per_edge": 7} | scheme for scheme in (GRIPC, LINEAR) for d in (60, 120)),
)
QUICK = (
    *({"vary": "spacing", "contact_angle": d, "per_edge": n} for n in (5, 7) for d in (60, 120)),
    {"vary": "time step", "contact_angle": 60, "per_edge": 7, "time_step_limit": 20.0},
    {"contact_angle": 120, "per_edge": 5} | INERTIA,
    *({"contact_angle": 60, "per_edge": 5} | scheme for scheme in (GRIPC, LINEAR)),
)


def molten(choice: dict) -> Solder:
    """The solder of a row of the table."""
    inertia = choice["mode"] == "inertia"
    names = ("scheme", "basis", "time_step_limit")
    return Solder(
        volume=VOLUME,
        pad_contact_angle=np.radians(choice["contact_angle"]),
        effects=SolderEffects(gravity="off", inertia="on" if inertia else "auto"),
        process_time=choice["end_time"],
        numerics=SolderNumerics(max_steps=20000 if inertia else 1000, **{name: choice[name] for name in names}),
        **(PAPER if inertia else {}),
    )


def measure(job: dict) -> dict:
    """Solve one drop, with `DEFAULTS` but for the choices of the job."""
    row = DEFAULTS | job
    solder, steps = molten(row), Progress()
    drop = Drop(volume=VOLUME, contact_angle=solder.pad_contact_angle, particles_per_edge=row["per_edge"])
    start = process_time()
    try:
        flow, run = flow_to_rest(drop, solder, progress=steps)
    except FAILURES as failure:
        end = f"{type(failure).__name__} in step {steps.count + 1}"
        return row | {"steps": steps.count, "seconds": process_time() - start, "end": end, "message": str(failure)}
    return row | result(solder, flow, run, process_time() - start)


class Progress:
    """Counts steps, also those of a run that fails."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, _fraction: float) -> None:
        self.count += 1


def result(solder: Solder, flow: LiquidFlow, run: Run, seconds: float) -> dict:
    """Errors and cost [s] of a run that came to its end."""
    exact = sessile_meridian(VOLUME, solder.pad_contact_angle, solder.surface_tension)
    count, steps = len(flow.body.points), len(run.records)
    return {
        "height_error": run.profiles[-1].drop_height(walls=1) / exact.height - 1.0,
        "max_width_error": run.profiles[-1].max_width / exact.max_width - 1.0,
        "particles": count,
        "steps": steps,
        "seconds": seconds,
        "end": "at rest" if run.calm >= CALM_STEPS else f"moves after {1e3 * flow.time:.3g} ms",
        "particle_steps_per_second": count * steps / seconds,
    }


def orders(rows: Iterable[dict], coarsest: int) -> dict:
    """Observed orders of the errors in the spacing, from so many particles per edge on: error, angle, order."""
    ladders = [row for row in rows if row["vary"] == "spacing" and row["per_edge"] >= coarsest and "particles" in row]
    found: dict = {name: {} for name in work_precision.ERRORS}
    for degrees in sorted({row["contact_angle"] for row in ladders}):
        ladder = [row for row in ladders if row["contact_angle"] == degrees]
        spacing = [1.0 / (row["per_edge"] - 1) for row in ladder]
        for name in found if len(ladder) > 1 else ():
            errors = [abs(row[name]) for row in ladder]
            found[name][f"{degrees:g} deg"] = float(np.polyfit(np.log(spacing), np.log(errors), 1)[0])
    return found


def run_all(jobs: Iterable[dict], coarsest: int) -> dict:
    """Measure the jobs one after the other; what is measured is on disk after each."""
    rows: list[dict] = []
    found: dict = {}
    RESULTS.parent.mkdir(exist_ok=True)
    for job in jobs:
        rows.append(measure(job))
        found = {"machine": platform.machine(), "rows": rows, "orders": orders(rows, coarsest)}
        RESULTS.write_text(json.dumps(found, indent=1) + "\n")
        print(" | ".join(work_precision.table({"rows": rows[-1:]})["rows"][0]), flush=True)
    return found


def compile_kernels() -> None:
    """Solve a small drop of each kind, so that no row pays for compilation (by the seed's scheme until it fails)."""
    for choice in ({}, INERTIA, GRIPC, LINEAR):
        measure({"contact_angle": 60, "per_edge": 5} | choice)


def main() -> None:
    """Measure, or take what is stored; write JSON, table and plot."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a short ladder of coarse drops")
    parser.add_argument("--stored", action="store_true", help="measure nothing, take the stored rows")
    parser.add_argument("--publish", action="store_true", help="write to cases/sessile_drop as well")
    options = parser.parse_args()
    if options.stored:
        found = work_precision.stored()
    else:
        compile_kernels()
        found = run_all(*((QUICK, 5) if options.quick else (FULL, ORDER_FROM)))
        RESULTS.with_suffix(".md").write_text(work_precision.markdown(found) + "\n")
        work_precision.save_picture(found, RESULTS.with_suffix(".png"))
    if options.publish:
        work_precision.publish(found)


if __name__ == "__main__":
    main()
