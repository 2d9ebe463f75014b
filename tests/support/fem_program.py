"""The fem program on several ranks."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", "-n"]


def run_program(path: Path, ranks: int) -> subprocess.CompletedProcess:
    """Run ``python -m fem`` on an input file."""
    return subprocess.run(
        [*MPIRUN, str(ranks), sys.executable, "-m", "fem", str(path)],
        cwd=ROOT,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
