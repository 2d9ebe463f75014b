"""Checks of supports, lumped masses, watch points, strain gauges and the filter against the body they belong to."""

import math
from collections.abc import Iterable, Iterator

from reflowshock.fem.problem.filters import LowPass
from reflowshock.fem.problem.fittings import AXES, Fittings, PointMass, StrainGauge, Support
from reflowshock.fem.problem.structure import Structure, StructureProblem
from reflowshock.problem import Problem, unknown_name

SAMPLES = 10  # in a period of the filter's corner


def attachment_problems(problem: StructureProblem) -> Iterator[Problem]:
    """Yield the input errors of a structure's supports, lumped masses, watch points and gauges; none if all are valid.

    Args:
        problem: Parameters of the structure; no mesh is needed.
    """
    yield from fitting_problems(problem.fittings, problem.structure)
    yield from _elastic(problem)


def fitting_problems(fittings: Fittings, body: Structure) -> Iterator[Problem]:
    """Yield the input errors of supports, lumped masses, watch points and gauges on a body; none if all are valid.

    Args:
        fittings: Fittings of the input, by name.
        body: Box with its facet sets and holes on which they must lie.
    """
    for name, support in fittings.supports.items():
        yield from unknown_name(f"supports.{name}.on", support.on, body.facet_sets, "facet set")
        yield from _support(f"supports.{name}", support)
    for name, mass in fittings.masses.items():
        yield from _mass(f"masses.{name}", mass, body)
    for name, point in fittings.watch.items():
        yield from position_problems(f"watch.{name}.at", point.at, body)
        yield from _direction(f"watch.{name}.direction", point.direction)
    for name, gauge in fittings.gauges.items():
        yield from _gauge(f"gauges.{name}", gauge, body)
        if name in fittings.watch:
            yield Problem(f"gauges.{name}", "has the name of a watch point, whose strain is a metric, too", name)


def filter_problems(table: str, low_pass: LowPass, duration: float, samples: int) -> Iterator[Problem]:
    """Yield an input error for a filter without its corner, or for a corner too high for the history samples.

    Args:
        table: Table of the case file that has the filter, for the key of the error.
        low_pass: Filter of accelerations and strains.
        duration: Simulated time [s].
        samples: Number of history samples.
    """
    if low_pass.kind == "butterworth" and low_pass.corner is None:
        yield Problem(f"{table}.filter.corner", "is missing: the -3 dB of a Butterworth filter", None, "> 0 Hz")
    elif low_pass.kind == "cfc" and low_pass.corner is not None:
        message = "applies to a Butterworth filter; a CFC filter has a channel_class"
        yield Problem(f"{table}.filter.corner", message, f"{low_pass.corner:g} Hz", "kind = butterworth")
    else:
        needed = math.ceil(SAMPLES * low_pass.frequency * duration * (1.0 - 1e-9))
        if samples < needed:
            message = f"are too few for the filter, {low_pass.label}: it needs {SAMPLES} per period of its corner"
            yield Problem(f"{table}.numerics.history_samples", message, samples, f">= {needed}")


def _support(key: str, support: Support) -> Iterator[Problem]:
    sprung = [axis for axis, stiffness in zip(AXES, support.stiffness, strict=True) if stiffness]
    if not support.hold and not sprung:
        yield Problem(f"{key}.hold", "fixes no component", "[]", "any of x, y, z, or a bedding")
    for axis in sprung:
        if axis in support.hold:
            message = f"is held by {key}.hold, so that its springs never move"
            yield Problem(f"{key}.bedding.{axis}", message, axis, f"0, or hold without {axis}")


def _direction(key: str, direction: tuple[float, ...] | None) -> Iterator[Problem]:
    if direction is not None and not math.hypot(*direction) > 0.0:
        yield Problem(key, "has no length", list(direction), "any vector but zero")


