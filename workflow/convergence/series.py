"""Ladders: the settings of a case whose errors and costs are measured. Each kind of case has its own."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reflowshock.workflow.case.case import Case

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
class Rung:
    """A point of a ladder.

    Attributes:
        name: what it is called in tables, as short as can be and unlike all others: "21 per edge".
        knob: what varies: the name of a knob, or for a rung of its own what is chosen, "time step".
        settings: dotted key -> value as for ``--set``, over the case as the user has it.
        value: of the knob; errors follow a power of it. None for a choice that has no size.
        against: name of the rung that it is compared with, in place of an exact answer or the finest rung: that on the
            same mesh, say, where the error of a scheme is meant and not that of the mesh.
    """

    name: str
    knob: str
    settings: Mapping[str, str]
    value: float | None = None
    against: str = ""


@dataclass(frozen=True, slots=True)
class Knob:
    """Something whose size the error follows: a spacing, a size of elements, a time step.

    Attributes:
        name: what it is called.
        values: those that are measured, the coarsest first: relative sizes, so that half the value is twice as fine.
        at: the rung of a value, or of the nearest finer one that can be had; its ``value`` is the one that it has.
        order: of the error in the value, by theory; None without theory.
        extent: factor beyond the measured values within which errors and costs may be foreseen.
    """

    name: str
    values: tuple[float, ...]
    at: Callable[[float], Rung]
    order: float | None = None
    extent: float = 1.5

    @property
    def rungs(self) -> tuple[Rung, ...]:
        """What is measured of it."""
        return tuple(self.at(value) for value in self.values)

    def apart(self, finest: float) -> tuple["Knob", Rung]:
        """Return it by itself, and its finest rung: the others are compared with that, so no other error is in theirs.

        Args:
            finest: value finer than all of its values.
        """
        reference = replace(self.at(finest), value=None)

        def at(value: float) -> Rung:
            return replace(self.at(value), against=reference.name)

        return replace(self, at=at), reference


@dataclass(frozen=True, slots=True)
class Ladder:
    """What is measured of a case.

    Attributes:
        until: the last stage that is computed.
        timed: stages whose time is the cost of a rung.
        errors: quantity -> what its error is called in tables, with what it is relative to. The first one is judged by
            the tolerance, and by it costs and orders are told.
        measure: what the products of a run, in its run folder, say of each of these quantities; a quantity may be
            missing where it has no meaning.
        knobs: the first one has the rungs that others are compared with where nothing is exact.
        choices: rungs that are no value of a knob; one may fail.
    """

    until: str
    timed: tuple[str, ...]
    errors: Mapping[str, str]
    measure: Callable[[Case, Path], Mapping[str, Quantity]]
    knobs: tuple[Knob, ...]
    choices: tuple[Rung, ...] = field(default=())

    @property
    def rungs(self) -> tuple[Rung, ...]:
        """All that is measured, each once."""
        every = [rung for knob in self.knobs for rung in knob.rungs] + list(self.choices)
        return tuple({rung.name: rung for rung in reversed(every)}.values())[::-1]

    @property
    def judged(self) -> str:
        """Name of the quantity that the tolerance is meant for."""
        return next(iter(self.errors))
