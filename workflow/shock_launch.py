"""One mode of the shock: input file, MPI run, result."""

import json
import sys
from collections.abc import Callable
from pathlib import Path

from workflow.launch import launch, mpi_command
from workflow.progress import progress_bar
from workflow.stage_runner import Run

MODES = {"two_scale": "two-scale", "dns": "DNS"}


def run_mode(run: Run, folder: Path, mode: str) -> None:
    """Run one mode of the shock on its MPI ranks, showing its progress.

    Args:
        run: run folder with assembly and joints, case, cores.
        folder: where the mode's products go.
        mode: "two_scale" or "dns".

    Raises:
        LaunchError: the run failed; the message has its last words.
    """
    folder.mkdir()
    request = {
        "mode": mode,
        "meshes": [str(run.folder.resolve() / name) for name in ("geometry/assembly.msh", "solder_mesh/joints.msh")],
        "shock": run.case.shock.model_dump(mode="json"),
        "materials": run.case.materials.model_dump(mode="json"),
        "output": str(folder.resolve()),
    }
    path = folder / "input.json"
    path.write_text(json.dumps(request, indent=1) + "\n")
    ranks = run.case.shock.ranks.macro + run.case.shock.ranks.meso
    command = mpi_command(ranks, [sys.executable, "-m", "fem", str(path)], run.oversubscribe)
    with progress_bar(f"shock, {MODES[mode]} on {ranks} ranks") as progress:
        launch(command, lambda line: _pass_on(line, progress), folder / "log.txt")


def read_results(folder: Path) -> dict[str, dict]:
    """Return ``result.json`` of each mode that ran, two-scale first."""
    return {mode: json.loads((folder / mode / "result.json").read_text()) for mode in MODES if (folder / mode).is_dir()}


def _pass_on(line: str, progress: Callable[[float], None]) -> None:
    """Show how far a run is, if a line of its output says so."""
    if line.startswith('{"progress"'):
        progress(json.loads(line)["progress"])
