"""Launch of the package fem: input file, MPI run, progress."""

import json
import logging
import sys
from collections.abc import Callable
from pathlib import Path

from reflowshock.workflow.case.run import Run
from reflowshock.workflow.process.launch import PATIENCE, launch, mpi_command
from reflowshock.workflow.process.rank_count import decide_ranks
from reflowshock.workflow.process.terminal import progress_bar

WATCHDOG_MARGIN = 10.0  # [s]

logger = logging.getLogger(__name__)


def run_fem(run: Run, folder: Path, request: dict, title: str) -> None:
    """Run the package fem on the MPI ranks of the case, showing its progress.

    Args:
        run: Case and cores.
        folder: Folder of the products, created here.
        request: Content of the input file ``input.json`` except ``output``, as JSON data: ``mode``, meshes, parameters.
        title: Title of the progress bar.

    Raises:
        LaunchError: The run failed; the message contains its last output.
    """
    folder.mkdir()
    path = folder / "input.json"
    path.write_text(json.dumps(request | {"output": str(folder.resolve())}, indent=1) + "\n", encoding="utf-8")
    decided = decide_ranks(run.case.least_ranks, run.case.ranks, run.cores)
    command = mpi_command(decided.ranks, [sys.executable, "-m", "reflowshock.fem", str(path)], run.oversubscribe)
    with progress_bar(f"{title} on {decided}") as progress:
        launch(command, lambda line: _handle_line(line, progress), folder / "log.txt", _patience(request))


def _patience(request: dict) -> float:
    """Return how long a rank may be stopped [s]: slightly longer than the ranks' own watchdog, which reports more."""
    model = request.get("shock") or request.get("dynamics") or {}
    return float(model.get("numerics", {}).get("watchdog_seconds", PATIENCE)) + WATCHDOG_MARGIN


def _handle_line(line: str, progress: Callable[[float], None]) -> None:
    """Show the progress or the warning in a line of output."""
    if line.startswith('{"progress"'):
        progress(json.loads(line)["progress"])
    if line.startswith('{"warning"'):
        logger.warning(json.loads(line)["warning"])
