"""Stages of a structure: its mesh, one run of the package ``fem`` for each solver, comparison with references."""

import json
from pathlib import Path

from reflowshock.workflow.case.run import Findings, Run
from reflowshock.workflow.process.fem_launch import run_fem
from reflowshock.workflow.process.products import write_json
from reflowshock.workflow.structure import findings as structure_findings
from reflowshock.workflow.structure.case import StructureCase

SOLVERS = ("explicit", "implicit", "dns")


def run_solver(run: Run[StructureCase], folder: Path, solver: str) -> None:
    """Run one solver on its MPI ranks and show its progress.

    Args:
        run: Run folder with the mesh, case and cores.
        folder: Folder for the products of the solver.
        solver: One of ``SOLVERS``.

    Raises:
        LaunchError: The run failed; the message contains its last lines.
    """
    request = {
        "mode": "structure",
        "solver": solver,
        "mesh": str(run.folder.resolve() / "geometry/structure.msh"),
        "checkpoints": str(run.checkpoints("shock").resolve() / solver),
        **run.case.problem.model_dump(mode="json"),
    }
    run_fem(run, folder, request, f"shock, {solver} solver")


def solver_folders(folder: Path) -> dict[str, Path]:
    """Return the folder of each solver that ran, in the order explicit, implicit, dns.

    Args:
        folder: Folder of the stage shock.
    """
    return {solver: folder / solver for solver in SOLVERS if (folder / solver).is_dir()}


def read_results(folder: Path) -> dict[str, dict]:
    """Return ``result.json`` of each solver that ran, explicit first.

    Args:
        folder: Folder of the stage shock.

    Returns:
        Solver -> content of its ``result.json`` (``model``, ``metrics``, ``health``, ``timings``, ``coupling``).
    """
    return {
        solver: json.loads((solver_folder / "result.json").read_text(encoding="utf-8"))
        for solver, solver_folder in solver_folders(folder).items()
    }


def geometry(run: Run[StructureCase], folder: Path) -> Findings:
    """Mesh the layers.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.meshing.board.box import write_box
    from reflowshock.meshing.core.preview import write_layers_preview

    counts = write_box(run.case.box, folder / "structure.msh")
    write_layers_preview(folder / "structure.msh", folder / "preview.png")
    return structure_findings.of_mesh(counts)


def shock(run: Run[StructureCase], folder: Path) -> Findings:
    """Compute the motion, one MPI run of the package ``fem`` for each solver.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    for solver in run.case.dynamics.solvers:
        run_solver(run, folder / solver, solver)
    return structure_findings.of_motion(read_results(folder))


def comparison(run: Run[StructureCase], folder: Path) -> Findings:
    """Compare the motion with the references of the case, and the solvers with each other.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    result = structure_findings.of_comparison(run.case, solver_folders(run.folder / "shock"))
    write_json(folder / "comparison.json", result.metrics)
    return result
