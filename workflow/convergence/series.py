"""Convergence studies: the settings of a case whose errors and costs are measured. Each kind of case has its own."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reflowshock.workflow.case.case import Case

Arrays = Mapping[str, NDArray]


Values = float | NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Quantity:
    """An answer of a run.

    Attributes:
        value: a number or samples, at the same places in all runs.
        exact: the exact answer at these places; None where it is not known. Of an error that the run has found
            itself, zero.
        scale: what a difference is divided by; None: the norm of the answer that it is compared with.
        source: what the exact answer is, for readers: "spherical cap".
    """

    value: Values
    exact: Values | None = None
    scale: float | None = None
    source: str = ""


@dataclass(frozen=True, slots=True)
class StudyRun:
    """One run of a convergence study.

    Attributes:
        name: what it is called in tables, as short as can be and unlike all others: "21 per edge".
        parameter: what varies: the name of a parameter, or for a run of its own what is chosen, "time step".
        settings: dotted key -> value as for ``--set``, over the case as the user has it.
        value: of the parameter; errors follow a power of it. None for a choice that has no size.
        against: name of the run that it is compared with, in place of an exact answer or the finest run: that on the
            same mesh, say, where the error of a scheme is meant and not that of the mesh.
    """

    name: str
    parameter: str
    settings: Mapping[str, str]
    value: float | None = None
    against: str = ""

    def under(self, settings: Mapping[str, str]) -> "StudyRun":
        """Return it under settings that hold for all runs, unless it has its own."""
        return replace(self, settings={**settings, **self.settings})


@dataclass(frozen=True, slots=True)
class Parameter:
    """Something whose size the error follows: a spacing, a size of elements, a time step.

    Attributes:
        name: what it is called.
        values: those that are measured, the coarsest first: relative sizes, so that half the value is twice as fine.
        at: the run of a value, or of the nearest finer one that can be had; its ``value`` is the one that it has.
        order: of the error in the value, by theory; None without theory.
        extent: factor beyond the measured values within which errors and costs may be predicted.
    """

    name: str
    values: tuple[float, ...]
    at: Callable[[float], StudyRun]
    order: float | None = None
    extent: float = 1.5

    @property
    def runs(self) -> tuple[StudyRun, ...]:
        """What is measured of it."""
        return tuple(self.at(value) for value in self.values)

    def under(self, settings: Mapping[str, str]) -> "Parameter":
        """Return it with all its runs under settings."""
        return replace(self, at=lambda value: self.at(value).under(settings))

    def apart(self, finest: float) -> tuple["Parameter", StudyRun]:
        """Return it by itself, and its finest run: the others are compared with that, so no other error is in theirs.

        Args:
            finest: value finer than all of its values.
        """
        reference = replace(self.at(finest), value=None)

        def at(value: float) -> StudyRun:
            return replace(self.at(value), against=reference.name)

        return replace(self, at=at), reference


@dataclass(frozen=True, slots=True)
class ConvergenceStudy:
    """What is measured of a case.

    Attributes:
        until: the last stage that is computed.
        timed: stages whose time is the cost of a run.
        errors: quantity -> what its error is called in tables, with what it is relative to. The first one is judged by
            the tolerance, and by it costs and orders are shown.
        measure: what the products of a run, in its run folder, say of each of these quantities; a quantity may be
            missing where it has no meaning.
        parameters: the first one has the runs that others are compared with where nothing is exact.
        choices: runs that are no value of a parameter; one may fail.
    """

    until: str
    timed: tuple[str, ...]
    errors: Mapping[str, str]
    measure: Callable[[Case, Path], Mapping[str, Quantity]]
    parameters: tuple[Parameter, ...]
    choices: tuple[StudyRun, ...] = field(default=())

    @property
    def runs(self) -> tuple[StudyRun, ...]:
        """All that is measured, each once."""
        every = [run for parameter in self.parameters for run in parameter.runs] + list(self.choices)
        return tuple({run.name: run for run in reversed(every)}.values())[::-1]

    @property
    def judged(self) -> str:
        """Name of the quantity that the tolerance is meant for."""
        return next(iter(self.errors))


def at_same_times(history: Arrays, names: Iterable[str], duration: float, count: int) -> NDArray[np.float64]:
    """Interpolate arrays of a history at evenly spaced times.

    Args:
        history: of a run; ``time`` (s,) [s].
        names: of arrays (s, ...).
        duration: of the motion [s]; runs end there but for a rounding of their steps.
        count: of the times.

    Returns:
        All values, one array after the other, each in the order of times.
    """
    from scipy.interpolate import CubicSpline

    times = common_times(duration, count)
    return np.concatenate([CubicSpline(history["time"], history[name])(times).ravel() for name in names])


def common_times(duration: float, count: int) -> NDArray[np.float64]:
    """Return evenly spaced times (count,) [s] from zero to the end of the motion."""
    return np.linspace(0.0, duration, count)
