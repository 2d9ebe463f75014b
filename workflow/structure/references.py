"""References for the motion of a structure: exact solutions, bounds, published values and records."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from reflowshock.fem.problem.load_kinds import AnyLoad
from reflowshock.fem.problem.structure import StructureProblem
from reflowshock.parameters import Parameters
from reflowshock.problem import Problem, unknown_name
from reflowshock.quantity import Quantity

# Metrics of the stage comparison that are relative errors against an exact solution.
ERRORS_OF_EXACT = (
    "wave_speed_error",
    "transmitted_velocity_error",
    "reflected_velocity_error",
    "wave_error",
    "tip_deflection_error",
    "swing_frequency_error",
)


class Reference(Parameters):
    """Base of all references: immutable, unknown keys are errors."""

    is_exact: ClassVar[bool] = False  # whether it is the exact solution of the motion

    def problems(self, key: str, problem: StructureProblem) -> Iterator[Problem]:
        """Yield contradictions to the rest of the case.

        Args:
            key: Dotted key of the reference's table in the case file.
            problem: Structure with its layers, watch points, loads and solver.
        """
        yield from ()

    @property
    def record(self) -> "Record | None":
        """The reference itself if it is a recorded acceleration, otherwise None."""
        return None

    @property
    def published(self) -> "Published | None":
        """The reference itself if it is a published value, otherwise None."""
        return None


class BarWave(Reference):
    """Waves along z in two laterally constrained layers after a half-sine pressure on ``z_min``: speed and amplitudes.

    ``incident`` names two watch points in the lower layer, the one nearer to the load first; ``transmitted`` names one
    in the upper layer.
    """

    is_exact: ClassVar[bool] = True

    kind: Literal["bar_wave"] = "bar_wave"
    load: str
    incident: tuple[str, str]
    transmitted: str
    speed_limit: float = Field(0.005, gt=0)
    amplitude_limit: float = Field(0.01, gt=0)

    def problems(self, key: str, problem: StructureProblem) -> Iterator[Problem]:
        """Check the load, the number of layers and the heights of the watch points."""
        yield from _pressure(f"{key}.load", self.load, problem, "half_sine")
        yield from _layers(key, 2, problem)
        yield from _heights(key, self, problem)


class LayeredBar(Reference):
    """Waves along z in any number of laterally constrained layers after a pressure pulse on ``z_min``, by ray tracing.

    ``incident`` names two watch points in the lowest layer, the one nearer to the load first; ``transmitted`` names
    one in the top layer.
    """

    is_exact: ClassVar[bool] = True

    kind: Literal["layered_bar"] = "layered_bar"
    load: str
    incident: tuple[str, str]
    transmitted: str
    speed_limit: float = Field(0.005, gt=0)
    amplitude_limit: float = Field(0.005, gt=0)

    def problems(self, key: str, problem: StructureProblem) -> Iterator[Problem]:
        """Check the load and the heights of the watch points."""
        yield from _pulse(f"{key}.load", self.load, problem)
        yield from _heights(key, self, problem)


class Cantilever(Reference):
    """Beam theory of a single-layer strip in plane strain, clamped at ``x_min``, under a sudden constant pressure."""

    is_exact: ClassVar[bool] = True

    kind: Literal["cantilever"] = "cantilever"
    load: str
    tip: str
    limit: float = Field(0.02, gt=0)

    def problems(self, key: str, problem: StructureProblem) -> Iterator[Problem]:
        """Check the load, the watch point and the number of layers."""
        yield from _pressure(f"{key}.load", self.load, problem, "constant")
        yield from _existing(f"{key}.tip", self.tip, problem.watch, "watch point")
        yield from _layers(key, 1, problem)


class FrequencyRange(Reference):
    """Bounds of a natural frequency; ``mode`` 1 is the lowest."""

    kind: Literal["frequency"] = "frequency"
    mode: int = Field(1, ge=1)
    at_least: Annotated[float, Quantity("Hz")] = Field(gt=0)
    at_most: Annotated[float, Quantity("Hz")] = Field(gt=0)

    def problems(self, key: str, problem: StructureProblem) -> Iterator[Problem]:
        """Check that the mode is computed."""
        if self.mode > problem.dynamics.modes:
            allowed = f"<= {problem.dynamics.modes}, or more dynamics.modes"
            yield Problem(f"{key}.mode", "the mode is not computed", self.mode, allowed)


class Published(Reference):
    """Published value, shown next to a metric in the report."""

    kind: Literal["published"] = "published"
    metric: str
    value: str
    source: str

    @property
    def published(self) -> "Published":
        """The reference itself."""
        return self


class Record(Reference):
    """Recorded acceleration at a watch point (CSV file in the format of load tables), with the filter of the run."""

    kind: Literal["record"] = "record"
    watch: str
    table: str
    table_column: str | None = None

    def problems(self, key: str, problem: StructureProblem) -> Iterator[Problem]:
        """Check that the watch point exists."""
        yield from _existing(f"{key}.watch", self.watch, problem.watch, "watch point")

    @property
    def record(self) -> "Record":
        """The reference itself."""
        return self


AnyReference = Annotated[
    BarWave | LayeredBar | Cantilever | FrequencyRange | Published | Record, Field(discriminator="kind")
]


def reference_problems(references: dict[str, AnyReference], problem: StructureProblem) -> Iterator[Problem]:
    """Yield the problems of all references with loads, watch points, modes and layers of the case.

    Args:
        references: References by name.
        problem: Structure with its layers, loads and watch points.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    for name, reference in references.items():
        yield from reference.problems(f"references.{name}", problem)


