"""Error against cost of solder joint reflow over spacing, time step and gap, and of the nodal derivatives.

Run: PYTHONPATH=. .venv/bin/python benchmarks/bench_reflow.py   (about a minute; writes results/reflow.json)
Errors are relative to the Young-Laplace meridian; times are seconds of one core after compilation.
"""

from time import perf_counter

import numpy as np

from benchmarks.support import results
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.gripc.moving_least_squares import SUPPORT, fit_derivatives
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.scenes.reflow import solve_joint
from reflowshock.particles.steps.rest import NotAtRest

NAME = "reflow"
BALL, RADIUS, MM = 0.0724e-9, 0.24e-3, 1e-3
SPACINGS = (0.10, 0.07, 0.05, 0.04, 0.03, 0.02)
PER_EDGE = (8, 12, 18, 26)
TIME_STEP_LIMITS = (5.0, 20.0, 100.0)
GAPS = tuple(np.linspace(0.28, 0.42, 15))
COLUMNS = (
    "width_error",
    "axial_force_error",
    "volume_drift",
    "particles",
    "steps",
    "seconds",
    "particle_steps_per_second",
)


def run_joint(gap: float, numerics: SolderNumerics) -> dict:
    """Solve one joint to rest and return its figures.

    Args:
        gap: Gap between the pads [mm].
        numerics: Particle spacing and limit of the time step.

    Returns:
        ``gap_mm``, ``spacing_mm``, ``time_step_limit``, ``verdict`` and the metrics in ``COLUMNS`` in SI units;
        ``failure``, the message, instead of the last two if the joint does not come to rest.
    """
    solder = Solder(volume=BALL, numerics=numerics)
    row = {"gap_mm": gap, "spacing_mm": numerics.spacing / MM, "time_step_limit": numerics.time_step_limit}
    try:
        shape = solve_joint(JointGeometry(gap * MM, RADIUS, RADIUS), solder)
    except NotAtRest as failure:
        return row | {"failure": str(failure)}
    return row | {"verdict": shape.verdict} | {name: shape.metrics[name][0] for name in COLUMNS}


def measure_derivatives(basis: str, count: int) -> dict:
    """Measure the error and the cost of fitted derivatives of sin(2x) cos(y) exp(z) on a perturbed lattice.

    Args:
        basis: Polynomial basis of the fit, "linear" or "quadratic".
        count: Number of points along each edge of the unit cube.

    Returns:
        ``basis``, ``per_edge``, ``gradient_error`` and ``laplacian_error`` (relative, in the 2-norm), and
        ``microseconds_a_particle``.
    """
    axis, spacing = np.linspace(0.0, 1.0, count), 1.0 / (count - 1)
    points = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    points += np.random.default_rng(13).uniform(-0.1, 0.1, points.shape) * spacing
    inner = np.flatnonzero((np.abs(points - 0.5) < 0.25).all(axis=1)).astype(np.int32)
    neighbours = NeighbourList(SUPPORT[basis] * spacing, 0.0)
    neighbours.update(points)
    start = perf_counter()
    operators = fit_derivatives(points, inner, neighbours, basis)
    microseconds = 1e6 * (perf_counter() - start) / len(inner)
    x, y, z = points.T
    field = np.sin(2 * x) * np.cos(y) * np.exp(z)
    slope, laplacian = (2 * np.cos(2 * x) * np.cos(y) * np.exp(z))[inner], -4.0 * field[inner]
    return {
        "basis": basis,
        "per_edge": count,
        "gradient_error": np.linalg.norm(operators.gradient[0] @ field - slope) / np.linalg.norm(slope),
        "laplacian_error": np.linalg.norm(operators.laplacian @ field - laplacian) / np.linalg.norm(laplacian),
        "microseconds_a_particle": microseconds,
    }


def fit_step_cost(rows: list[dict]) -> dict:
    """Fit the cost of a step by a + b n with the number n of particles, the model of ``particles.parameters.estimate``.

    Args:
        rows: Figures of ``run_joint``; failed runs are ignored.

    Returns:
        ``seconds_per_step`` (a) and ``seconds_per_step_and_particle`` (b) [s].
    """
    rows = [row for row in rows if "seconds" in row]
    slope, constant = np.polyfit([row["particles"] for row in rows], [row["seconds"] / row["steps"] for row in rows], 1)
    return {"seconds_per_step": float(constant), "seconds_per_step_and_particle": float(slope)}


def main() -> None:
    """Run all series and store the results."""
    run_joint(0.31, SolderNumerics(spacing=0.1 * MM))
    for basis in SUPPORT:
        measure_derivatives(basis, 8)
    by_spacing = [run_joint(0.31, SolderNumerics(spacing=spacing * MM)) for spacing in SPACINGS]
    steps = [run_joint(0.31, SolderNumerics(time_step_limit=limit)) for limit in TIME_STEP_LIMITS]
    gaps = [run_joint(gap, SolderNumerics()) for gap in GAPS]
    result = {
        "spacing": by_spacing,
        "time_step": steps,
        "gaps": gaps,
        "seconds_of_all_gaps": sum(row["seconds"] for row in gaps),
        "derivatives": [measure_derivatives(basis, count) for basis in SUPPORT for count in PER_EDGE],
        "cost_of_a_step": fit_step_cost(by_spacing),
    }
    results.write_figures(NAME, result)
    for name in ("spacing", "time_step", "gaps", "derivatives"):
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
