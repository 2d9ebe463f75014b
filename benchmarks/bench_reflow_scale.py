"""Cost of a reflow step against the number of particles, on one and two threads, for a cube that wets a wall.

Run: PYTHONPATH=. .venv/bin/python benchmarks/bench_reflow_scale.py   (two minutes; writes results/reflow_scale.json)
Each row runs in its own process. Memory is the growth of the maximum resident size over a cube of 343 particles.
"""

import json
import os
import resource
import subprocess
import sys
from time import perf_counter

import numpy as np

from benchmarks.support import results
from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.scenes.flow_setup import contact_line, start_flow
from reflowshock.particles.steps.flow import LiquidFlow

NAME = "reflow_scale"
EFFECTS = {"surface_tension": True, "wall_adhesion": True, "gravity": False, "inertia": False, "viscosity": False}
PER_EDGE = (11, 13, 17, 27, 41)
STEPS = 8


def make_cube(count: int) -> LiquidFlow:
    """Return a cube of solder with ``count`` particles per edge on a wall at 60 degrees, at time 0, ready for steps."""
    numerics = SolderNumerics(time_step_limit=100)
    solder = Solder(volume=1e-9, pad_contact_angle=np.radians(60), numerics=numerics)
    cloud = box_cloud(1e-3, count)
    return start_flow(cloud, solder, EFFECTS, (contact_line(cloud, 0, np.inf, solder),))


def peak_memory() -> float:
    """Return the maximum resident size of this process so far [bytes]."""
    return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def measure(count: int) -> dict:
    """Measure the cost and the memory of a reflow step of a cube with ``count`` particles per edge.

    Returns:
        ``particles``, ``threads``, ``seconds_a_step`` (wall time), ``particle_steps_per_second``, largest number of
        ``iterations`` of the pressure solve, and ``bytes_a_particle``.
    """
    make_cube(7).step()
    before, flow = peak_memory(), make_cube(count)
    records = [flow.step()]
    start = perf_counter()
    records += [flow.step() for _ in range(STEPS)]
    seconds = (perf_counter() - start) / STEPS
    particles = len(flow.body.points)
    return {
        "particles": particles,
        "threads": int(os.environ["NUMBA_NUM_THREADS"]),
        "seconds_a_step": seconds,
        "particle_steps_per_second": particles / seconds,
        "iterations": max(record.iterations for record in records),
        "bytes_a_particle": (peak_memory() - before) / particles,
    }


def main() -> None:
    """Measure cubes of several sizes on one and two threads, each in a process of its own; store and print the rows."""
    rows = []
    for count in PER_EDGE:
        for threads in (1, 2):
            environment = os.environ | {"NUMBA_NUM_THREADS": str(threads)}
            command = [sys.executable, __file__, str(count)]
            rows.append(json.loads(subprocess.run(command, env=environment, capture_output=True, check=True).stdout))
            print(rows[-1], flush=True)
        print(f"second thread: {rows[-2]['seconds_a_step'] / rows[-1]['seconds_a_step']:.2f} times faster", flush=True)
    results.write_figures(NAME, rows)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(measure(int(sys.argv[1]))))
    else:
        main()
