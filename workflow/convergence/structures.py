"""Convergence study of a structure: element size, one model or two, schemes, time steps, solvers, element shapes."""

from collections.abc import Callable, Mapping
from functools import partial
from math import ceil
from pathlib import Path
from typing import Any

from reflowshock.problem import Problem
from reflowshock.units import from_si
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.convergence.series import (
    ConvergenceStudy,
    Parameter,
    Quantity,
    StudyRun,
    at_same_times,
    common_times,
)
from reflowshock.workflow.process.environment import available_cores
from reflowshock.workflow.store.product import read_record
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.findings import exact_velocities, read_history, read_positions, wave_points
from reflowshock.workflow.structure.references import BarWave, Cantilever, LayeredBar
from reflowshock.workflow.structure.stages import solver_folders

SECOND = 2.0  # order of central differences and of trilinear elements (Hughes, The Finite Element Method, 9.2)
REFINED = (0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0, 2.5, 4.0)  # times the numbers of elements of the case
ALONE = (0.3, 0.5, 0.8, 1.2)  # of one model, where the case has two
IMPLICIT = (0.5, 0.7, 1.0, 1.4)
GRAIN = 0.05  # of refinements that are chosen between the measured ones
COARSE = 0.5  # refinement of the mesh on which steps are varied
FRACTIONS = (0.9, 0.64, 0.45, 0.32)  # of the critical step
SMALLEST = 0.1  # the step that others are compared with, in critical steps
LENGTHENED = (2.0, 1.4, 1.0, 0.7)  # times the implicit step of the case
SHORTENED = 0.2
SCHEMES_AT = 0.8  # refinement of the mesh on which they are compared, one of ALONE
SCHEMES = ("local_steps", "held_velocity", "impulse", "gravouil_combescure")
SHAPES = {"tetrahedron": "tet4", "tetrahedron_quadratic": "tet10"}
ELEMENT_SIZE, TIME_STEP = "element size", "time step"
ROUNDING = 1e-9

WAVE = {"wave_error": "velocities at the watch points, L2 over time"}
SWING = {"tip_deflection_error": "static deflection of the tip", "swing_frequency_error": "first frequency"}
CURVES = {"displacement": "displacements of the watch points, L2 over time", "strain": "their strains, L2 over time"}

Settings = dict[str, str]


def structure_study(case: StructureCase) -> ConvergenceStudy:
    """Vary what a structure has; what is not there (two models, an implicit solver) is no parameter."""
    errors, measure = _answers(case)
    own = _own_solver(case)
    steps, smallest = _steps(case, own)
    parameters = (_elements(ELEMENT_SIZE, "", own, REFINED, case), *_other_solvers(case), steps)
    choices = (smallest, *_schemes(case, own), *_shapes(case, own))
    return ConvergenceStudy("comparison", ("shock",), errors, measure, parameters, choices)


Measure = Callable[[Any, Path], Mapping[str, Quantity]]


def _answers(case: StructureCase) -> tuple[Mapping[str, str], Measure]:
    """Return what is judged: exact waves or bending where the case has them, else motion and strain of watch points.

    Raises:
        CaseError: there are none.
    """
    for reference in case.references.values():
        if isinstance(reference, BarWave | LayeredBar):
            return WAVE, partial(_wave, reference)
        if isinstance(reference, Cantilever):
            return SWING, _swing
    if not case.watch:
        message = "has no watch point, and there is no exact reference: nothing can be compared"
        raise CaseError("case", [Problem("watch", message, None, "tables [watch.NAME]")])
    return CURVES, _curves


def _wave(reference: BarWave | LayeredBar, case: StructureCase, run_folder: Path) -> dict[str, Quantity]:
    """Velocities along the bar, and the exact ones where each of them is recorded."""
    folder = _folder(run_folder)
    history, count = read_history(folder), case.dynamics.numerics.history_samples + 1
    axial = {f"{point}": history[f"velocity@{point}"][:, 2] for point in wave_points(reference)}
    found = at_same_times({"time": history["time"], **axial}, axial, case.dynamics.duration, count)
    times = common_times(case.dynamics.duration, count)
    exact = exact_velocities(case, reference, read_positions(folder), times)
    return {"wave_error": Quantity(found, exact, None, "waves in layers")}


def _swing(case: StructureCase, run_folder: Path) -> dict[str, Quantity]:
    record = read_record(run_folder / "comparison") or {"metrics": {}}
    return {
        name: Quantity(record["metrics"][name]["value"], 0.0, 1.0, "beam theory")
        for name in SWING
        if name in record["metrics"]
    }


def _curves(case: StructureCase, run_folder: Path) -> dict[str, Quantity]:
    history, count = read_history(_folder(run_folder)), case.dynamics.numerics.history_samples + 1
    return {
        name: Quantity(
            at_same_times(history, [f"{name}@{point}" for point in case.watch], case.dynamics.duration, count)
        )
        for name in CURVES
    }


def _folder(run_folder: Path) -> Path:
    """Folder of the solver whose figures count."""
    return next(iter(solver_folders(run_folder / "shock").values()))


def _own_solver(case: StructureCase) -> Settings:
    """The solver of the case, alone."""
    solver = "explicit" if case.dynamics.solver == "both" else case.dynamics.solver
    alone = {"dynamics.solver": solver} if solver != case.dynamics.solver else {}
    compared = case.dynamics.coupling is not None and case.dynamics.coupling.compare
    return alone | ({"dynamics.coupling.compare": "false"} if compared else {})


