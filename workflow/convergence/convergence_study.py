"""Convergence study: the settings of a case whose errors and costs are measured. Each kind of case has its own."""

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
    """A computed quantity of a run.

    Attributes:
        value: A number, or samples at the same points and times in all runs.
        exact: Exact value; None if it is unknown. Zero if the value is an error that the run computed itself.
        scale: Divisor of a difference; None for the norm of the value that it is compared with.
        source: Exact solution, for readers, such as "spherical cap".
    """

    value: Values
    exact: Values | None = None
    scale: float | None = None
    source: str = ""


@dataclass(frozen=True, slots=True)
class StudyRun:
    """One run of a convergence study.

    Attributes:
        name: Short unique name for tables, such as "21 per edge".
        parameter: Name of the parameter that varies, or of the choice that is made, such as "time step".
        settings: Dotted key -> value as for ``--set``, on top of the user's case.
        value: Value of the parameter; errors follow a power of it. None for a choice without a size.
        against: Name of the run that this run is compared with instead of an exact solution or the finest run, such as
            the run on the same mesh if the error of a scheme is measured.
    """

    name: str
    parameter: str
    settings: Mapping[str, str]
    value: float | None = None
    against: str = ""

    def with_settings(self, settings: Mapping[str, str]) -> "StudyRun":
        """Return this run with further settings; its own settings take precedence."""
        return replace(self, settings={**settings, **self.settings})


@dataclass(frozen=True, slots=True)
class Parameter:
    """A numerical parameter that controls the error: particle spacing, element size, time step.

    Attributes:
        name: Name for tables.
        values: Measured values, the coarsest first: relative sizes, so that half the value is twice as fine.
        run_at: Function of a value that returns its run or the nearest finer one, whose ``value`` is the one used.
        order: Theoretical order of the error in the value; None without theory.
        extent: Factor beyond the measured values within which errors and costs may be predicted.
    """

    name: str
    values: tuple[float, ...]
    run_at: Callable[[float], StudyRun]
    order: float | None = None
    extent: float = 1.5

    @property
    def runs(self) -> tuple[StudyRun, ...]:
        """Runs at the measured values, the coarsest first."""
        return tuple(self.run_at(value) for value in self.values)

    def with_settings(self, settings: Mapping[str, str]) -> "Parameter":
        """Return this parameter with further settings in all its runs."""
        return replace(self, run_at=lambda value: self.run_at(value).with_settings(settings))

    def with_reference(self, finest: float) -> tuple["Parameter", StudyRun]:
        """Return this parameter and a finer run as its reference, so that errors from other sources cancel.

        Args:
            finest: Value of the reference, finer than all values of the parameter.
        """
        reference = replace(self.run_at(finest), value=None)

        def run_at(value: float) -> StudyRun:
            return replace(self.run_at(value), against=reference.name)

        return replace(self, run_at=run_at), reference


@dataclass(frozen=True, slots=True)
class ConvergenceStudy:
    """The runs of a convergence study and the quantities that they are judged by.

    Attributes:
        until: Last stage to compute.
        timed: Stages whose time is the cost of a run.
        errors: Quantity -> name of its error for readers, with its scale. The first one is the judged quantity: the
            tolerance, the Pareto front and the orders refer to it.
        measure: Function of a case and its run folder that returns the quantities; a meaningless one may be missing.
        parameters: Varied parameters. Without an exact solution, the finest run of the first one is the reference.
        choices: Runs that are not a value of a parameter; one may fail.
    """

    until: str
    timed: tuple[str, ...]
    errors: Mapping[str, str]
    measure: Callable[[Case, Path], Mapping[str, Quantity]]
    parameters: tuple[Parameter, ...]
    choices: tuple[StudyRun, ...] = field(default=())

    @property
    def runs(self) -> tuple[StudyRun, ...]:
        """All runs, each once."""
        runs = [run for parameter in self.parameters for run in parameter.runs] + list(self.choices)
        return tuple({run.name: run for run in reversed(runs)}.values())[::-1]

    @property
    def judged(self) -> str:
        """Name of the quantity to which the tolerance applies."""
        return next(iter(self.errors))


def resample(history: Arrays, names: Iterable[str], duration: float, count: int) -> NDArray[np.float64]:
    """Interpolate arrays of a history at evenly spaced times by cubic splines.

    Args:
        history: Arrays of a run; ``time`` has shape (s,) [s].
        names: Arrays to interpolate, each of shape (s, ...).
        duration: Duration of the motion [s]; runs end there up to rounding.
        count: Number of times.

    Returns:
        All values in one dimension, one array after the other, each in the order of the times.
    """
    from scipy.interpolate import CubicSpline

    times = sample_times(duration, count)
    return np.concatenate([CubicSpline(history["time"], history[name])(times).ravel() for name in names])


def sample_times(duration: float, count: int) -> NDArray[np.float64]:
    """Return evenly spaced times from zero to the end of the motion, shape (count,) [s]."""
    return np.linspace(0.0, duration, count)
