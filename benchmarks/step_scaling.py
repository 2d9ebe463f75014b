"""Cost of a whole step against its force alone, and of two ranks against one, on a cube of 40^3 boxes of steel.

    PYTHONPATH=. python benchmarks/step_scaling.py  (half a minute; writes results/step_scaling.json)

The script starts itself on two MPI ranks. In turns, rank 0 steps a model of its own (``COMM_SELF``) while rank 1
sleeps, then both step the same cube cut in two by DOLFINx. A step is ``ExplicitMotion.advance`` and
``ExplicitMotion.update_force``: update of velocities and displacements, internal force, sum over the copies of shared
nodes. ``drop`` is the same step under a body force, whose work needs the momentum. Ranks wait for each other, so that
interruptions by other programs count twice; times are therefore the minimum wall seconds of single calls on the slower
rank.
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

from benchmarks.support import results, turns
from benchmarks.support.cube import STEEL, cube
from reflowshock.cases.hard.trials.bodies import motion_of
from reflowshock.fem.division.tables import prepare
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.loads.load import Load, half_sine_drop
from reflowshock.fem.model.assembly import make_body, make_rank_elements
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.parallel.mpi_environment import without_mpi_job
from reflowshock.materials.roles import Materials
from reflowshock.workflow.process.launch import mpi_command

ROUNDS, CALLS = 40, 10
FRACTION = 0.5  # step over the critical step
PULSE = half_sine_drop(peak=1.5e4, duration=5e-4)
NAP = 1e-3  # [s]


def make_motion(comm: MPI.Comm, loads: list[Load]) -> ExplicitMotion:
    """Return the cube at rest under loads, distributed over the ranks of a communicator; collective."""
    item = prepare(cube(), "dns")["dns"]
    rank_elements = make_rank_elements(
        distribute(comm, item.mesh if comm.rank == 0 else None), item.tables, Materials(board=STEEL)
    )
    body = make_body(comm, rank_elements, item.tables, np.ones(len(rank_elements.steps)))
    return motion_of(body, FRACTION * comm.allreduce(float(rank_elements.steps.min()), MPI.MIN), loads)


def step_of(motion: ExplicitMotion) -> Callable[[], None]:
    """Return a function that takes one whole step of a motion, force included; collective on its ranks."""

    def work() -> None:
        motion.advance()
        motion.update_force()

    return work


def force_of(motion: ExplicitMotion) -> Callable[[], None]:
    """Return a function that evaluates the internal force of a motion at its displacement, without communication."""
    scratch = np.zeros_like(motion.force)

    def work() -> None:
        for term in motion.body.terms:
            term.add(motion.displacement, scratch)

    return work


def measure_least_wall(comm: MPI.Comm, work: Callable[[], None]) -> float:
    """Return the wall seconds of a call on the slower rank, the minimum over several calls; collective."""
    walls = np.empty(CALLS)
    for k in range(CALLS):
        comm.Barrier()
        start = time.perf_counter()
        work()
        walls[k] = time.perf_counter() - start
    comm.Allreduce(MPI.IN_PLACE, walls, MPI.MAX)
    return float(walls.min())


def wait_asleep(comm: MPI.Comm) -> None:
    """Wait at a barrier for the other rank, asleep, so that it can use the whole processor; collective."""
    request = comm.Ibarrier()
    while not request.Test():
        time.sleep(NAP)


def measure(world: MPI.Comm) -> dict[str, float]:
    """Measure steps and forces on one rank and on two; collective.

    Returns:
        ``step_N`` and ``force_N`` on N ranks, and ``drop_1``, a step under a body force: minimum wall seconds; those of
        one rank on rank 0 only.
    """
    both = make_motion(world, [])
    works = {"step_2": (world, step_of(both)), "force_2": (world, force_of(both))}
    if world.rank == 0:
        alone, drop = (make_motion(MPI.COMM_SELF, loads) for loads in ([], [PULSE]))
        single = {"step_1": step_of(alone), "force_1": force_of(alone), "drop_1": step_of(drop)}
        works = {name: (MPI.COMM_SELF, work) for name, work in single.items()} | works
    for _, work in works.values():
        work()
    least = dict.fromkeys(works, np.inf)
    for _ in range(ROUNDS):
        for name, (comm, work) in works.items():
            if name == "step_2":
                wait_asleep(world)
            least[name] = min(least[name], measure_least_wall(comm, work))
    return least


def report(least: dict[str, float]) -> dict:
    """Return the figures of the benchmark.

    Args:
        least: Minimum wall seconds of each work, as ``measure`` returns them.

    Returns:
        ``elements``, ``updates_per_second`` by work, ``load_average``, and ``bars``, ratios with their limits.
    """
    count = len(cube().cells)
    pairs = {
        "step / force": ("force_1", "step_1", 0.8),
        "step under a body force / force": ("force_1", "drop_1", 0.8),
        "step / force on 2 ranks": ("force_2", "step_2", 0.8),
        "2 ranks / 1": ("step_1", "step_2", 1.7),
    }
    return {
        "elements": count,
        "updates_per_second": {name: count / seconds for name, seconds in least.items()},
        "load_average": os.getloadavg()[0],
        "bars": {name: turns.bar(least[other] / least[ours], bar) for name, (other, ours, bar) in pairs.items()},
    }


def main() -> None:
    """Measure on two ranks, launched by MPI; store and print the figures."""
    command = mpi_command(2, [sys.executable, __file__, "ranks"], oversubscribe=False)
    done = subprocess.run(command, env=without_mpi_job(os.environ), stdout=subprocess.PIPE, text=True, check=True)
    results.write_and_print("step_scaling", json.loads(done.stdout))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        measured = measure(MPI.COMM_WORLD)
        if MPI.COMM_WORLD.rank == 0:
            print(json.dumps(report(measured)))
    else:
        main()
