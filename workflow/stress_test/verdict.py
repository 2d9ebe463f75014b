"""Trying a hard case and judging it: what was measured against each bound, or why there is no measure."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass

from reflowshock.workflow.case.units import UnitError
from reflowshock.workflow.stress_test.bound import Bound
from reflowshock.workflow.stress_test.hard_case import HardCase
from reflowshock.workflow.stress_test.trial import Measured, Refused


@dataclass(frozen=True, slots=True)
class Check:
    """A measure against its bound: both in words, and the factor by which it keeps it (1: at the bound)."""

    measure: str
    found: str
    bound: str
    margin: float

    @property
    def holds(self) -> bool:
        """Whether the bound is kept; nan keeps none."""
        return self.margin >= 1.0

    @property
    def rank(self) -> float:
        """The margin, but -1 where it is no number: the worst of all."""
        return -1.0 if math.isnan(self.margin) else self.margin

    def __str__(self) -> str:
        return f"{self.measure.replace('_', ' ')} {self.found} {self.bound}"


@dataclass(frozen=True, slots=True)
class Verdict:
    """How a case ended.

    Attributes:
        case: what was tried.
        checks: one a bound; none where it was refused or broke.
        message: an error, in words; "" where all was measured.
        is_refused: whether the message is a refusal that the case expects or may have.
        seconds: wall time of the trial [s].
    """

    case: HardCase
    checks: tuple[Check, ...]
    message: str = ""
    is_refused: bool = False
    seconds: float = 0.0

    @property
    def ok(self) -> bool:
        """Whether the case survived within all its bounds, or was refused as it must be."""
        return self.is_refused or (not self.message and all(check.holds for check in self.checks))

    @property
    def closest(self) -> Check | None:
        """The check that was kept by the smallest factor, or missed by the largest."""
        return min(self.checks, key=lambda check: check.rank, default=None)


def attempt(case: HardCase) -> Verdict:
    """Try a case in this process; any error of it becomes part of the verdict."""
    start, is_refused = time.perf_counter(), False
    try:
        found = case.trial.run(case.parameters)
        checks, message = tuple(_check(bound, found) for bound in case.bounds), ""
    except Exception as error:  # whatever breaks a solver is what is looked for
        checks, message = (), f"{type(error).__name__}: {error}"
        is_refused = case.may_be_refused and isinstance(error, Refused)
    seconds = time.perf_counter() - start
    if case.expect:
        is_refused = case.expect in message
        message = message or f'was not refused; expected: "{case.expect}"'
    return Verdict(case, checks, message, is_refused, seconds)


def _check(bound: Bound, found: Mapping[str, Measured]) -> Check:
    measured = found.get(bound.measure)
    if measured is None:
        known = ", ".join(found)
        raise UnitError(f"bounds.{bound.measure}: nothing of that name was measured; measured: {known}")
    margin = float(bound.margin(measured))
    return Check(bound.measure, bound.shown(measured), f"{bound.sign} {bound.text}", margin)
