"""Launch of the modes of a shock as MPI runs of the package ``fem``."""

import json
from pathlib import Path

from reflowshock.fem.problem.shock import JointCoupling
from reflowshock.workflow.board_drop import fittings
from reflowshock.workflow.board_drop.board_deflection import decided
from reflowshock.workflow.board_drop.fine_joints import (
    FineJoints,
    most_stressed,
    named_joints,
    needs_coarse_joints,
    with_end,
    write_fine_joints,
)
from reflowshock.workflow.board_drop.shock_cooling import with_initial_stress
from reflowshock.workflow.case.run import Run
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.process.fem_launch import run_fem
from reflowshock.workflow.process.products import read_json

MODES = {"two_scale": "two-scale", "dns": "DNS"}
IDENTICAL_TITLE = "identical joints"


def find_fine_joints(run: Run[BoardDropCase], folder: Path) -> FineJoints:
    """Return the fine joints of the two-scale run; find the critical ones by a run with all joints coarse.

    That run, in the folder ``coarse``, is a two-scale run as well, because the board then keeps its large step. It also
    finds the end of a damped shock of automatic duration.

    Args:
        run: Run folder with assembly and joints, case, cores.
        folder: Folder of the shock, into which the coarse run and ``fine_joints.json`` are written.

    Returns:
        Names of the joints with a fine mesh, or "all", and the reason for the choice.

    Raises:
        LaunchError: The run failed; the message contains its last lines.
    """
    coupling, modes = run.case.shock.coupling, run.case.shock.numerics.modes
    if coupling.fine_joints != "critical" or "two_scale" not in modes:
        return named_joints(coupling)
    all_coarse = coupling.model_copy(update={"fine_joints": "all", "direction": "two_way"})
    request = _request(run, "two_scale", ("assembly", "coarse_joints"), all_coarse)
    request["checkpoints"] = str(run.checkpoints("shock").resolve() / "coarse")
    request["settles"] = run.case.shock.duration == "auto"
    run_fem(run, folder / "coarse", request, "shock, coarse joints")
    fine = most_stressed(folder / "coarse/history.npz", coupling.critical_joints)
    if run.case.shock.duration == "auto" and run.case.shock.damping.acts:
        fine = with_end(fine, folder / "coarse/history.npz")
    write_fine_joints(folder, fine)
    return fine


def run_mode(run: Run[BoardDropCase], folder: Path, mode: str, fine: FineJoints, prefix: str = "") -> None:
    """Run one mode of the shock on its MPI ranks and show its progress.

    Args:
        run: Run folder with assembly and joints, case, cores.
        folder: Folder for the products of the mode.
        mode: "two_scale" (macro and meso model coupled), or "dns" (one model with all joints fine).
        fine: Fine joints of a two-scale run; ignored for "dns".
        prefix: Prefix of the names of the meshes; empty for real joints.

    Raises:
        LaunchError: The run failed; the message contains its last lines.
    """
    chosen = fine.names if mode == "two_scale" else "all"
    coupling = run.case.shock.coupling.model_copy(update={"fine_joints": chosen})
    request = _request(run, mode, (f"{prefix}assembly", f"{prefix}joints"), coupling)
    if not prefix and mode == next(name for name in MODES if name in run.case.shock.numerics.modes):
        request["shock"]["modes"] = run.case.shock.modes
    request |= _end_of_shock(run, folder.parent, fine)
    if mode == "two_scale" and needs_coarse_joints(coupling):
        request["coarse_joints"] = _mesh(run, f"{prefix}coarse_joints")
    request["checkpoints"] = str(run.checkpoints("shock").resolve() / folder.name)
    request = with_initial_stress(run, folder.parent, request, prefix)
    run_fem(run, folder, request, f"shock, {MODES[mode]}" + (f", {IDENTICAL_TITLE}" if prefix else ""))


def _end_of_shock(run: Run[BoardDropCase], folder: Path, fine: FineJoints) -> dict:
    """Return the input that ends a run of duration ``auto``.

    The coarse run decides; without one, the first mode ends when it settles. Other modes end with the first.
    """
    if run.case.shock.duration != "auto":
        return {}
    result = folder / run.case.shock.numerics.modes[0] / "result.json"
    if not result.exists():
        return {"settles": True} if fine.end is None else {"end": fine.end}
    model = read_json(result)["model"]
    return {"end": model["window"] * model["windows"]}


def _mesh(run: Run[BoardDropCase], name: str) -> str:
    return str(run.folder.resolve() / f"solder_mesh/{name}.msh")


def _request(run: Run[BoardDropCase], mode: str, meshes: tuple[str, ...], coupling: JointCoupling) -> dict:
    """Return the input of the package ``fem`` for a run, except its folders and natural modes."""
    case = decided(run.case)
    shock = case.shock.model_copy(update={"coupling": coupling, "modes": 0})
    return {
        "mode": mode,
        "meshes": [_mesh(run, name) for name in meshes],
        "shock": shock.model_dump(mode="json", exclude={"failure"}),
        "materials": case.materials.model_dump(mode="json"),
        **fittings.fem_input(case),
    }


def read_results(folder: Path) -> dict[str, dict]:
    """Return ``result.json`` of each mode that ran, two-scale first.

    Args:
        folder: Folder of the shock, with a folder for each mode.

    Returns:
        Mode -> content of its ``result.json`` (``model``, ``metrics``, ``health``, ``timings``, ``coupling``).
    """
    return {
        mode: json.loads((folder / mode / "result.json").read_text(encoding="utf-8"))
        for mode in MODES
        if (folder / mode).is_dir()
    }
