"""Convergence study of a package that is dropped: its mesh, joints, particles, and how joints and board are coupled."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import floor, pi, sqrt
from pathlib import Path
from typing import Any

from reflowshock.meshing.board.pads import pad_table
from reflowshock.units import from_si
from reflowshock.workflow.board_drop.duration import longest_duration
from reflowshock.workflow.board_drop.shock_forecast import implicit_seconds
from reflowshock.workflow.board_drop.shock_launch import MODES
from reflowshock.workflow.convergence.series import ConvergenceStudy, Parameter, Quantity, StudyRun, at_same_times
from reflowshock.workflow.package.case import BoardDropCase, PackageCase
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.store.product import read_record

REFINED = (2.0, 1.5, 1.0, 0.75, 0.5, 0.4, 0.25)  # sizes of elements over those of the case
TWO_MODELS = (2.0, 1.5, 1.0, 0.75, 0.5)  # the same with two models
ALONE, FINEST = (1.5, 1.0, 0.75), 0.5  # of board or joints alone, against the finest of them
FINE = (1, 3)  # most stressed joints that are fine
FEW = 8  # joints, below which all of them are fine while meshes are varied
SAME_MESH = "all x 1"  # the mesh of the case
GRAIN = 0.05  # of sizes that are chosen between the measured ones
SPACINGS, FINEST_SPACING = (2.0, 1.5, 1.25), 1.0  # of particles, over that of the case
MESH, BOARD, JOINTS = "element size", "element size of board and package", "element size of joints"
ROUNDING = 1e-9

ERRORS = {
    "peel_stress": "peel stress of the critical joint, peak",
    "layer_von_mises": "von Mises stress of its solder layer, peak",
    "layer_plastic_work": "plastic work density of its solder layer",
    "section_axial_force": "its axial force, peak",
    "section_bending_moment": "its bending moment, peak, over axial force times pad radius",
    "stress_history": "von Mises stress of its solder layers, L2 over time",
    "deflection": "deflection of board and die, L2 over time",
}
SIDES = ("von_mises_board", "von_mises_package")
DEFLECTIONS = ("board_centre", "die_centre")

TWO_SCALE = {"shock.numerics.modes": '["two_scale"]', "shock.identical_joints": "false"}
TRUE_MASS = {"shock.numerics.mass_scaled": "[]"}  # of copper, whose step two models can do with

Settings = dict[str, str]


def package_study(case: PackageCase) -> ConvergenceStudy:
    """Vary what a package has: all of its shock where it is dropped, else the particles of its joints."""
    if isinstance(case, BoardDropCase):
        return _dropped(case)
    errors = {"joint_width_error_max": "largest width, worst joint"}
    return ConvergenceStudy(
        "reflow", ("reflow",), errors, _widths, (_particles(case, {}, (*SPACINGS, FINEST_SPACING)),)
    )


def _dropped(case: BoardDropCase) -> ConvergenceStudy:
    """Meshes; then what other couplings on the case's mesh lose.

    Where all is linear, meshes are varied by one model in implicit steps. One that yields or turns takes small explicit
    steps everywhere: there two models vary them. All joints are fine as long as they are few: coarse ones are tied to
    boxes, and the softer the finer these are. Where masses are scaled to a step, this is as long as the elements are.
    """
    linear = _is_linear(case)
    whole = _one_model(case) if linear else _mostly_fine(case)
    parts = [
        _board(case, whole).apart(FINEST),
        _joints(case, whole).apart(FINEST),
        _particles(case, whole, SPACINGS).apart(FINEST_SPACING),
    ]
    meshes = (_mesh(case, whole), _critical(case)) if linear else (_mesh(case, whole),)
    parameters = (*meshes, *(parameter for parameter, _ in parts))
    choices = (*(finest for _, finest in parts), *_couplings(case, whole))
    if case.shock.duration == "auto":  # runs are compared over the same time
        given = {"shock.duration": from_si(longest_duration(case), "ms", digits=6)}
        parameters = tuple(parameter.under(given) for parameter in parameters)
        choices = tuple(run.under(given) for run in choices)
    return ConvergenceStudy("shock", ("shock",), ERRORS, _motion, parameters, choices)


def _widths(case: Any, run_folder: Path) -> dict[str, Quantity]:
    record = read_record(run_folder / "reflow") or {"metrics": {}}
    name = "joint_width_error_max"
    return {name: Quantity(record["metrics"][name]["value"], 0.0, 1.0, "Young-Laplace")}


def _motion(case: Any, run_folder: Path) -> dict[str, Quantity]:
    """Peaks and history of the critical joint, and histories of the board's and the die's centre."""
    import numpy as np

    folder = next(folder for mode in MODES if (folder := run_folder / "shock" / mode).is_dir())
    with np.load(folder / "history.npz") as arrays:
        history = dict(arrays)
    metrics = read_json(folder / "result.json")["metrics"]
    joint = list(history["joints"]).index(metrics["critical_joint"]["value"])
    stress = {"time": history["time"], **{side: history[side][:, joint] for side in SIDES}}
    duration, count = case.shock.decided_duration, case.shock.numerics.history_samples + 1
    peaks = {name: Quantity(metrics[name]["value"]) for name in ERRORS if name in metrics}
    moment = peaks["section_bending_moment"]
    force, peel = (float(metrics[name]["value"]) for name in ("section_axial_force", "peel_stress"))
    scale = force * sqrt(force / peel / pi) if force > 0.0 < peel else None
    return peaks | {
        "section_bending_moment": replace(moment, scale=scale),
        "stress_history": Quantity(at_same_times(stress, SIDES, duration, count)),
        "deflection": Quantity(at_same_times(history, DEFLECTIONS, duration, count)),
    }


def _is_linear(case: BoardDropCase) -> bool:
    return implicit_seconds(case) is not None and case.shock.numerics.kinematics == "small"


def _one_model(case: BoardDropCase, solver: str = "") -> Settings:
    """One model with all joints fine, to the end; where all is linear, in implicit steps, copper at its true mass."""
    implicit = _is_linear(case)
    settings = {
        "shock.numerics.modes": '["dns"]',
        "shock.numerics.dns_solver": solver or ("implicit" if implicit else "explicit"),
        "shock.identical_joints": "false",
    }
    if case.shock.numerics.dns_duration is not None:
        settings["shock.numerics.dns_duration"] = from_si(longest_duration(case), "ms", digits=6)
    return settings | TRUE_MASS if implicit else settings


def _mesh(case: BoardDropCase, whole: Settings) -> Parameter:
    """All elements of board, package and joints."""
    return _sized(MESH, "all", REFINED, lambda size: whole | _of_board(case, size) | _of_joints(case, size))


def _critical(case: BoardDropCase) -> Parameter:
    """All elements, with two models of which one has the critical joint alone fine."""
    fine = _fine(1)
    return _sized(
        f"{MESH}, one fine joint",
        "1 fine",
        TWO_MODELS,
        lambda size: fine | _of_board(case, size) | _of_joints(case, size),
    )


def _fine(count: int) -> Settings:
    """Two models, as many joints fine as are given, the most stressed ones."""
    key = "shock.coupling"
    return TWO_SCALE | {f"{key}.fine_joints": "critical", f"{key}.critical_joints": f"{count}"}


def _mostly_fine(case: BoardDropCase) -> Settings:
    """Two models, all joints fine where they are few, else as many as the study tries."""
    few = len(pad_table(case.package, case.board, case.warpage)) <= FEW
    return TWO_SCALE | {"shock.coupling.fine_joints": "all"} if few else _fine(max(FINE))


def _board(case: BoardDropCase, whole: Settings) -> Parameter:
    """Elements of board and package, joints as they are."""
    return _sized(BOARD, "board", ALONE, lambda size: whole | _of_board(case, size))


def _joints(case: BoardDropCase, whole: Settings) -> Parameter:
    """Elements of joints, board and package as they are."""
    return _sized(JOINTS, "joints", ALONE, lambda size: whole | _of_joints(case, size))


def _particles(case: PackageCase, settings: Settings, values: tuple[float, ...]) -> Parameter:
    """Spacing of the particles of the joints, on which their shape depends."""
    own = case.solder.numerics.spacing

    def at(value: float) -> StudyRun:
        spacing = from_si(value * own, "mm", digits=3)
        return StudyRun(
            f"spacing {spacing}", "particle spacing", settings | {"solder.numerics.spacing": spacing}, value
        )

    return Parameter("particle spacing", values, at)


def _sized(parameter: str, word: str, sizes: tuple[float, ...], settings: Callable[[float], Settings]) -> Parameter:
    """A parameter whose values are sizes over those of the case, as finely as ``GRAIN``."""

    def at(value: float) -> StudyRun:
        size = GRAIN * floor(value / GRAIN + ROUNDING)
        return StudyRun(f"{word} x {size:.3g}", parameter, settings(size), size)

    return Parameter(parameter, sizes, at)


def _of_board(case: BoardDropCase, size: float) -> dict[str, str]:
    """Elements of board, substrate and die that are so many times as large."""
    board, package = case.board.numerics, case.package
    layers = _count(board.layers, size)
    return {
        "board.numerics.element_size": _length(size * board.element_size),
        "board.numerics.coarse_size": _length(size * board.coarse_size),
        "board.numerics.layers": f"{layers}",
        "board.numerics.patch_layers": f"{max(1, round(layers * board.patch_layers / board.layers))}",
        "package.numerics.element_size": _length(size * package.numerics.element_size),
        "package.substrate.elements": f"{_count(package.substrate.elements, size)}",
        "package.die.elements": f"{_count(package.die.elements, size)}",
    }


def _of_joints(case: BoardDropCase, size: float) -> dict[str, str]:
    """Elements of fine joints that are so many times as large."""
    own, key = case.package.joint_numerics, "package.joint_numerics"
    settings = {
        f"{key}.core": f"{_count(own.core, size)}",
        f"{key}.rings": f"{_count(own.rings, size)}" if own.rings else "0",
        f"{key}.layers": f"{max(2, _count(own.layers, size))}",
    }
    if own.copper_layers > 1:
        settings |= {f"{key}.copper_layers": f"{_count(own.copper_layers, size)}"}
    if own.pad_layer is not None:
        settings |= {f"{key}.pad_layers": f"{_count(own.pad_layers, size)}"}
    scaled = case.shock.numerics.mass_scaled_step
    if scaled is not None:  # the same share of mass is added then; at one step it would grow with the mesh
        settings |= {"shock.numerics.mass_scaled_step": from_si(size * scaled, "ns", digits=4)}
    return settings | _of_columns(case, size)


def _of_columns(case: BoardDropCase, size: float) -> dict[str, str]:
    """Elements of the columns of fine joints that are so many times as large, where there are columns."""
    imprint, key = case.package.imprint, "package.imprint"
    if imprint is None:
        return {}
    return {
        f"{key}.rings": f"{_count(imprint.rings, size)}",
        f"{key}.first_layer": _length(size * imprint.first_layer),
        f"{key}.growth": f"{1.0 + size * (imprint.growth - 1.0):.4g}",
    }


def _count(own: int, size: float) -> int:
    return max(1, floor(own / size + 0.5))


def _length(value: float) -> str:
    return from_si(value, "mm", digits=4)


def _couplings(case: BoardDropCase, whole: Settings) -> Iterator[StudyRun]:
    """Two models, or one in explicit steps, on the mesh of the case; also against the run that varies that mesh."""
    for name, settings in (_two_models(case) | _explicit(case)).items():
        if settings == whole:
            continue
        if settings != _fine(1) or not _is_linear(case):  # else it is on the way of all meshes
            yield StudyRun(name, "coupling", settings)
        yield StudyRun(f"{name}: alone", "coupling, same mesh", settings, None, SAME_MESH)


def _two_models(case: BoardDropCase) -> dict[str, Settings]:
    """Extent of the fine region, schemes, one way; name -> settings."""
    key, joints = "shock.coupling", len(pad_table(case.package, case.board, case.warpage))
    every = TWO_SCALE | {f"{key}.fine_joints": "all"}
    few = {f"{count} fine": _fine(count) for count in FINE if count < joints}
    ways = few | {f"{name}, one way": settings | {f"{key}.direction": "one_way"} for name, settings in few.items()}
    ways |= {"all fine": every, "all fine, held velocity": every | {f"{key}.scheme": "held_velocity"}}
    if _is_linear(case) and not case.shock.numerics.mass_scaled:
        ways["all fine, one level"] = every | {f"{key}.scheme": "local_steps", f"{key}.levels": "1"}
    if case.shock.numerics.mass_scaled:
        ways |= {f"{name}, true mass": settings | TRUE_MASS for name, settings in few.items()}
    return ways


def _explicit(case: BoardDropCase) -> dict[str, Settings]:
    """One model in explicit steps; name -> settings."""
    if not _is_linear(case):
        return {"one model": _one_model(case)}
    explicit, scaled = _one_model(case, "explicit"), case.shock.numerics.mass_scaled
    if not scaled:
        return {"explicit": explicit}
    names = "[" + ", ".join(f'"{name}"' for name in scaled) + "]"
    return {"explicit, true mass": explicit, "explicit": explicit | {"shock.numerics.mass_scaled": names}}
