"""Work-precision of the sessile drop: error against cost for spacing, time step, basis and mode.

Run: .venv/bin/python benchmarks/reflow_accuracy.py   (ten minutes; writes benchmarks/results/reflow_accuracy.json)
1 mm^3, no gravity; errors are relative to the spherical cap. Seconds are those of one core after compilation.
"""

import json
import platform
from pathlib import Path

import numpy as np

from particles.parameters import Solder, SolderEffects, SolderNumerics
from particles.rest import NoRest
from particles.sessile import solve_drop
from particles.young_laplace import sessile_meridian

RESULTS = Path(__file__).parent / "results" / "reflow_accuracy.json"
VOLUME = 1e-9
PER_EDGE = (7, 11, 15, 21)
ORDER_FROM = 11
PAPER = {"surface_tension": 4.985, "viscosity": 0.227, "process_time": 0.1}
VARIANTS = (
    {"vary": "time step", "time_step_limit": 5.0},
    {"vary": "time step", "time_step_limit": 20.0},
    {"vary": "time step", "time_step_limit": 100.0},
    {"vary": "basis", "basis": "linear"},
)


DEFAULTS = {"basis": "quadratic", "time_step_limit": 100.0, "mode": "quasi-static"}


def drop(vary: str, degrees: float, per_edge: int, **choices) -> dict:
    """Solve one drop, with `DEFAULTS` but for the choices; a run that finds no rest is reported as such."""
    choices = DEFAULTS | choices
    inertia = choices["mode"] == "inertia"
    solder = Solder(
        volume=VOLUME,
        pad_contact_angle=np.radians(degrees),
        effects=SolderEffects(gravity="off", inertia="on" if inertia else "auto"),
        numerics=SolderNumerics(basis=choices["basis"], time_step_limit=choices["time_step_limit"], max_steps=1000),
        **(PAPER if inertia else {}),
    )
    row = {"vary": vary, "contact_angle": degrees, "per_edge": per_edge} | choices
    try:
        flow, run = solve_drop(solder, per_edge)
    except NoRest as failure:
        return row | {"failure": str(failure)}
    exact = sessile_meridian(VOLUME, solder.pad_contact_angle, solder.surface_tension)
    count, steps = len(flow.body.points), len(run.records)
    return row | {
        "height_error": run.records[-1].height / exact.height - 1.0,
        "max_width_error": run.profiles[-1].max_width / exact.max_width - 1.0,
        "particles": count,
        "steps": steps,
        "seconds": run.seconds,
        "particle_steps_per_second": count * steps / run.seconds,
    }


def orders(rows: list[dict]) -> dict:
    """Observed order of the width's error in the spacing, from `ORDER_FROM` particles per edge on."""
    found = {}
    for degrees in sorted({row["contact_angle"] for row in rows}):
        ladder = [row for row in rows if row["contact_angle"] == degrees and row["per_edge"] >= ORDER_FROM]
        spacing = [1.0 / (row["per_edge"] - 1) for row in ladder]
        errors = [abs(row["max_width_error"]) for row in ladder]
        if len(ladder) > 1:
            found[f"{degrees:g} deg"] = float(np.polyfit(np.log(spacing), np.log(errors), 1)[0])
    return found


def main() -> None:
    """Run the ladders and write the table."""
    drop("spacing", 60, 5)
    drop("spacing", 60, 5, basis="linear")
    jobs = [{"vary": "spacing", "degrees": d, "per_edge": n} for n in PER_EDGE for d in (60, 120)]
    jobs[4:4] = [{"degrees": 60, "per_edge": 11} | variant for variant in VARIANTS]
    rows: list[dict] = []
    RESULTS.parent.mkdir(exist_ok=True)
    for job in jobs:
        rows.append(drop(**job))
        print("  ".join(f"{name} {value:.4g}" if isinstance(value, float) else f"{name} {value}"
                        for name, value in rows[-1].items()), flush=True)  # fmt: skip
        ladder = [row for row in rows if row["vary"] == "spacing" and "failure" not in row]
        result = {"machine": platform.machine(), "rows": rows, "width_orders": orders(ladder)}
        RESULTS.write_text(json.dumps(result, indent=1) + "\n")
    print(result["width_orders"])


if __name__ == "__main__":
    main()
