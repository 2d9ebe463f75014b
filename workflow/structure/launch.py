"""One solver of a structure: input file, MPI run, result."""

import json
from pathlib import Path

from reflowshock.workflow.case.run import Run
from reflowshock.workflow.process.fem_launch import run_fem
from reflowshock.workflow.structure.case import StructureCase

SOLVERS = ("explicit", "implicit", "dns")


def run_solver(run: Run[StructureCase], folder: Path, solver: str) -> None:
    """Run one solver on its MPI ranks, showing its progress.

    Args:
        run: run folder with the mesh, case, cores.
        folder: where the solver's products go.
        solver: one of ``SOLVERS``.

    Raises:
        LaunchError: the run failed; the message has its last words.
    """
    request = {
        "mode": "structure",
        "solver": solver,
        "mesh": str(run.folder.resolve() / "geometry/structure.msh"),
        "checkpoints": str(run.checkpoints("shock").resolve() / solver),
        **run.case.scene.model_dump(mode="json"),
    }
    run_fem(run, folder, request, f"shock, {solver} solver")


def solver_folders(folder: Path) -> dict[str, Path]:
    """Return the folder of each solver that ran, explicit first."""
    return {solver: folder / solver for solver in SOLVERS if (folder / solver).is_dir()}


def read_results(folder: Path) -> dict[str, dict]:
    """Return ``result.json`` of each solver that ran, explicit first."""
    return {
        solver: json.loads((own / "result.json").read_text(encoding="utf-8"))
        for solver, own in solver_folders(folder).items()
    }
