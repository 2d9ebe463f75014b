"""Launch of the modes of a shock as MPI runs of the package ``fem``."""

import json
from collections.abc import Sequence
from pathlib import Path

from reflowshock.parameters import with_value
from reflowshock.workflow.board_drop import fittings
from reflowshock.workflow.board_drop.board_deflection import decided
from reflowshock.workflow.board_drop.fine_joints import FineJoints, needs_coarse_joints
from reflowshock.workflow.board_drop.shock_cooling import with_initial_stress
from reflowshock.workflow.case.run import Run
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.process.fem_launch import run_fem
from reflowshock.workflow.process.products import read_json, simulated_time

MODES = {"two_scale": "two-scale", "dns": "DNS"}
IDENTICAL_TITLE = "identical joints"


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
    case = with_value(run.case, "shock.coupling.fine_joints", chosen)
    request = shock_request(case, mode, (_mesh(run, f"{prefix}assembly"), _mesh(run, f"{prefix}joints")))
    if not prefix and mode == main_mode(run.case):
        request["shock"]["modes"] = run.case.shock.modes
    request |= _end_of_shock(run, folder.parent, fine)
    if mode == "two_scale" and needs_coarse_joints(case.shock.coupling):
        request["coarse_joints"] = str(_mesh(run, f"{prefix}coarse_joints"))
    request["checkpoints"] = str(run.checkpoints("shock").resolve() / folder.name)
    request = with_initial_stress(run, folder.parent, request, prefix)
    run_fem(run, folder, request, f"shock, {MODES[mode]}" + (f", {IDENTICAL_TITLE}" if prefix else ""))


def main_mode(case: BoardDropCase) -> str:
    """Return the mode whose results represent a drop: "two_scale" if it is run, otherwise "dns"."""
    return next(mode for mode in MODES if mode in case.shock.numerics.modes)


def _end_of_shock(run: Run[BoardDropCase], folder: Path, fine: FineJoints) -> dict:
    """Return the input that ends a run of duration ``auto``.

    The coarse run decides; without one, the first mode ends when it settles. Other modes end with the first.
    """
    if run.case.shock.duration != "auto":
        return {}
    result = folder / run.case.shock.numerics.modes[0] / "result.json"
    if not result.exists():
        return {"settles": True} if fine.end is None else {"end": fine.end}
    return {"end": simulated_time(read_json(result))}


def _mesh(run: Run[BoardDropCase], name: str) -> Path:
    return run.folder / f"solder_mesh/{name}.msh"


def shock_request(case: BoardDropCase, mode: str, meshes: Sequence[Path]) -> dict:
    """Return the input of the package ``fem`` for one mode of a shock, except its folders and natural modes.

    Args:
        case: Case whose fine joints are named, or "all".
        mode: "two_scale" (macro and meso model coupled), or "dns" (one model with all joints fine).
        meshes: Files of the assembly (board and package) and of the joints.
    """
    case = with_value(decided(case), "shock.modes", 0)
    return {
        "mode": mode,
        "meshes": [str(path.resolve()) for path in meshes],
        "shock": case.shock.model_dump(mode="json", exclude={"failure"}),
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
