"""Search for the critical joints and the end of a shock by the same shock with coarse joints on a coarser mesh."""

from dataclasses import replace
from pathlib import Path

from reflowshock.workflow.board_drop.coarser_case import needs_search, search_case
from reflowshock.workflow.board_drop.fine_joints import (
    FineJoints,
    most_stressed,
    named_joints,
    with_end,
    write_fine_joints,
)
from reflowshock.workflow.board_drop.shock_launch import shock_request
from reflowshock.workflow.case.run import Run
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.process.fem_launch import run_fem

FOLDER = "coarse"  # in the product of the shock


def find_fine_joints(run: Run[BoardDropCase], folder: Path) -> FineJoints:
    """Return the fine joints of the two-scale run; find critical ones, and the end of a damped shock, by a search.

    The search, in the folder ``coarse``, is a two-scale run as well, because the board then keeps its large step.
    Without a search, the joints are those that the case names, and nothing is run or written.

    Args:
        run: Run folder with assembly and joints, case, cores.
        folder: Folder of the shock, into which the search and ``fine_joints.json`` are written.

    Returns:
        Names of the joints with a fine mesh, or "all", the reason for the choice, and the end of the shock [s] if the
        search decides it.

    Raises:
        LaunchError: The run of the search failed; the message contains its last lines.
    """
    case, fine = run.case, named_joints(run.case.shock.coupling)
    if not needs_search(case):
        return fine
    coarse = replace(run, case=search_case(case))
    request = shock_request(coarse.case, "two_scale", _meshes(coarse, folder / f"{FOLDER}_mesh"))
    request["checkpoints"] = str(run.checkpoints("shock").resolve() / FOLDER)
    request["settles"] = case.shock.duration == "auto"
    run_fem(coarse, folder / FOLDER, request, "shock, coarse mesh")
    history = folder / FOLDER / "history.npz"
    if fine.names == "critical":
        fine = most_stressed(history, case.shock.coupling.critical_joints)
    if case.shock.duration == "auto" and case.shock.damping.acts:
        fine = with_end(fine, history)
    write_fine_joints(folder, fine)
    return fine


def _meshes(run: Run[BoardDropCase], folder: Path) -> tuple[Path, Path]:
    """Return the files of the assembly and the coarse joints of a search; mesh them unless the case has them."""
    from reflowshock.meshing.board.assembly import write_assembly
    from reflowshock.workflow.board_drop.joint_meshes import mesh_real_joints

    if run.case.thermal:
        folder = run.folder / "solder_mesh"
    else:
        folder.mkdir()
        flat = folder / "flat.msh"
        write_assembly(run.case.package, run.case.board, flat)
        mesh_real_joints(run.case, run.folder, folder, coarse=True, flat=flat)
    return folder / "assembly.msh", folder / "coarse_joints.msh"
