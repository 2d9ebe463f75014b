"""The stages of a package on a board: geometry -> reflow -> surface -> solder_mesh -> shock.

The reflow is in `reflow/stage.py`; the shock is there only where the case has one.
"""

from dataclasses import replace
from pathlib import Path

from reflowshock.workflow.board_drop import identical_joints
from reflowshock.workflow.case.run import Findings, Run
from reflowshock.workflow.package import findings
from reflowshock.workflow.package.case import BoardDropCase, PackageCase
from reflowshock.workflow.process.products import read_json, write_json


def geometry(run: Run[PackageCase], folder: Path) -> Findings:
    """Mesh board and package, both flat; tabulate the pads."""
    from reflowshock.meshing.board.assembly import write_assembly
    from reflowshock.meshing.board.pads import pad_table, write_pads
    from reflowshock.meshing.board.parameters import Warpage
    from reflowshock.meshing.core.preview import write_preview

    case = run.case
    pads = pad_table(case.package, case.board, Warpage())
    write_pads(folder / "pads.json", pads)
    counts = write_assembly(case.package, case.board, folder / "assembly.msh")
    write_preview([folder / "assembly.msh"], folder / "preview.png")
    return findings.of_geometry(len(pads), counts)


def surface(run: Run[PackageCase], folder: Path) -> Findings:
    """Close the surface of each joint, or take the one that the user gives, and measure it."""
    from reflowshock.workflow.board_drop.joint_meshes import write_surfaces

    surfaces = write_surfaces(run, folder)
    write_json(folder / "surfaces.json", surfaces)
    return findings.of_surface(surfaces)


def solder_mesh(run: Run[PackageCase], folder: Path) -> Findings:
    """Put the package where the solder froze and mesh every joint in its place; once more if all were alike."""
    from reflowshock.workflow.board_drop.joint_meshes import mesh_identical_joints, mesh_real_joints
    from reflowshock.workflow.board_drop.shock_effects import of_joint_meshes

    case, qualities = run.case, mesh_real_joints(run, folder)
    if not isinstance(case, BoardDropCase):
        return findings.of_solder_mesh(qualities, {})
    if case.shock.identical_joints:
        qualities |= mesh_identical_joints(run, folder)
    return findings.of_solder_mesh(qualities, of_joint_meshes(case))


def shock(run: Run[BoardDropCase], folder: Path) -> Findings:
    """Drop the board: each mode is one MPI run of the package fem; two modes are compared, and identical joints."""
    from reflowshock.workflow.board_drop.shock_cooling import with_cooling
    from reflowshock.workflow.board_drop.shock_effects import with_influence
    from reflowshock.workflow.board_drop.shock_launch import find_fine_joints, read_results, run_mode
    from reflowshock.workflow.reflow.joints import refuse_joints_without_mesh

    joints = read_json(run.folder / "reflow/joints.json")
    refuse_joints_without_mesh({name: joints[name] for name in joints if name not in run.case.package.surfaces})
    fine = find_fine_joints(run, folder)
    for mode in run.case.shock.numerics.modes:
        run_mode(run, folder / mode, mode, fine)
    results = read_results(folder)
    found = findings.of_shock(results, folder, run.case.board.thickness)
    found = replace(found, effects=with_influence(found.effects, run.case))
    if run.case.shock.identical_joints:
        main = next(iter(results))
        run_mode(run, folder / identical_joints.FOLDER, main, fine, identical_joints.PREFIX)
        found = identical_joints.compared(found, run, folder, main)
    return with_cooling(found, run.case, folder)
