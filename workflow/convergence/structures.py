"""Convergence study of a structure: element size, one model or two, schemes, time steps, solvers, element shapes."""

from collections.abc import Callable, Mapping
from functools import partial
from math import ceil
from pathlib import Path
from typing import Any

from reflowshock.problem import Problem
from reflowshock.units import from_si
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.convergence.convergence_study import (
    ConvergenceStudy,
    Parameter,
    Quantity,
    StudyRun,
    resample,
    sample_times,
)
from reflowshock.workflow.process.environment import available_cores
from reflowshock.workflow.store.product import read_record
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.findings import exact_velocities, read_history, read_positions, wave_points
from reflowshock.workflow.structure.references import BarWave, Cantilever, LayeredBar
from reflowshock.workflow.structure.stages import solver_folders

SECOND = 2.0  # order of central differences and of trilinear elements (Hughes, The Finite Element Method, 9.2)
REFINED = (0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0, 2.5, 4.0)  # factors on the numbers of elements of the case
ALONE = (0.3, 0.5, 0.8, 1.2)  # the same for one model if the case has two
IMPLICIT = (0.5, 0.7, 1.0, 1.4)
GRAIN = 0.05  # step of refinements between the measured ones
COARSE = 0.5  # refinement of the mesh on which time steps are varied
FRACTIONS = (0.9, 0.64, 0.45, 0.32)  # explicit steps over the critical step
REFERENCE_FRACTION = 0.1
IMPLICIT_FACTORS = (2.0, 1.4, 1.0, 0.7)  # factors on the implicit step of the case
REFERENCE_FACTOR = 0.2
SCHEMES_AT = 0.8  # refinement of the mesh on which schemes are compared, one of ALONE
SCHEMES = ("local_steps", "held_velocity", "impulse", "gravouil_combescure")
SHAPES = {"tetrahedron": "tet4", "tetrahedron_quadratic": "tet10"}
ELEMENT_SIZE, TIME_STEP = "element size", "time step"
ROUNDING = 1e-9

WAVE = {"wave_error": "velocities at the watch points, L2 over time"}
SWING = {"tip_deflection_error": "static deflection of the tip", "swing_frequency_error": "first frequency"}
CURVES = {"displacement": "displacements of the watch points, L2 over time", "strain": "their strains, L2 over time"}

Settings = dict[str, str]


def structure_study(case: StructureCase) -> ConvergenceStudy:
    """Return the study of a structure: element size, time step, and the solvers and schemes that the case supports.

    Returns:
        Varied parameters, further runs, and the function that measures their errors.
    """
    errors, measure = _judged_quantities(case)
    solver = _single_solver(case)
    steps, smallest = _steps(case, solver)
    parameters = (_elements(ELEMENT_SIZE, "", solver, REFINED, case), *_other_solvers(case), steps)
    choices = (smallest, *_schemes(case, solver), *_shapes(case, solver))
    return ConvergenceStudy("comparison", ("shock",), errors, measure, parameters, choices)


Measure = Callable[[Any, Path], Mapping[str, Quantity]]


def _judged_quantities(case: StructureCase) -> tuple[Mapping[str, str], Measure]:
    """Return names of errors and their measure: exact waves or bending if available, else histories of watch points.

    Raises:
        CaseError: The case has neither an exact reference nor a watch point.
    """
    for reference in case.references.values():
        if reference.kind in EXACT_MEASURES:
            errors, measure = EXACT_MEASURES[reference.kind]
            return errors, partial(measure, reference)
    if not case.watch:
        message = "a convergence study requires an exact reference or a watch point"
        raise CaseError("case", [Problem("watch", message, None, "tables [watch.NAME]")])
    return CURVES, _curves


def _wave(reference: BarWave | LayeredBar, case: StructureCase, run_folder: Path) -> dict[str, Quantity]:
    """Return the velocities along the bar with the exact ones at the recorded nodes."""
    folder = _folder(run_folder)
    history, count = read_history(folder), case.dynamics.numerics.history_samples + 1
    axial = {f"{point}": history[f"velocity@{point}"][:, 2] for point in wave_points(reference)}
    velocities = resample({"time": history["time"], **axial}, axial, case.dynamics.duration, count)
    times = sample_times(case.dynamics.duration, count)
    exact = exact_velocities(case, reference, read_positions(folder), times)
    return {"wave_error": Quantity(velocities, exact, None, "waves in layers")}


def _swing(_reference: Cantilever, _case: StructureCase, run_folder: Path) -> dict[str, Quantity]:
    record = read_record(run_folder / "comparison") or {"metrics": {}}
    return {
        name: Quantity(record["metrics"][name]["value"], 0.0, 1.0, "beam theory")
        for name in SWING
        if name in record["metrics"]
    }


def _curves(case: StructureCase, run_folder: Path) -> dict[str, Quantity]:
    history, count = read_history(_folder(run_folder)), case.dynamics.numerics.history_samples + 1
    return {
        name: Quantity(resample(history, [f"{name}@{point}" for point in case.watch], case.dynamics.duration, count))
        for name in CURVES
    }


# Kind of an exact reference -> names of errors, function of reference, case and run folder.
EXACT_MEASURES: dict[str, tuple[Mapping[str, str], Callable[[Any, Any, Path], Mapping[str, Quantity]]]] = {
    "bar_wave": (WAVE, _wave),
    "layered_bar": (WAVE, _wave),
    "cantilever": (SWING, _swing),
}


def _folder(run_folder: Path) -> Path:
    """Return the results folder of the first solver."""
    return next(iter(solver_folders(run_folder / "shock").values()))


