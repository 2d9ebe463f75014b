"""The fem program, and scripts, on several ranks."""

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", "-n"]


def run_program(path: Path, ranks: int) -> subprocess.CompletedProcess:
    """Run ``python -m fem`` on an input file."""
    return run_python(["-m", "reflowshock.fem", str(path)], ranks)


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
