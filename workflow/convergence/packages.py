"""Convergence studies of a package: particle spacing; in a drop also meshes and the coupling of board and joints."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import floor, pi, sqrt
from pathlib import Path
from typing import Any

from reflowshock.meshing.board.pads import pad_table
from reflowshock.units import from_si
from reflowshock.workflow.board_drop.coarser_case import rounded_count
from reflowshock.workflow.board_drop.duration import longest_duration
from reflowshock.workflow.board_drop.shock_forecast import implicit_seconds
from reflowshock.workflow.convergence.convergence_study import ConvergenceStudy, Parameter, Quantity, StudyRun, resample
from reflowshock.workflow.convergence.error_estimate import first_model
from reflowshock.workflow.package.case import BoardDropCase, PackageCase
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.store.product import read_record

REFINED = (2.0, 1.5, 1.0, 0.75, 0.5, 0.4, 0.25)  # element sizes relative to the case
TWO_MODELS = (2.0, 1.5, 1.0, 0.75, 0.5)  # the same with two models
ALONE, FINEST = (1.5, 1.0, 0.75), 0.5  # board or joints alone, and their reference
FINE = (1, 3)  # numbers of fine joints, the most stressed ones
FEW = 8  # largest number of joints that are all fine while meshes are varied
SAME_MESH = "all x 1"  # the mesh of the case
GRAIN = 0.05  # step of sizes between the measured ones
SPACINGS, FINEST_SPACING = (2.0, 1.5, 1.25), 1.0  # particle spacings relative to the case, and their reference
MESH, BOARD, JOINTS = "element size", "element size of board and package", "element size of joints"
ROUNDING = 1e-9

ERRORS = {
    "peel_stress": "peel stress of the critical joint, peak",
    "layer_von_mises": "von Mises stress of the solder layer, peak",
    "layer_plastic_work": "plastic work density of the solder layer",
    "section_axial_force": "axial force of the critical joint, peak",
    "section_bending_moment": "bending moment of the critical joint, peak, over axial force times pad radius",
    "stress_history": "von Mises stress of the solder layers, L2 over time",
    "deflection": "deflection of board and die, L2 over time",
}
SIDES = ("von_mises_board", "von_mises_package")
DEFLECTIONS = ("board_centre", "die_centre")

TWO_SCALE = {"shock.numerics.modes": '["two_scale"]', "shock.identical_joints": "false"}
TRUE_MASS = {"shock.numerics.mass_scaled": "[]"}  # two models can use the small step of unscaled copper

Settings = dict[str, str]


def package_study(case: PackageCase) -> ConvergenceStudy:
    """Return the study of a package without a drop: the particle spacing of its joints.

    Returns:
        Varied parameters, further runs, and the function that measures their errors.
    """
    errors = {"joint_width_error_max": "largest width, worst joint"}
    return ConvergenceStudy(
        "reflow", ("reflow",), errors, _widths, (_particles(case, {}, (*SPACINGS, FINEST_SPACING)),)
    )


def board_drop_study(case: BoardDropCase) -> ConvergenceStudy:
    """Return the study of a board drop: element sizes, particle spacing, and couplings on the mesh of the case.

    In a linear case one model in implicit steps varies the meshes. With plasticity or finite rotations one model would
    take small explicit steps everywhere, so two models vary the meshes. If there are few joints all are fine: coarse
    joints are tied to boxes, which become softer as they are refined. Where masses are scaled to a time step, the step
    is proportional to the element size.

    Returns:
        Varied parameters, further runs, and the function that measures their errors.
    """
    linear = _is_linear(case)
    whole = _one_model(case) if linear else _mostly_fine(case)
    parts = [
        _board(case, whole).with_reference(FINEST),
        _joints(case, whole).with_reference(FINEST),
        _particles(case, whole, SPACINGS).with_reference(FINEST_SPACING),
    ]
    meshes = (_mesh(case, whole), _critical(case)) if linear else (_mesh(case, whole),)
    parameters = (*meshes, *(parameter for parameter, _ in parts))
    choices = (*(finest for _, finest in parts), *_couplings(case, whole))
    if case.shock.duration == "auto":  # all runs must cover the same time
        duration = {"shock.duration": from_si(longest_duration(case), "ms", digits=6)}
        parameters = tuple(parameter.with_settings(duration) for parameter in parameters)
        choices = tuple(run.with_settings(duration) for run in choices)
    return ConvergenceStudy("shock", ("shock",), ERRORS, _motion, parameters, choices)


def _widths(case: Any, run_folder: Path) -> dict[str, Quantity]:
    record = read_record(run_folder / "reflow") or {"metrics": {}}
    name = "joint_width_error_max"
    return {name: Quantity(record["metrics"][name]["value"], 0.0, 1.0, "Young-Laplace")}


def _motion(case: Any, run_folder: Path) -> dict[str, Quantity]:
    """Return peaks and history of the critical joint, and deflection histories of board and die."""
    import numpy as np

    folder = first_model(run_folder / "shock")
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
        "stress_history": Quantity(resample(stress, SIDES, duration, count)),
        "deflection": Quantity(resample(history, DEFLECTIONS, duration, count)),
    }


def _is_linear(case: BoardDropCase) -> bool:
    return implicit_seconds(case) is not None and case.shock.numerics.kinematics == "small"


def _one_model(case: BoardDropCase, solver: str = "") -> Settings:
    """Return settings of one model with all joints fine over the full duration.

    A linear case uses implicit steps and the true mass of copper.
    """
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
    """Return the size of all elements as a parameter."""
    return _sized(MESH, "all", REFINED, lambda size: whole | _board_elements(case, size) | _joint_elements(case, size))


def _critical(case: BoardDropCase) -> Parameter:
    """Return the size of all elements as a parameter of two models with only the critical joint fine."""
    fine = _fine(1)
    return _sized(
        f"{MESH}, one fine joint",
        "1 fine",
        TWO_MODELS,
        lambda size: fine | _board_elements(case, size) | _joint_elements(case, size),
    )


def _fine(count: int) -> Settings:
    """Return settings of two models with ``count`` fine joints, the most stressed ones."""
    key = "shock.coupling"
    return TWO_SCALE | {f"{key}.fine_joints": "critical", f"{key}.critical_joints": f"{count}"}


def _mostly_fine(case: BoardDropCase) -> Settings:
    """Return settings of two models with all joints fine if they are few, else the largest number of the study."""
    few = len(pad_table(case.package, case.board, case.warpage)) <= FEW
    return TWO_SCALE | {"shock.coupling.fine_joints": "all"} if few else _fine(max(FINE))


def _board(case: BoardDropCase, whole: Settings) -> Parameter:
    """Return the element size of board and package as a parameter; joints keep their mesh."""
    return _sized(BOARD, "board", ALONE, lambda size: whole | _board_elements(case, size))


def _joints(case: BoardDropCase, whole: Settings) -> Parameter:
    """Return the element size of joints as a parameter; board and package keep their mesh."""
    return _sized(JOINTS, "joints", ALONE, lambda size: whole | _joint_elements(case, size))


def _particles(case: PackageCase, settings: Settings, values: tuple[float, ...]) -> Parameter:
    """Return the particle spacing of the joints, which determines their shape, as a parameter."""
    case_spacing = case.solder.numerics.spacing

    def run_at(value: float) -> StudyRun:
        spacing = from_si(value * case_spacing, "mm", digits=3)
        return StudyRun(
            f"spacing {spacing}", "particle spacing", settings | {"solder.numerics.spacing": spacing}, value
        )

    return Parameter("particle spacing", values, run_at)


def _sized(parameter: str, word: str, sizes: tuple[float, ...], settings: Callable[[float], Settings]) -> Parameter:
    """Return a parameter whose values are element sizes relative to the case, in steps of ``GRAIN``."""

    def run_at(value: float) -> StudyRun:
        size = GRAIN * floor(value / GRAIN + ROUNDING)
        return StudyRun(f"{word} x {size:.3g}", parameter, settings(size), size)

    return Parameter(parameter, sizes, run_at)


def _board_elements(case: BoardDropCase, size: float) -> dict[str, str]:
    """Return settings that multiply the element size of board, substrate and die by ``size``."""
    board, package = case.board.numerics, case.package
    layers = rounded_count(board.layers, size)
    return {
        "board.numerics.element_size": _length(size * board.element_size),
        "board.numerics.coarse_size": _length(size * board.coarse_size),
        "board.numerics.layers": f"{layers}",
        "board.numerics.patch_layers": f"{max(1, round(layers * board.patch_layers / board.layers))}",
        "package.numerics.element_size": _length(size * package.numerics.element_size),
        "package.substrate.elements": f"{rounded_count(package.substrate.elements, size)}",
        "package.die.elements": f"{rounded_count(package.die.elements, size)}",
    }


def _joint_elements(case: BoardDropCase, size: float) -> dict[str, str]:
    """Return settings that multiply the element size of fine joints by ``size``."""
    numerics, key = case.package.joint_numerics, "package.joint_numerics"
    settings = {
        f"{key}.core": f"{rounded_count(numerics.core, size)}",
        f"{key}.rings": f"{rounded_count(numerics.rings, size)}" if numerics.rings else "0",
        f"{key}.layers": f"{max(2, rounded_count(numerics.layers, size))}",
    }
    if numerics.copper_layers > 1:
        settings |= {f"{key}.copper_layers": f"{rounded_count(numerics.copper_layers, size)}"}
    if numerics.pad_layer is not None:
        settings |= {f"{key}.pad_layers": f"{rounded_count(numerics.pad_layers, size)}"}
    scaled = case.shock.numerics.mass_scaled_step
    if scaled is not None:  # keeps the added share of mass; at a fixed step it would grow with refinement
        settings |= {"shock.numerics.mass_scaled_step": from_si(size * scaled, "ns", digits=4)}
    return settings | _column_elements(case, size)


def _column_elements(case: BoardDropCase, size: float) -> dict[str, str]:
    """Return settings that multiply the element size of the columns of fine joints, if there are columns."""
    imprint, key = case.package.imprint, "package.imprint"
    if imprint is None:
        return {}
    return {
        f"{key}.rings": f"{rounded_count(imprint.rings, size)}",
        f"{key}.first_layer": _length(size * imprint.first_layer),
        f"{key}.growth": f"{1.0 + size * (imprint.growth - 1.0):.4g}",
    }


def _length(value: float) -> str:
    return from_si(value, "mm", digits=4)


def _couplings(case: BoardDropCase, whole: Settings) -> Iterator[StudyRun]:
    """Yield couplings on the mesh of the case, each against the finest run and against one model on the same mesh."""
    for name, settings in (_two_models(case) | _explicit(case)).items():
        if settings == whole:
            continue
        if settings != _fine(1) or not _is_linear(case):  # else it is already a run of the element size
            yield StudyRun(name, "coupling", settings)
        yield StudyRun(f"{name}: alone", "coupling, same mesh", settings, None, SAME_MESH)


def _two_models(case: BoardDropCase) -> dict[str, Settings]:
    """Return two-model variants, name -> settings: number of fine joints, coupling schemes, one-way coupling."""
    key, joints = "shock.coupling", len(pad_table(case.package, case.board, case.warpage))
    all_fine = TWO_SCALE | {f"{key}.fine_joints": "all"}
    few = {f"{count} fine": _fine(count) for count in FINE if count < joints}
    variants = few | {f"{name}, one way": settings | {f"{key}.direction": "one_way"} for name, settings in few.items()}
    variants |= {"all fine": all_fine, "all fine, held velocity": all_fine | {f"{key}.scheme": "held_velocity"}}
    if _is_linear(case) and not case.shock.numerics.mass_scaled:
        variants["all fine, one level"] = all_fine | {f"{key}.scheme": "local_steps", f"{key}.levels": "1"}
    if case.shock.numerics.mass_scaled:
        variants |= {f"{name}, true mass": settings | TRUE_MASS for name, settings in few.items()}
    return variants


def _explicit(case: BoardDropCase) -> dict[str, Settings]:
    """Return one-model variants in explicit steps, name -> settings."""
    if not _is_linear(case):
        return {"one model": _one_model(case)}
    explicit, scaled = _one_model(case, "explicit"), case.shock.numerics.mass_scaled
    if not scaled:
        return {"explicit": explicit}
    names = "[" + ", ".join(f'"{name}"' for name in scaled) + "]"
    return {"explicit, true mass": explicit, "explicit": explicit | {"shock.numerics.mass_scaled": names}}
