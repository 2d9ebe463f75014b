"""Runs of the fem program and of scripts on several ranks.

Ranks are forked from a process that has loaded the libraries, see ``warm_start``. ``run_python`` starts complete
processes, for tests of failing ranks.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

from tests.support.warm_start import warm_python

ROOT = Path(__file__).resolve().parents[2]
# No binding to cores: ranks of concurrent runs would share the first cores.
MPIRUN = ["mpirun", "--bind-to", "none", "--allow-run-as-root", "--oversubscribe", "-n"]


def run_program(path: Path, ranks: int) -> subprocess.CompletedProcess:
    """Run ``python -m reflowshock.fem`` on an input file on several ranks; return the completed process."""
    return run_python(["-m", "reflowshock.fem", str(path)], ranks, python=warm_python())


def run_programs(inputs: list[tuple[int, Path]]) -> None:
    """Run the fem program on several inputs, each with its number of ranks, in one start of all ranks."""
    words = [str(word) for arguments in inputs for word in arguments]
    run_warm(words, max(ranks for ranks, _ in inputs))


def run_warm(words: list[str], ranks: int) -> subprocess.CompletedProcess:
    """Run the module ``on_ranks`` with arguments on several ranks, require success and return the completed process."""
    line = ["-m", "tests.support.on_ranks", *words]
    done = run_python(line, ranks, timeout=400.0, python=warm_python())
    assert done.returncode == 0, done.stderr
    return done


def run_script(text: str, directory: Path, ranks: int) -> dict:
    """Run the text of a Python script on several ranks with a directory as argument; return the JSON that it prints."""
    script = directory / "script.py"
    script.write_text(text)
    return json.loads(run_warm([str(script), str(directory)], ranks).stdout)


def run_python(
    arguments: list[str], ranks: int, timeout: float = 120.0, python: str = sys.executable
) -> subprocess.CompletedProcess:
    """Run Python on several ranks with the packages of this checkout; return the completed process, failed or not.

    Args:
        arguments: Arguments of Python.
        ranks: Number of ranks.
        timeout: Time after which the run is stopped [s].
        python: Path of Python.
    """
    return subprocess.run(
        [*MPIRUN, str(ranks), python, *arguments],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
