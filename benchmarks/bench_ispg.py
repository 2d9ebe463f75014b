"""Cost of one ISPG step against the number of particles, for a cube of solder that wets a wall at 60 degrees.

Run: PYTHONPATH=. OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 .venv/bin/python benchmarks/bench_ispg.py   (10 s)
Times are processor seconds over the first swing, where the factors of the pressure equation age fastest. The material
has the values of the paper.
"""

from time import process_time

import numpy as np

from benchmarks.support import results
from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.scenes.flow_setup import contact_line, start_flow

NAME = "ispg"
EFFECTS = {"surface_tension": True, "wall_adhesion": True, "gravity": False, "inertia": True, "viscosity": True}
PER_EDGE = (5, 6, 7, 9, 11)
STEPS = 60


def measure(count: int) -> dict[str, float]:
    """Measure the cost of a step of the scheme ispg for a cube with ``count`` particles per edge.

    Returns:
        ``particles`` (their number), ``seconds_a_step`` (processor time), ``particle_steps_per_second``, and
        ``iterations`` of the pressure solve, the mean over the steps.
    """
    numerics = SolderNumerics(scheme="ispg", time_step_limit=20)
    angle = float(np.radians(60))
    solder = Solder(volume=1e-9, pad_contact_angle=angle, surface_tension=4.985, viscosity=0.227, numerics=numerics)
    cloud = box_cloud(1e-3, count)
    flow = start_flow(cloud, solder, EFFECTS, (contact_line(cloud, 0, np.inf, solder),))
    flow.step()
    start = process_time()
    records = [flow.step() for _ in range(STEPS)]
    seconds = (process_time() - start) / STEPS
    particles = len(flow.body.points)
    return {
        "particles": particles,
        "seconds_a_step": seconds,
        "particle_steps_per_second": particles / seconds,
        "iterations": float(np.mean([record.iterations for record in records])),
    }


def main() -> None:
    """Measure cubes of several sizes, store the rows and print them."""
    measure(5)
    rows = [measure(count) for count in PER_EDGE]
    results.write_figures(NAME, rows)
    for row in rows:
        print("  ".join(f"{name} {value:.4g}" for name, value in row.items()))


if __name__ == "__main__":
    main()