def _heights(key: str, reference: BarWave | LayeredBar, problem: StructureProblem) -> Iterator[Problem]:
    points = [*(("incident", name) for name in reference.incident), ("transmitted", reference.transmitted)]
    for item, name in points:
        yield from _existing(f"{key}.{item}", name, problem.watch, "watch point")
    thickness = [layer.thickness for layer in problem.structure.layers.values()]
    if len(thickness) < 2 or any(name not in problem.watch for _, name in points):
        return
    lower, upper = thickness[0], sum(thickness[:-1])
    heights = [problem.watch[name].at[2] for _, name in points]
    if not 0.0 <= heights[0] < heights[1] < lower <= upper < heights[2]:
        allowed = f"two heights below {1e3 * lower:g} mm, upwards, then one above {1e3 * upper:g} mm"
        yield Problem(key, "watch points lie outside their layers", None, allowed)


def _pressure(key: str, name: str, problem: StructureProblem, pulse: str) -> Iterator[Problem]:
    yield from _existing(key, name, problem.loads, "load")
    load = problem.loads.get(name)
    if load is not None and not (_is_pressure(load) and load.peak is not None and load.pulse == pulse):
        yield Problem(key, f"is not a {pulse} pressure given by its peak", name, f'a pressure with pulse = "{pulse}"')


def _pulse(key: str, name: str, problem: StructureProblem) -> Iterator[Problem]:
    yield from _existing(key, name, problem.loads, "load")
    load = problem.loads.get(name)
    if load is not None and not (_is_pressure(load, "z_min") and _ends(load)):
        yield Problem(
            key, "is not a pulse of pressure on z_min", name, "a pressure on z_min with a duration or a table"
        )


def _is_pressure(load: AnyLoad, on: str | None = None) -> bool:
    """Return whether a load is a pressure on a facet set, or on any facet set if ``on`` is None."""
    return load.quantity == "pressure" and on in (None, load.facet_set)


def _ends(load: AnyLoad) -> bool:
    """Return whether a load has an end: a duration, or a table."""
    return load.table is not None or load.duration is not None


def _existing(key: str, name: str, names: dict, noun: str) -> Iterator[Problem]:
    """Yield the problem of an unknown watch point or load, called ``noun``."""
    return unknown_name(key, name, names, noun)


def _layers(key: str, count: int, problem: StructureProblem) -> Iterator[Problem]:
    layers = len(problem.structure.layers)
    if layers != count:
        yield Problem(
            f"{key}.kind", f"the exact solution does not cover {layers} layers", None, f"{count} in structure.layers"
        )
