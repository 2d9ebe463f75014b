"""Error against cost of the reflow: spacing, basis, time step; joints and sessile drops.

Run: .venv/bin/python benchmarks/bench_reflow.py   (about three minutes; writes benchmarks/results/reflow.json)
Errors are relative to the Young-Laplace meridian; seconds are those of one core after compilation.
"""

import json
import platform
from pathlib import Path
from time import perf_counter

import numpy as np

from particles.geometry import JointGeometry
from particles.mls import SUPPORT, derivatives
from particles.neighbours import NeighbourList
from particles.parameters import Solder, SolderEffects, SolderNumerics
from particles.reflow import solve_joint
from particles.rest import NoRest
from particles.sessile import solve_drop
from particles.young_laplace import sessile_meridian

RESULTS = Path(__file__).parent / "results" / "reflow.json"
BALL, RADIUS, MM = 0.0724e-9, 0.24e-3, 1e-3
SPACINGS = (0.10, 0.07, 0.05, 0.04, 0.035)
PER_EDGE = (8, 12, 18, 26)
TIME_STEP_LIMITS = (5.0, 20.0, 100.0)
GAPS = tuple(np.linspace(0.28, 0.42, 15))
DROPS = ((60, 7), (60, 9), (60, 11), (90, 11), (120, 7), (120, 9), (120, 11))
COLUMNS = ("width_error", "volume_drift", "particles", "steps", "seconds", "particle_steps_per_second")


def joint(gap: float, numerics: SolderNumerics) -> dict:
    """Solve one joint; a run that finds no rest is reported as such."""
    solder = Solder(volume=BALL, numerics=numerics)
    row = {"gap_mm": gap, "spacing_mm": numerics.spacing / MM, "basis": numerics.basis}
    row["time_step_limit"] = numerics.time_step_limit
    try:
        shape = solve_joint(JointGeometry(gap * MM, RADIUS, RADIUS), solder)
    except NoRest as failure:
        return row | {"failure": str(failure)}
    return row | {"verdict": shape.verdict} | {name: shape.metrics[name][0] for name in COLUMNS}


def drop(degrees: float, count: int) -> dict:
    """Solve one sessile drop without gravity."""
    numerics = SolderNumerics(time_step_limit=100)
    angle = np.radians(degrees)
    solder = Solder(volume=1e-9, pad_contact_angle=angle, effects=SolderEffects(gravity="off"), numerics=numerics)
    flow, run = solve_drop(solder, count)
    exact = sessile_meridian(1e-9, angle, solder.surface_tension)
    return {
        "contact_angle_deg": degrees,
        "per_edge": count,
        "height_error": run.records[-1].height / exact.height - 1.0,
        "width_error": run.profiles[-1].max_width / exact.max_width - 1.0,
        "particles": len(flow.body.points),
        "steps": len(run.records),
        "seconds": run.seconds,
    }


def derivative_errors(basis: str, count: int) -> dict:
    """Relative errors of gradient and Laplacian of sin(2x) cos(y) exp(z) inside a shaken lattice, and their cost."""
    axis, spacing = np.linspace(0.0, 1.0, count), 1.0 / (count - 1)
    points = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    points += np.random.default_rng(13).uniform(-0.1, 0.1, points.shape) * spacing
    inner = np.flatnonzero((np.abs(points - 0.5) < 0.25).all(axis=1)).astype(np.int32)
    neighbours = NeighbourList(SUPPORT[basis] * spacing, 0.0)
    neighbours.update(points)
    start = perf_counter()
    found = derivatives(points, inner, neighbours, basis)
    microseconds = 1e6 * (perf_counter() - start) / len(inner)
    x, y, z = points.T
    field = np.sin(2 * x) * np.cos(y) * np.exp(z)
    slope, laplacian = (2 * np.cos(2 * x) * np.cos(y) * np.exp(z))[inner], -4.0 * field[inner]
    return {
        "basis": basis,
        "per_edge": count,
        "gradient_error": np.linalg.norm(found.gradient[0] @ field - slope) / np.linalg.norm(slope),
        "laplacian_error": np.linalg.norm(found.laplacian @ field - laplacian) / np.linalg.norm(laplacian),
        "microseconds_a_particle": microseconds,
    }


def cost_of_a_step(rows: list[dict]) -> dict:
    """Fit seconds a step = c (n / 1000)^k, the model of `particles.estimate`."""
    rows = [row for row in rows if "seconds" in row]
    count = np.array([row["particles"] for row in rows]) / 1000.0
    seconds = np.array([row["seconds"] / row["steps"] for row in rows])
    exponent, logarithm = np.polyfit(np.log(count), np.log(seconds), 1)
    return {"seconds_per_step_of_thousand": float(np.exp(logarithm)), "exponent": float(exponent)}


def main() -> None:
    """Run the ladders and write the table."""
    joint(0.31, SolderNumerics(spacing=0.1 * MM))
    joint(0.31, SolderNumerics(spacing=0.1 * MM, basis="linear"))
    ladder = [
        joint(0.31, SolderNumerics(spacing=spacing * MM, basis=basis))
        for basis in ("linear", "quadratic")
        for spacing in SPACINGS
    ]
    steps = [joint(0.31, SolderNumerics(time_step_limit=limit)) for limit in TIME_STEP_LIMITS]
    gaps = [joint(gap, SolderNumerics()) for gap in GAPS]
    result = {
        "machine": platform.processor() or platform.machine(),
        "spacing_and_basis": ladder,
        "time_step": steps,
        "gaps": gaps,
        "seconds_of_all_gaps": sum(row["seconds"] for row in gaps),
        "drops": [drop(degrees, count) for degrees, count in DROPS],
        "derivatives": [derivative_errors(basis, count) for basis in SUPPORT for count in PER_EDGE],
        "cost_of_a_step": cost_of_a_step([row for row in ladder if row["basis"] == "quadratic"]),
    }
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(result, indent=1))
    for name in ("spacing_and_basis", "time_step", "gaps", "drops", "derivatives"):
        print(f"\n{name}")
        for row in result[name]:
            print(
                "  ".join(
                    f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}" for key, value in row.items()
                )
            )
    print(result["cost_of_a_step"], f"all gaps {result['seconds_of_all_gaps']:.1f} s")


if __name__ == "__main__":
    main()
