"""Convergence studies of solder alone: particles and time steps, against exact shapes and periods."""

from collections.abc import Callable, Mapping
from functools import partial
from math import ceil
from types import MappingProxyType
from typing import Any

from reflowshock.particles.parameters.effects import decide_drop
from reflowshock.units import from_si
from reflowshock.workflow.convergence.metrics import read_metric_errors
from reflowshock.workflow.convergence.series import ConvergenceStudy, Parameter, StudyRun
from reflowshock.workflow.solder.case import DropCase, DropsCase, JointCase, OscillationCase, SolderCase

Settings = Mapping[str, str]

SECOND = 2.0  # order in the spacing of a surface that minimises a discrete area
PER_EDGE = (6, 7, 9, 11, 13, 15, 17, 21, 27, 41)
OF_A_QUARTER = (9, 11, 15, 21, 27)
FINENESS = (0.55, 0.7, 0.85, 1.0, 1.2, 1.45, 1.75, 2.1)  # of a spacing that the case gives
PER_RADIUS = (2, 3, 4, 5, 6, 7)
STEPS_PER_PERIOD = (16, 24, 36, 54, 81, 120)
STEPS_TO_A_PARTICLE = 16  # of a period, that the spacing alone is seen to err
LARGEST_COUNT, SMALLEST_COUNT = 50, 5
TIME_STEPS = (20.0, 5.0)  # capillary limits
WHERE = 11  # particles per edge of runs that vary something else
MOVING = {  # what Hu et al. print: so viscous that a drop with inertia comes to rest soon
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
    """Return the study of a reflow whose errors are those from an exact answer."""
    measure = partial(read_metric_errors, exact, errors, "reflow")
    return ConvergenceStudy("reflow", ("reflow",), errors, measure, parameters, choices)


def drop_study(case: DropCase) -> ConvergenceStudy:
    """Particles along the edge of the cube that a drop starts as; half of them left out by symmetry; schemes; steps.

    A drop with inertia costs more: its schemes have a few coarse runs, with the values of the case.
    """
    drop, errors = case.drop, {"shape_error": SHAPE["shape_error"], "height_error": "height", **SHAPE}
    exact = "sphere" if drop.is_free else "Young-Laplace"
    if decide_drop(case.molten, drop.is_free)["inertia"]["on"]:
        if drop.section != "none":
            return _study(exact, errors, (_spacing_of_drop(case, SECTION_EDGES, settings=_scheme(case)),))
        own = "ISPG" if case.molten.numerics.scheme == "ispg" else "tetrahedra"
        spacing = _spacing_of_drop(case, SCHEME_EDGES, settings=_scheme(case))
        return _study(exact, errors, (spacing, *_other_schemes(case, own, {})))
    parameters, choices = [_spacing_of_drop(case, PER_EDGE)], _steps_of_drop(case)
    if drop.symmetry == "none" and not drop.is_free:
        parameters.append(_spacing_of_drop(case, OF_A_QUARTER, "quarter", {"drop.symmetry": "quarter"}))
    if not drop.is_free:
        parameters += _other_schemes(case, "relaxation", MOVING)
        choices += _printed_scheme(case)
    return _study(exact, errors, tuple(parameters), tuple(choices))


def _scheme(case: SolderCase) -> Settings:
    """The scheme that the case has, for all runs of a series: with others a finer one might have another."""
    return {"solder.numerics.scheme": case.molten.numerics.scheme}


def _steps_of_drop(case: DropCase) -> list[StudyRun]:
    base, own = _per_edge(case, WHERE), case.molten.numerics.time_step_limit
    return [
        StudyRun(f"steps {limit:g} x", "time step", base | {"solder.numerics.time_step_limit": f"{limit:g}"})
        for limit in TIME_STEPS
        if limit != own
    ]


def _printed_scheme(case: DropCase) -> list[StudyRun]:
    base = _per_edge(case, PER_EDGE[1]) | GRIPC
    return [
        StudyRun(f"gripc, {basis}", "scheme", base | {"solder.numerics.basis": basis})
        for basis in ("linear", "quadratic")
    ]


def _other_schemes(case: DropCase, own: str, base: Settings) -> list[Parameter]:
    """The spacing under each other scheme. What one is not for is refused with the reason when a run's case is read."""
    return [
        _spacing_of_drop(case, SCHEME_EDGES, name, {**base, **settings})
        for name, settings in SCHEMES.items()
        if name != own
    ]


def _spacing_of_drop(
    case: DropCase, counts: tuple[int, ...], variant: str = "", settings: Settings = MappingProxyType({})
) -> Parameter:
    """The spacing over the edge of the cube, of the case or of a variant of it.

    Particles lie in the planes of a quarter if there is an odd number along an edge.
    """
    name, suffix = (f"particle spacing, {variant}", f", {variant}") if variant else ("particle spacing", "")
    multiple = 2 if variant == "quarter" else 1

    def at(value: float) -> StudyRun:
        count = _count(value, multiple)
        every = {**_per_edge(case, count), **settings}
        return StudyRun(f"{count} per edge{suffix}", name, every, 1.0 / (count - 1))

    return Parameter(name, tuple(1.0 / (count - 1) for count in counts), at, SECOND)


def _count(value: float, multiple: int) -> int:
    """Particles along an edge for a spacing over the edge, or a smaller one; spacings in an edge are a multiple."""
    spacings = multiple * ceil(1.0 / value / multiple - ROUNDING)
    return 1 + min((LARGEST_COUNT - 1) // multiple * multiple, max(SMALLEST_COUNT - 1, spacings))


def _per_edge(case: DropCase, count: int) -> dict[str, str]:
    """Settings for so many particles along an edge, by the key that the case has."""
    if case.drop.spacing is not None:
        return {"drop.spacing": from_si(case.drop.edge / (count - 1), "mm")}
    return {"drop.particles_per_edge": f"{count}"}


def joint_study(case: JointCase) -> ConvergenceStudy:
    """Particle spacing of a joint, about the one that the case has."""
    lifted = case.joint.package is not None and "lift" in case.joint.package.free
    own = {"collapse_height_error": "standoff"} if lifted else {"axial_force_error": "axial force"}
    errors = SHAPE | own
    parameter = _spacing("joint.spacing", case.joint.spacing, _scheme(case))
    return _study("Young-Laplace", errors, (parameter,))


def drops_study(case: DropsCase) -> ConvergenceStudy:
    """Particle spacing of two drops, about the one that the case has."""
    errors = {"max_width_error": "largest width", "height_error": "height"}
    exact = "sphere" if case.drops.is_free else "Young-Laplace"
    parameter = _spacing("drops.spacing", case.drops.spacing, _scheme(case), FINENESS[1:])
    return _study(exact, errors, (parameter,))


def _spacing(key: str, own: float, settings: Settings, fineness: tuple[float, ...] = FINENESS) -> Parameter:
    """A spacing that the case gives [m], and others about it; values are relative to it."""

    def at(value: float) -> StudyRun:
        text = from_si(value * own, "mm", digits=3)
        return StudyRun(f"spacing {text}", "particle spacing", {key: text, **settings}, value)

    return Parameter("particle spacing", tuple(1.0 / one for one in fineness), at, SECOND)


def oscillation_study(_case: OscillationCase) -> ConvergenceStudy:
    """Particles along the radius, with steps in proportion; and the time step by itself.

    What is exact for small swings is not for larger ones, whose period is longer: errors fall to that difference only.
    """
    errors = {"period_error": "period", "decay_rate_error": "decay rate"}

    def spacing(value: float) -> StudyRun:
        count = min(20, max(2, ceil(1.0 / value - ROUNDING)))
        steps = STEPS_TO_A_PARTICLE * count
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
    return _study("Reid, small swings", errors, parameters)


STUDIES: dict[str, Callable[[Any], ConvergenceStudy]] = {
    DropCase.kind: drop_study,
    JointCase.kind: joint_study,
    DropsCase.kind: drops_study,
    OscillationCase.kind: oscillation_study,
}