def _single_solver(case: StructureCase) -> Settings:
    """Return settings that run only the main solver of the case."""
    solver = "explicit" if case.dynamics.solver == "both" else case.dynamics.solver
    alone = {"dynamics.solver": solver} if solver != case.dynamics.solver else {}
    compared = case.dynamics.coupling is not None and case.dynamics.coupling.compare
    return alone | ({"dynamics.coupling.compare": "false"} if compared else {})


def _elements(name: str, suffix: str, base: Settings, refined: tuple[float, ...], case: StructureCase) -> Parameter:
    """Return the element size along all axes as a parameter; the explicit step is proportional to it."""

    def run_at(value: float) -> StudyRun:
        factor = GRAIN * ceil(1.0 / (GRAIN * value) - ROUNDING)
        return StudyRun(f"elements x {factor:.3g}{suffix}", name, base | _refine(case, factor), 1.0 / factor)

    return Parameter(name, tuple(1.0 / factor for factor in refined), run_at, _order(case))


def _order(case: StructureCase) -> float | None:
    """Return the order in the element size; None for a half-sine pulse in a bar, whose kinks are not smooth."""
    return None if any(reference.kind == "bar_wave" for reference in case.references.values()) else SECOND


def _refine(case: StructureCase, factor: float) -> Settings:
    return {"structure.refine": f"{factor * case.structure.refine:.6g}"}


def _other_solvers(case: StructureCase) -> list[Parameter]:
    """Return the element size with one model instead of two, or with the other solver if one linear model is used."""
    if case.dynamics.coupling is not None:
        return [_elements(f"{ELEMENT_SIZE}, one model", ", one model", {"dynamics.solver": "dns"}, ALONE, case)]
    if not _is_linear(case):
        return []
    other = "explicit" if case.dynamics.solver == "implicit" else "implicit"
    return [_elements(f"{ELEMENT_SIZE}, {other}", f", {other}", {"dynamics.solver": other}, IMPLICIT, case)]


def _is_linear(case: StructureCase) -> bool:
    yielding = any(material.plasticity is not None for material in case.problem.layer_materials.values())
    return not yielding and case.dynamics.kinematics == "small"


def _steps(case: StructureCase, solver: Settings) -> tuple[Parameter, StudyRun]:
    """Return the time step on a fixed mesh as a parameter, and the run with the reference step."""
    implicit = case.dynamics.solver == "implicit"
    values, smallest = (IMPLICIT_FACTORS, REFERENCE_FACTOR) if implicit else (FRACTIONS, REFERENCE_FRACTION)
    setting = _implicit_step(case) if implicit else _step_fraction
    base = solver | _refine(case, COARSE)

    def run_at(value: float) -> StudyRun:
        size, settings = setting(value)
        return StudyRun(f"step {size}", TIME_STEP, base | settings, value)

    return Parameter(TIME_STEP, values, run_at, SECOND).with_reference(smallest)


def _step_fraction(value: float) -> tuple[str, Settings]:
    """Return name and settings of an explicit step, given over the critical step."""
    return f"{value:.3g} critical", {"dynamics.numerics.step_fraction": f"{value:.3g}"}


def _implicit_step(case: StructureCase) -> Callable[[float], tuple[str, Settings]]:
    """Return the function from a factor on the implicit step of the case to the name and settings of a step."""
    from reflowshock.workflow.structure.forecast import forecast_layers, forecast_steps

    length = forecast_steps(case, forecast_layers(case))["implicit"]

    def setting(value: float) -> tuple[str, Settings]:
        step = from_si(value * length, "us", digits=3)
        return step, {"dynamics.numerics.implicit_step": step}

    return setting


def _schemes(case: StructureCase, solver: Settings) -> list[StudyRun]:
    """Return other coupling schemes, each against the exact motion and against one model on the same mesh."""
    if case.dynamics.coupling is None:
        return []
    mesh, key = _refine(case, SCHEMES_AT), "dynamics.coupling"
    usual = "local_steps" if _is_linear(case) else "held_velocity"
    chosen = case.dynamics.coupling.scheme
    variants: dict[str, Settings] = {"own scheme": {}} | {
        name.replace("_", " "): {f"{key}.scheme": name}
        for name in SCHEMES
        if name != (usual if chosen == "auto" else chosen) and (_is_linear(case) or name != "local_steps")
    }
    if _is_linear(case) and "own scheme" in variants and chosen in ("auto", "local_steps"):
        variants["one level"] = {f"{key}.scheme": "local_steps", f"{key}.levels": "1"}
    one_model = f"elements x {SCHEMES_AT:.3g}, one model"
    runs = []
    for name, settings in variants.items():
        run_settings = solver | mesh | settings
        if settings:
            runs.append(StudyRun(f"{name} x {SCHEMES_AT:.3g}", "scheme", run_settings))
        runs.append(StudyRun(f"{name} alone", "scheme, same mesh", run_settings, None, one_model))
    return runs + _placements(solver | mesh)


def _placements(base: Settings) -> list[StudyRun]:
    """Return placements of two models on two ranks: both models on each rank, or one model per rank."""
    if available_cores() < 2:
        return []
    ranks = base | {"dynamics.ranks": "2"}
    return [
        StudyRun(f"2 ranks, {name}", "placement", ranks | {"dynamics.coupling.placement": name})
        for name in ("shared", "disjoint")
    ]


def _shapes(case: StructureCase, solver: Settings) -> list[StudyRun]:
    """Return runs with tetrahedra instead of hexahedra, if no layers are tied."""
    body = case.structure
    tied = case.dynamics.coupling is not None or any(layer.in_plane for layer in body.layers.values())
    if tied or body.element != "hexahedron":
        return []
    return [
        StudyRun(
            f"{name} x {factor:g}", "shape of elements", solver | _refine(case, factor) | {"structure.element": element}
        )
        for element, name in SHAPES.items()
        for factor in (0.5, 1.0)
    ]
