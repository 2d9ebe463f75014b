"""A whole step against its force alone, and two ranks against one, on the cube of 40^3 boxes of steel.

    python benchmarks/step_scaling.py        (half a minute; writes benchmarks/results/step_scaling.json)

The script starts itself on two MPI ranks. Rank 0 first measures a model of its own (``COMM_SELF``) while rank 1
sleeps, then both step the same cube cut in two by DOLFINx, and so on in turns. A step is Motion.advance and
Motion.update_force: update of velocities and displacements under a body force, internal force, sum over the copies of
shared nodes. Times are wall time, since ranks wait for each other: the least of many short batches is that of a machine
with two free cores.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np
from mpi4py import MPI

from benchmarks.support import turns
from benchmarks.support.cube import STEEL, cube
from fem.body import make_body, make_pieces
from fem.loads import HalfSineDrop
from fem.local_mesh import distribute
from fem.material_roles import Materials
from fem.motion import Motion
from fem.scene import prepare
from tests.support.fem_bodies import motion_of
from workflow.launch import mpi_command, own_environment

ROUNDS, CALLS = 25, 20
FRACTION = 0.5  # of the critical step
PULSE = HalfSineDrop(peak=1.5e4, pulse=5e-4)
NAP = 1e-3  # [s]


def motion_on(comm: MPI.Comm) -> Motion:
    """Return the cube at rest under a drop, distributed over the ranks."""
    item = prepare(cube(), "dns")["dns"]
    pieces = make_pieces(distribute(comm, item.mesh if comm.rank == 0 else None), item.tables, Materials(board=STEEL))
    body = make_body(comm, pieces, item.tables, np.ones(len(pieces.steps)))
    return motion_of(body, FRACTION * comm.allreduce(float(pieces.steps.min()), MPI.MIN), [PULSE])


def step(motion: Motion) -> Callable[[], None]:
    def work() -> None:
        motion.advance()
        motion.update_force()

    return work


def force(motion: Motion) -> Callable[[], None]:
    scratch = np.zeros_like(motion.force)

    def work() -> None:
        for term in motion.body.terms:
            term.add(motion.displacement, scratch)

    return work


def wall(comm: MPI.Comm, work: Callable[[], None]) -> float:
    """Return the wall seconds of a call, all ranks of ``comm`` from the same moment to the last."""
    comm.Barrier()
    begin = time.perf_counter()
    for _ in range(CALLS):
        work()
    return float(comm.allreduce(time.perf_counter() - begin, MPI.MAX)) / CALLS


def asleep(comm: MPI.Comm) -> None:
    """Wait for the other rank without using its core."""
    request = comm.Ibarrier()
    while not request.Test():
        time.sleep(NAP)


def measure(world: MPI.Comm) -> dict[str, np.ndarray]:
    """Return the wall seconds of each work, one value a round; on rank 0."""
    alone = motion_on(MPI.COMM_SELF) if world.rank == 0 else None
    both = motion_on(world)
    shared = {"step_2": step(both), "force_2": force(both)}
    single = {} if alone is None else {"step_1": step(alone), "force_1": force(alone)}
    for work in (*single.values(), *shared.values()):
        work()
    rows: dict[str, list[float]] = {name: [] for name in (*single, *shared)}
    for _ in range(ROUNDS):
        for name, work in single.items():
            rows[name].append(wall(MPI.COMM_SELF, work))
        asleep(world)
        for name, work in shared.items():
            rows[name].append(wall(world, work))
    return {name: np.array(values) for name, values in rows.items()}


def report(seconds: dict[str, np.ndarray]) -> dict:
    """Return rates, ratios and bars; the ratios are of least times, beside them the medians of rounds."""
    pairs = {
        "step_speed_of_force_speed": ("force_1", "step_1"),
        "step_speed_of_force_speed_2_ranks": ("force_2", "step_2"),
        "speed_of_2_ranks": ("step_1", "step_2"),
    }
    least = {name: float(seconds[a].min() / seconds[b].min()) for name, (a, b) in pairs.items()}
    count = len(cube().cells)
    return {
        "elements": count,
        "updates_per_second": {name: float(count / values.min()) for name, values in seconds.items()},
        "medians": {name: float(np.median(seconds[a] / seconds[b])) for name, (a, b) in pairs.items()},
        "load_average": os.getloadavg()[0],
        "bars": {name: turns.bar(least[name], 1.7 if name == "speed_of_2_ranks" else 0.8) for name in pairs},
    }


def main() -> None:
    command = mpi_command(2, [sys.executable, __file__, "ranks"], oversubscribe=False)
    done = subprocess.run(command, env=own_environment(os.environ), stdout=subprocess.PIPE, text=True, check=True)
    turns.write("step_scaling", json.loads(done.stdout))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        seconds = measure(MPI.COMM_WORLD)
        if MPI.COMM_WORLD.rank == 0:
            print(json.dumps(report(seconds)))
    else:
        main()
