"""Stages of a package on a board: geometry -> reflow -> surface -> solder_mesh -> shock.

The reflow stage is in ``reflow/stage.py``. Only cases with a ``[shock]`` table have the stage shock.
"""

from dataclasses import replace
from pathlib import Path

from reflowshock.workflow.board_drop import identical_joints
from reflowshock.workflow.case.run import Findings, Run
from reflowshock.workflow.package import findings
from reflowshock.workflow.package.case import BoardDropCase, PackageCase
from reflowshock.workflow.process.products import read_json, write_json


def geometry(run: Run[PackageCase], folder: Path) -> Findings:
    """Mesh the flat board and the flat package, and write the pad table.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
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
    """Close the surface of each joint, or read the user's surface, and measure it.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.workflow.board_drop.joint_meshes import write_surfaces

    surfaces = write_surfaces(run, folder)
    write_json(folder / "surfaces.json", surfaces)
    return findings.of_surface(surfaces)


def solder_mesh(run: Run[PackageCase], folder: Path) -> Findings:
    """Place the package at its position after solidification and mesh every joint.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.workflow.board_drop.joint_meshes import mesh_real_joints

    return findings.of_solder_mesh(mesh_real_joints(run.case, run.folder, folder, coarse=False), {})


def solder_mesh_for_drop(run: Run[BoardDropCase], folder: Path) -> Findings:
    """Mesh every joint, and the coarse and identical joints that the shock needs.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.workflow.board_drop.fine_joints import needs_coarse_joints
    from reflowshock.workflow.board_drop.joint_meshes import mesh_identical_joints, mesh_real_joints
    from reflowshock.workflow.board_drop.shock_effects import of_joint_meshes

    case = run.case
    coarse = needs_coarse_joints(case.shock.coupling)
    qualities = mesh_real_joints(case, run.folder, folder, coarse=coarse)
    if case.shock.identical_joints:
        qualities |= mesh_identical_joints(run, folder, coarse=coarse)
    return findings.of_solder_mesh(qualities, of_joint_meshes(case))


def shock(run: Run[BoardDropCase], folder: Path) -> Findings:
    """Run the shock in each mode, one MPI run of ``fem`` each; compare modes, and real with identical joints.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.workflow.board_drop.search import find_fine_joints
    from reflowshock.workflow.board_drop.shock_cooling import with_cooling
    from reflowshock.workflow.board_drop.shock_effects import with_influence
    from reflowshock.workflow.board_drop.shock_launch import read_results, run_mode
    from reflowshock.workflow.reflow.joints import refuse_joints_without_mesh

    joints = read_json(run.folder / "reflow/joints.json")
    refuse_joints_without_mesh({name: joints[name] for name in joints if name not in run.case.package.surfaces})
    fine = find_fine_joints(run, folder)
    for mode in run.case.shock.numerics.modes:
        run_mode(run, folder / mode, mode, fine)
    results = read_results(folder)
    shock_findings = findings.of_shock(results, folder, run.case.board.thickness)
    shock_findings = replace(shock_findings, effects=with_influence(shock_findings.effects, run.case))
    if run.case.shock.identical_joints:
        main = next(iter(results))
        run_mode(run, folder / identical_joints.FOLDER, main, fine, identical_joints.PREFIX)
        shock_findings = identical_joints.with_comparison(shock_findings, run, folder, main)
    return with_cooling(shock_findings, run.case, folder)
