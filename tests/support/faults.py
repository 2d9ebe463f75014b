"""Helpers of the fault tests: a small drop run by the command, its metrics, and the random seed."""

import json
import os
from pathlib import Path
from subprocess import CompletedProcess

from tests.support.warm_start import warm_command

DROP = Path(__file__).resolve().parents[2] / "cases/sessile_drop/case.toml"
SMALL_DROP = ("--set", "drop.particles_per_edge=5")
SEED = int(os.environ.get("REFLOWSHOCK_SEED", "15"))  # random seed; pytest shows it in test names
# Parts of the names of metrics that differ between runs.
TIMES = ("seconds", "per_second", "memory", "wall", "setup", "time_ratio", "core_ratio", "overhead", "busy_share")


def run_drop(folder: Path, command: str = "run", *options: str, cwd: Path | None = None) -> CompletedProcess:
    """Run a command of the program on a drop of 125 particles to its end and return the completed process.

    Args:
        folder: Run folder.
        command: Name of the command.
        options: Further options of the command.
        cwd: Folder in which the command runs; None for the present one.
    """
    return warm_command(command, str(DROP), *SMALL_DROP, "--out", str(folder), *options, cwd=cwd)


def answers(folder: Path) -> dict[str, object]:
    """Return the metrics in the summary of a run folder that a second run must reproduce, name -> value; no timings."""
    metrics = json.loads((folder / "summary.json").read_text())["metrics"]
    return {name: entry["value"] for name, entry in metrics.items() if not any(word in name for word in TIMES)}
