"""The stages of a structure: its mesh, one run of the package fem for each solver, what its motion compares with."""

from pathlib import Path

from reflowshock.workflow.case.run import Findings, Run
from reflowshock.workflow.process.products import write_json
from reflowshock.workflow.structure import findings as structure_findings
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.launch import read_results, run_solver, solver_folders


def geometry(run: Run[StructureCase], folder: Path) -> Findings:
    """Mesh the layers."""
    from reflowshock.meshing.board.box import write_box
    from reflowshock.meshing.core.preview import write_layers_preview

    counts = write_box(run.case.box, folder / "structure.msh")
    write_layers_preview(folder / "structure.msh", folder / "preview.png")
    return structure_findings.of_mesh(counts)


def shock(run: Run[StructureCase], folder: Path) -> Findings:
    """Move the structure: each solver is one MPI run of the package fem."""
    for solver in run.case.dynamics.solvers:
        run_solver(run, folder / solver, solver)
    return structure_findings.of_motion(read_results(folder))


def comparison(run: Run[StructureCase], folder: Path) -> Findings:
    """Compare the motion with exact solutions and bounds, and two solvers with each other."""
    found = structure_findings.of_comparison(run.case, solver_folders(run.folder / "shock"))
    write_json(folder / "comparison.json", found.metrics)
    return found
