"""Work of each MPI rank in tests: a script, or inputs of the fem program one after the other.

mpirun -n N python -m tests.support.on_ranks SCRIPT.py WORD ...
mpirun -n N python -m tests.support.on_ranks RANKS INPUT.json RANKS INPUT.json ...
"""

import os
import runpy
import sys
import time


def run_in_turn(words: list[str]) -> None:
    """Run inputs of the fem program in turn, each on the first ranks, while the others sleep; collective.

    Args:
        words: Number of ranks and path of each input, alternating.
    """
    from mpi4py import MPI

    from reflowshock.fem.run.program import main

    world = MPI.COMM_WORLD
    for count, path in zip(map(int, words[::2]), words[1::2], strict=True):
        comm = world.Split(0 if world.rank < count else MPI.UNDEFINED)
        if comm != MPI.COMM_NULL and main(comm, [path]):
            world.Abort(1)
        done = world.Ibarrier()
        while not done.Test():
            time.sleep(0.02)


if __name__ == "__main__":
    os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")  # read when MPI is loaded
    if sys.argv[1].endswith(".py"):
        sys.argv = sys.argv[1:]
        runpy.run_path(sys.argv[0], run_name="__main__")
    else:
        run_in_turn(sys.argv[1:])
