"""Convergence studies of solder alone: particle spacing and time step, against exact shapes and periods."""

from collections.abc import Callable, Mapping
from functools import partial
from math import ceil
from types import MappingProxyType
from typing import Any

from reflowshock.particles.parameters.effects import decide_drop
from reflowshock.units import from_si
from reflowshock.workflow.convergence.convergence_study import ConvergenceStudy, Parameter, StudyRun
from reflowshock.workflow.convergence.metrics import read_metric_errors
from reflowshock.workflow.solder.case import DropCase, DropsCase, JointCase, OscillationCase, SolderCase

Settings = Mapping[str, str]

SECOND = 2.0  # order in the spacing of a surface that minimises a discrete area
PER_EDGE = (6, 7, 9, 11, 13, 15, 17, 21, 27, 41)
PER_EDGE_OF_QUARTER = (9, 11, 15, 21, 27)
FINENESS = (0.55, 0.7, 0.85, 1.0, 1.2, 1.45, 1.75, 2.1)  # relative to the spacing of the case
PER_RADIUS = (2, 3, 4, 5, 6, 7)
STEPS_PER_PERIOD = (16, 24, 36, 54, 81, 120)
STEPS_PER_PARTICLE = 16  # steps per period and particle along the radius: the error of the spacing dominates
LARGEST_COUNT, SMALLEST_COUNT = 50, 5
TIME_STEPS = (20.0, 5.0)  # capillary limits
FIXED_PER_EDGE = 11  # particles per edge of runs that vary another setting
MOVING = {  # parameters printed by Hu et al., so viscous that a drop with inertia comes to rest soon
    "solder.effects.inertia": "on",
    "solder.parameters": "paper",
    "solder.process_time": "0.1 s",
    "solder.numerics.max_steps": "20000",
}
SCHEMES = {
    "relaxation": {
        "solder.numerics.scheme": "energy",
        "solder.effects.inertia": "off",
        "solder.effects.viscosity": "off",
    },
    "tetrahedra": {"solder.numerics.scheme": "energy", "solder.effects.inertia": "on"},
    "ISPG": {"solder.numerics.scheme": "ispg", "solder.effects.inertia": "on"},
}
SCHEME_EDGES = (5, 7, 9)  # particles per edge
SECTION_EDGES = (8, 11, 15, 21)
GRIPC = MOVING | {
    "solder.numerics.scheme": "gripc",
    "solder.numerics.time_step_limit": "0.5",
    "solder.process_time": "5 ms",
}

SHAPE = {"shape_error": "free surface, RMS distance over V^(1/3)", "max_width_error": "largest width"}
ROUNDING = 1e-9


def _study(
    exact: str, errors: Mapping[str, str], parameters: tuple[Parameter, ...], choices: tuple[StudyRun, ...] = ()
) -> ConvergenceStudy:
    """Return the study of a reflow against an exact solution."""
    measure = partial(read_metric_errors, exact, errors, "reflow")
    return ConvergenceStudy("reflow", ("reflow",), errors, measure, parameters, choices)


def drop_study(case: DropCase) -> ConvergenceStudy:
    """Return the study of a drop: particles per edge of the initial cube, symmetry, schemes and time steps.

    A drop with inertia costs more: its schemes have a few coarse runs with the settings of the case.

    Returns:
        Varied parameters, further runs, and the function that measures their errors.
    """
    drop, errors = case.drop, {"shape_error": SHAPE["shape_error"], "height_error": "height", **SHAPE}
    exact = "sphere" if drop.is_free else "Young-Laplace"
    if decide_drop(case.molten, drop.is_free)["inertia"]["on"]:
        if drop.section != "none":
            return _study(exact, errors, (_spacing_of_drop(case, SECTION_EDGES, settings=_scheme(case)),))
        scheme = "ISPG" if case.molten.numerics.scheme == "ispg" else "tetrahedra"
        spacing = _spacing_of_drop(case, SCHEME_EDGES, settings=_scheme(case))
        return _study(exact, errors, (spacing, *_other_schemes(case, scheme, {})))
    parameters, choices = [_spacing_of_drop(case, PER_EDGE)], _steps_of_drop(case)
    if drop.symmetry == "none" and not drop.is_free:
        parameters.append(_spacing_of_drop(case, PER_EDGE_OF_QUARTER, "quarter", {"drop.symmetry": "quarter"}))
    if not drop.is_free:
        parameters += _other_schemes(case, "relaxation", MOVING)
        choices += _printed_scheme(case)
    return _study(exact, errors, tuple(parameters), tuple(choices))


def _scheme(case: SolderCase) -> Settings:
    """Return the scheme of the case as a setting, so that a finer run does not choose another one."""
    return {"solder.numerics.scheme": case.molten.numerics.scheme}


def _steps_of_drop(case: DropCase) -> list[StudyRun]:
    base, limit_of_case = _per_edge(case, FIXED_PER_EDGE), case.molten.numerics.time_step_limit
    return [
        StudyRun(f"steps {limit:g} x", "time step", base | {"solder.numerics.time_step_limit": f"{limit:g}"})
        for limit in TIME_STEPS
        if limit != limit_of_case
    ]


