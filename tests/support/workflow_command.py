"""The command line as a subprocess, and the shortened case that the pipeline's tests run."""

import subprocess
import sys
from pathlib import Path

SMALL_CASE = Path(__file__).resolve().parents[1] / "pipeline" / "small.toml"


def command_line(command: str, folder: Path, *arguments: str, settings: tuple[str, ...] = ()) -> list[str]:
    overrides = [item for setting in settings for item in ("--set", setting)]
    return [sys.executable, "-m", "workflow", command, str(SMALL_CASE), "--out", str(folder), *arguments, *overrides]


def reflowshock(
    command: str, folder: Path, *arguments: str, settings: tuple[str, ...] = ()
) -> subprocess.CompletedProcess:
    """Run a command on the shortened case to its end."""
    line = command_line(command, folder, *arguments, settings=settings)
    return subprocess.run(line, capture_output=True, text=True, timeout=240, check=False)