def _gauge(key: str, gauge: StrainGauge, body: Structure) -> Iterator[Problem]:
    """Yield a gauge whose centre or ends, or their mirror images, lie off the face."""
    low, high = body.corners
    height = high[2] if gauge.face == "upper" else low[2]
    misplaced = [
        *_direction(f"{key}.direction", gauge.direction),
        *position_problems(f"{key}.at", (*gauge.at, height), body),
    ]
    yield from misplaced
    if misplaced:
        return
    reach = 0.5 * gauge.length / math.hypot(*gauge.direction)
    for side in (reach, -reach):
        end = [x + side * along for x, along in zip(gauge.at, gauge.direction, strict=True)]
        x, y = (abs(value) if axis in body.symmetry else value for axis, value in zip(AXES, end, strict=False))
        yield from position_problems(f"{key}.length", (x, y, height), body)
        yield from hole_problems(f"{key}.length", (x, y, height), body)


def _elastic(problem: StructureProblem) -> Iterator[Problem]:
    """Yield the loads and couplings that elastic supports and lumped masses exclude."""
    key = next((f"supports.{name}.bedding" for name, support in problem.supports.items() if support.bedding), None)
    for name, load in problem.loads.items():
        if key and load.is_large_mass:
            message = f"moves only supports that hold x, y and z, not those of {key}"
            yield Problem(f"loads.{name}.method", message, "large_mass", "direct")
    attached = key or next((f"masses.{name}" for name in problem.masses), None)
    if attached and problem.dynamics.coupling is not None:
        yield Problem(
            attached, "requires a single model, but dynamics.coupling makes two", None, "no dynamics.coupling"
        )


def _mass(key: str, mass: PointMass, structure: Structure) -> Iterator[Problem]:
    whole = structure.model_copy(update={"symmetry": ()})
    if mass.footprint is None:
        yield from position_problems(f"{key}.at", mass.at, structure)
        yield from hole_problems(f"{key}.at", mass.at, structure)
        return
    half = [0.5 * side for side in mass.footprint]
    outside = list(position_problems(f"{key}.at", mass.at, structure))
    yield from outside
    for signs in ((-1, -1), (1, 1)):
        corner = (mass.at[0] + signs[0] * half[0], mass.at[1] + signs[1] * half[1], mass.at[2])
        if not outside:
            yield from position_problems(f"{key}.footprint", corner, whole)
    for axis in structure.symmetry:
        k = AXES.index(axis)
        if axis not in structure.planes_at(mass.at) and mass.at[k] < half[k]:
            message = f"crosses the plane of symmetry {axis} = 0, where it would overlap its mirror image"
            yield Problem(f"{key}.footprint", message, _metres(mass.footprint), f"at {axis} = 0, or on one side of it")


def position_problems(key: str, point: tuple[float, float, float], structure: Structure) -> Iterator[Problem]:
    """Yield an input error if a point lies outside the meshed box.

    Args:
        key: Key of the point in the case file.
        point: Coordinates [m].
        structure: Structure with its box.
    """
    low, high = structure.corners
    nearest = [min(max(x, a), b) for x, a, b in zip(point, low, high, strict=True)]
    distance = math.dist(point, nearest)
    if distance > structure.margin:
        message = f"lies {distance:.3g} m outside the meshed body; its nearest point is {_metres(nearest)}"
        yield Problem(key, message, _metres(point), f"{_metres(low)} to {_metres(high)}")


def hole_problems(key: str, point: tuple[float, float, float], structure: Structure) -> Iterator[Problem]:
    """Yield an input error if a point lies inside a mounting hole, farther from its rim than ``structure.margin``.

    Args:
        key: Key of the point in the case file.
        point: Coordinates [m].
        structure: Structure with its holes.
    """
    holes = structure.holes
    if holes is None:
        return
    radius = min(math.dist(point[:2], axis) for axis in holes.places)
    if radius < 0.5 * holes.diameter - structure.margin:
        allowed = f">= {0.5 * holes.diameter:.6g} m from the axis of the hole"
        yield Problem(key, f"lies in a mounting hole, {radius:.3g} m from its axis", _metres(point), allowed)


def _metres(point: Iterable[float]) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in point) + ") m"