def _printed_scheme(case: DropCase) -> list[StudyRun]:
    base = _per_edge(case, PER_EDGE[1]) | GRIPC
    return [
        StudyRun(f"gripc, {basis}", "scheme", base | {"solder.numerics.basis": basis})
        for basis in ("linear", "quadratic")
    ]


def _other_schemes(case: DropCase, scheme: str, base: Settings) -> list[Parameter]:
    """Return the spacing under each other scheme; an unsupported scheme is rejected when the case of a run is read."""
    return [
        _spacing_of_drop(case, SCHEME_EDGES, name, {**base, **settings})
        for name, settings in SCHEMES.items()
        if name != scheme
    ]


def _spacing_of_drop(
    case: DropCase, counts: tuple[int, ...], variant: str = "", settings: Settings = MappingProxyType({})
) -> Parameter:
    """Return the spacing over the edge of the cube, for the case or a variant of it.

    Particles lie in the symmetry planes of a quarter if their number along an edge is odd.
    """
    name, suffix = (f"particle spacing, {variant}", f", {variant}") if variant else ("particle spacing", "")
    multiple = 2 if variant == "quarter" else 1

    def run_at(value: float) -> StudyRun:
        count = _count(value, multiple)
        run_settings = {**_per_edge(case, count), **settings}
        return StudyRun(f"{count} per edge{suffix}", name, run_settings, 1.0 / (count - 1))

    return Parameter(name, tuple(1.0 / (count - 1) for count in counts), run_at, SECOND)


def _count(value: float, multiple: int) -> int:
    """Return the particles along an edge for a relative spacing or a finer one; the intervals are a ``multiple``."""
    spacings = multiple * ceil(1.0 / value / multiple - ROUNDING)
    return 1 + min((LARGEST_COUNT - 1) // multiple * multiple, max(SMALLEST_COUNT - 1, spacings))


def _per_edge(case: DropCase, count: int) -> dict[str, str]:
    """Return the settings for ``count`` particles along an edge, with the key that the case uses."""
    if case.drop.spacing is not None:
        return {"drop.spacing": from_si(case.drop.edge / (count - 1), "mm")}
    return {"drop.particles_per_edge": f"{count}"}


def joint_study(case: JointCase) -> ConvergenceStudy:
    """Return the study of a joint: particle spacings around the one of the case.

    Returns:
        Varied parameters, further runs, and the function that measures their errors.
    """
    lifted = case.joint.package is not None and "lift" in case.joint.package.free
    errors = SHAPE | ({"collapse_height_error": "standoff"} if lifted else {"axial_force_error": "axial force"})
    parameter = _spacing("joint.spacing", case.joint.spacing, _scheme(case))
    return _study("Young-Laplace", errors, (parameter,))


def drops_study(case: DropsCase) -> ConvergenceStudy:
    """Return the study of two drops: particle spacings around the one of the case.

    Returns:
        Varied parameters, further runs, and the function that measures their errors.
    """
    errors = {"max_width_error": "largest width", "height_error": "height"}
    exact = "sphere" if case.drops.is_free else "Young-Laplace"
    parameter = _spacing("drops.spacing", case.drops.spacing, _scheme(case), FINENESS[1:])
    return _study(exact, errors, (parameter,))


def _spacing(key: str, case_spacing: float, settings: Settings, fineness: tuple[float, ...] = FINENESS) -> Parameter:
    """Return spacings around the one of the case [m]; values are relative to it."""

    def run_at(value: float) -> StudyRun:
        text = from_si(value * case_spacing, "mm", digits=3)
        return StudyRun(f"spacing {text}", "particle spacing", {key: text, **settings}, value)

    return Parameter("particle spacing", tuple(1.0 / factor for factor in fineness), run_at, SECOND)


def oscillation_study(_case: OscillationCase) -> ConvergenceStudy:
    """Return the study of an oscillating drop: particles along the radius with proportional steps, and the time step.

    The reference is exact for small amplitudes. Larger ones have a longer period: errors converge to that difference.

    Returns:
        Varied parameters, further runs, and the function that measures their errors.
    """
    errors = {"period_error": "period", "decay_rate_error": "decay rate"}

    def spacing(value: float) -> StudyRun:
        count = min(20, max(2, ceil(1.0 / value - ROUNDING)))
        steps = STEPS_PER_PARTICLE * count
        settings = {"oscillation.particles_per_radius": f"{count}", "oscillation.steps_per_period": f"{steps}"}
        return StudyRun(f"{count} per radius", "spacing and step", settings, 1.0 / count)

    def step(value: float) -> StudyRun:
        count = max(STEPS_PER_PERIOD[0], ceil(1.0 / value - ROUNDING))
        settings = {"oscillation.particles_per_radius": "3", "oscillation.steps_per_period": f"{count}"}
        return StudyRun(f"{count} steps a period", "time step", settings, 1.0 / count)

    parameters = (
        Parameter("spacing and step", tuple(1.0 / count for count in PER_RADIUS), spacing),
        Parameter("time step", tuple(1.0 / count for count in STEPS_PER_PERIOD), step),
    )
    return _study("Reid, small amplitude", errors, parameters)


STUDIES: dict[str, Callable[[Any], ConvergenceStudy]] = {
    DropCase.kind: drop_study,
    JointCase.kind: joint_study,
    DropsCase.kind: drops_study,
    OscillationCase.kind: oscillation_study,
}
