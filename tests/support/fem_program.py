"""The fem program, and scripts, on several ranks."""

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-n"]


def run_program(path: Path, ranks: int) -> subprocess.CompletedProcess:
    """Run ``python -m fem`` on an input file."""
    return run_python(["-m", "reflowshock.fem", str(path)], ranks)


# Runs inputs one after the other, each on the first ranks; the others sleep meanwhile.
IN_TURN = """
import sys, time
from mpi4py import MPI
from reflowshock.fem.run.program import main
world = MPI.COMM_WORLD
for count, path in zip(map(int, sys.argv[1::2]), sys.argv[2::2]):
    comm = world.Split(0 if world.rank < count else MPI.UNDEFINED)
    if comm != MPI.COMM_NULL and main(comm, [path]):
        world.Abort(1)
    done = world.Ibarrier()
    while not done.Test():
        time.sleep(0.02)
"""


def run_programs(inputs: list[tuple[int, Path]]) -> None:
    """Run the fem program on several inputs, each with its number of ranks, in one start of all ranks."""
    words = [str(word) for one in inputs for word in one]
    done = run_python(["-c", IN_TURN, *words], max(ranks for ranks, _ in inputs), timeout=400.0)
    assert done.returncode == 0, done.stderr


def run_script(text: str, directory: Path, ranks: int) -> dict:
    """Run a script that is given the directory and prints its results as JSON."""
    script = directory / "script.py"
    script.write_text(text)
    done = run_python([str(script), str(directory)], ranks)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def run_python(arguments: list[str], ranks: int, timeout: float = 120.0) -> subprocess.CompletedProcess:
    """Run Python on several ranks, with this tree's packages."""
    return subprocess.run(
        [*MPIRUN, str(ranks), sys.executable, *arguments],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