def _elements(name: str, suffix: str, base: Settings, refined: tuple[float, ...], case: StructureCase) -> Parameter:
    """Numbers of elements along all axes; the explicit step follows."""

    def at(value: float) -> StudyRun:
        factor = GRAIN * ceil(1.0 / (GRAIN * value) - ROUNDING)
        return StudyRun(f"elements x {factor:.3g}{suffix}", name, base | _refine(case, factor), 1.0 / factor)

    return Parameter(name, tuple(1.0 / factor for factor in refined), at, _order(case))


def _order(case: StructureCase) -> float | None:
    """Order in the size of elements; none where a half-sine runs along a bar, whose kinks are no smooth motion."""
    return None if any(isinstance(one, BarWave) for one in case.references.values()) else SECOND


def _refine(case: StructureCase, factor: float) -> Settings:
    return {"structure.refine": f"{factor * case.structure.refine:.6g}"}


def _other_solvers(case: StructureCase) -> list[Parameter]:
    """One model where the case has two; where it has one that is linear, the solver that it has not."""
    if case.dynamics.coupling is not None:
        return [_elements(f"{ELEMENT_SIZE}, one model", ", one model", {"dynamics.solver": "dns"}, ALONE, case)]
    if not _is_linear(case):
        return []
    other = "explicit" if case.dynamics.solver == "implicit" else "implicit"
    return [_elements(f"{ELEMENT_SIZE}, {other}", f", {other}", {"dynamics.solver": other}, IMPLICIT, case)]


def _is_linear(case: StructureCase) -> bool:
    yielding = any(material.plasticity is not None for material in case.problem.layer_materials.values())
    return not yielding and case.dynamics.kinematics == "small"


def _steps(case: StructureCase, own: Settings) -> tuple[Parameter, StudyRun]:
    """The time step by itself, on one mesh, and the much smaller one that it is compared with."""
    implicit = case.dynamics.solver == "implicit"
    values, smallest = (LENGTHENED, SHORTENED) if implicit else (FRACTIONS, SMALLEST)
    setting = _implicit_step(case) if implicit else _step_fraction
    base = own | _refine(case, COARSE)

    def at(value: float) -> StudyRun:
        size, settings = setting(value)
        return StudyRun(f"step {size}", TIME_STEP, base | settings, value)

    return Parameter(TIME_STEP, values, at, SECOND).apart(smallest)


def _step_fraction(value: float) -> tuple[str, Settings]:
    """An explicit step in critical steps."""
    return f"{value:.3g} critical", {"dynamics.numerics.step_fraction": f"{value:.3g}"}


def _implicit_step(case: StructureCase) -> Callable[[float], tuple[str, Settings]]:
    """An implicit step, relative to that of the case."""
    from reflowshock.workflow.structure.forecast import forecast_layers, forecast_steps

    length = forecast_steps(case, forecast_layers(case))["implicit"]

    def setting(value: float) -> tuple[str, Settings]:
        step = from_si(value * length, "us", digits=3)
        return step, {"dynamics.numerics.implicit_step": step}

    return setting


def _schemes(case: StructureCase, own: Settings) -> list[StudyRun]:
    """Other ways to couple two models; each against the exact motion, and against one model on the same mesh."""
    if case.dynamics.coupling is None:
        return []
    mesh, key = _refine(case, SCHEMES_AT), "dynamics.coupling"
    usual = "local_steps" if _is_linear(case) else "held_velocity"
    chosen = case.dynamics.coupling.scheme
    ways: dict[str, Settings] = {"own scheme": {}} | {
        name.replace("_", " "): {f"{key}.scheme": name}
        for name in SCHEMES
        if name != (usual if chosen == "auto" else chosen) and (_is_linear(case) or name != "local_steps")
    }
    if _is_linear(case) and "own scheme" in ways and chosen in ("auto", "local_steps"):
        ways["one level"] = {f"{key}.scheme": "local_steps", f"{key}.levels": "1"}
    one_model = f"elements x {SCHEMES_AT:.3g}, one model"
    runs = []
    for name, settings in ways.items():
        every = own | mesh | settings
        if settings:
            runs.append(StudyRun(f"{name} x {SCHEMES_AT:.3g}", "scheme", every))
        runs.append(StudyRun(f"{name} alone", "scheme, same mesh", every, None, one_model))
    return runs + _placements(own | mesh)


def _placements(base: Settings) -> list[StudyRun]:
    """Both models on both ranks, or one on each."""
    if available_cores() < 2:
        return []
    ranks = base | {"dynamics.ranks": "2"}
    return [
        StudyRun(f"2 ranks, {name}", "placement", ranks | {"dynamics.coupling.placement": name})
        for name in ("shared", "disjoint")
    ]


def _shapes(case: StructureCase, own: Settings) -> list[StudyRun]:
    """Tetrahedra in place of hexahedra, where no layers are tied."""
    body = case.structure
    tied = case.dynamics.coupling is not None or any(layer.in_plane for layer in body.layers.values())
    if tied or body.element != "hexahedron":
        return []
    return [
        StudyRun(
            f"{name} x {factor:g}", "shape of elements", own | _refine(case, factor) | {"structure.element": element}
        )
        for element, name in SHAPES.items()
        for factor in (0.5, 1.0)
    ]
