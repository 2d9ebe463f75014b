"""What a structure's motion is compared with: exact solutions, bounds, published values; each a table of the case."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from reflowshock.fem.problem.load_kinds import Pressure
from reflowshock.fem.problem.structure import StructureProblem
from reflowshock.names import nearest
from reflowshock.parameters import Parameters
from reflowshock.problem import Problem
from reflowshock.quantity import Quantity


class Reference(Parameters):
    """Base of all references: immutable, unknown keys are errors."""


class BarWave(Reference):
    """Waves along z in two layers whose sides are held, after a half-sine pressure on ``z_min``: speed and amplitudes.

    ``incident`` are two watch points in the lower layer, the one nearer to the load first; ``transmitted`` is one in
    the upper layer.
    """

    kind: Literal["bar_wave"] = "bar_wave"
    load: str
    incident: tuple[str, str]
    transmitted: str
    speed_limit: float = Field(0.005, gt=0)
    amplitude_limit: float = Field(0.01, gt=0)


class LayeredBar(Reference):
    """Waves along z in any layers whose sides are held, after a pulse of pressure on ``z_min``: every ray through them.

    ``incident`` are two watch points in the lowest layer, the one nearer to the load first; ``transmitted`` is one in
    the uppermost layer.
    """

    kind: Literal["layered_bar"] = "layered_bar"
    load: str
    incident: tuple[str, str]
    transmitted: str
    speed_limit: float = Field(0.005, gt=0)
    amplitude_limit: float = Field(0.005, gt=0)


class Cantilever(Reference):
    """A strip of one layer, clamped at ``x_min``, its sides held, under a sudden constant pressure: beam theory."""

    kind: Literal["cantilever"] = "cantilever"
    load: str
    tip: str
    limit: float = Field(0.02, gt=0)


class FrequencyRange(Reference):
    """Bounds of a natural frequency; ``mode`` 1 is the lowest."""

    kind: Literal["frequency"] = "frequency"
    mode: int = Field(1, ge=1)
    at_least: Annotated[float, Quantity("Hz")] = Field(gt=0)
    at_most: Annotated[float, Quantity("Hz")] = Field(gt=0)


class Published(Reference):
    """A published value, shown beside a metric."""

    kind: Literal["published"] = "published"
    metric: str
    value: str
    source: str


class Record(Reference):
    """A recorded acceleration at a watch point, a CSV file as those of loads, through the filter of the run."""

    kind: Literal["record"] = "record"
    watch: str
    table: str
    table_column: str | None = None


AnyReference = Annotated[
    BarWave | LayeredBar | Cantilever | FrequencyRange | Published | Record, Field(discriminator="kind")
]


def reference_problems(references: dict[str, AnyReference], problem: StructureProblem) -> Iterator[Problem]:
    """Find references to loads, points or modes that are not there, or to what has no exact solution."""
    for name, reference in references.items():
        key = f"references.{name}"
        if isinstance(reference, BarWave):
            yield from _pressure(f"{key}.load", reference.load, problem, "half_sine")
            yield from _layers(key, 2, problem)
            yield from _heights(key, reference, problem)
        elif isinstance(reference, LayeredBar):
            yield from _pulse(f"{key}.load", reference.load, problem)
            yield from _heights(key, reference, problem)
        elif isinstance(reference, Cantilever):
            yield from _pressure(f"{key}.load", reference.load, problem, "constant")
            yield from _known(f"{key}.tip", reference.tip, problem.watch, "watch point")
            yield from _layers(key, 1, problem)
        elif isinstance(reference, Record):
            yield from _known(f"{key}.watch", reference.watch, problem.watch, "watch point")
        elif isinstance(reference, FrequencyRange) and reference.mode > problem.dynamics.modes:
            allowed = f"<= {problem.dynamics.modes}, or more dynamics.modes"
            yield Problem(f"{key}.mode", "is not computed", reference.mode, allowed)


def _heights(key: str, reference: BarWave | LayeredBar, problem: StructureProblem) -> Iterator[Problem]:
    points = [*(("incident", name) for name in reference.incident), ("transmitted", reference.transmitted)]
    for item, name in points:
        yield from _known(f"{key}.{item}", name, problem.watch, "watch point")
    thickness = [layer.thickness for layer in problem.structure.layers.values()]
    if len(thickness) < 2 or any(name not in problem.watch for _, name in points):
        return
    lower, upper = thickness[0], sum(thickness[:-1])
    heights = [problem.watch[name].at[2] for _, name in points]
    if not 0.0 <= heights[0] < heights[1] < lower <= upper < heights[2]:
        allowed = f"two heights below {1e3 * lower:g} mm, upwards, then one above {1e3 * upper:g} mm"
        yield Problem(key, "has watch points outside their layers", None, allowed)


def _pressure(key: str, name: str, problem: StructureProblem, pulse: str) -> Iterator[Problem]:
    yield from _known(key, name, problem.loads, "load")
    load = problem.loads.get(name)
    if load is not None and not (isinstance(load, Pressure) and load.peak is not None and load.pulse == pulse):
        yield Problem(key, f"is not a {pulse} pressure given by its peak", name, f'a pressure with pulse = "{pulse}"')


def _pulse(key: str, name: str, problem: StructureProblem) -> Iterator[Problem]:
    yield from _known(key, name, problem.loads, "load")
    load = problem.loads.get(name)
    if load is not None and not (isinstance(load, Pressure) and load.on == "z_min" and _ends(load)):
        yield Problem(
            key, "is not a pulse of pressure on z_min", name, "a pressure on z_min with a duration or a table"
        )


def _ends(load: Pressure) -> bool:
    return load.table is not None or load.duration is not None


def _known(key: str, name: str, names: dict, what: str) -> Iterator[Problem]:
    if name not in names:
        yield Problem(key, f"no such {what}", name, "one of " + ", ".join(names), nearest(name, names))


def _layers(key: str, count: int, problem: StructureProblem) -> Iterator[Problem]:
    found = len(problem.structure.layers)
    if found != count:
        yield Problem(f"{key}.kind", f"has no exact solution for {found} layers", None, f"{count} in structure.layers")
