"""The stages of a structure: its mesh, and one run of the package fem for each solver."""

from pathlib import Path

from workflow import structure_findings
from workflow.stage_runner import Findings, Run
from workflow.structure_case import StructureCase
from workflow.structure_launch import read_results, run_solver

MESH = "geometry/structure.msh"


def geometry(run: Run[StructureCase], folder: Path) -> Findings:
    """Mesh the layers."""
    from meshing.box import write_box
    from meshing.preview import write_layers_preview

    counts = write_box(run.case.box, folder / "structure.msh")
    write_layers_preview(folder / "structure.msh", folder / "preview.png")
    return structure_findings.of_mesh(counts)


def shock(run: Run[StructureCase], folder: Path) -> Findings:
    """Move the structure: each solver is one MPI run of the package fem; two solvers are compared."""
    for solver in run.case.dynamics.solvers:
        run_solver(run, folder / solver, solver)
    return structure_findings.of_motion(read_results(folder))
