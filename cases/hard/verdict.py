"""Verdicts on hard cases: each measure against its bound, or the error that ended the trial."""

import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from reflowshock.cases.hard.bound import Bound
from reflowshock.cases.hard.hard_case import HardCase
from reflowshock.cases.hard.trial import Measured, Refused
from reflowshock.units import UnitError

LARGEST_SHOWN = 1000.0  # margin


@dataclass(frozen=True, slots=True)
class Check:
    """A measure and its bound as texts, with the safety factor between them (1: at the bound)."""

    measure: str
    value: str
    bound: str
    margin: float

    @property
    def holds(self) -> bool:
        """Whether the bound is satisfied; false for nan."""
        return self.margin >= 1.0

    @property
    def rank(self) -> float:
        """Margin for sorting; -1 (the worst) if the margin is nan."""
        return -1.0 if math.isnan(self.margin) else self.margin

    @property
    def margin_text(self) -> str:
        """Margin as text."""
        return f"> {LARGEST_SHOWN:g}" if self.margin > LARGEST_SHOWN else f"{self.margin:.3g}"

    def __str__(self) -> str:
        return f"{self.measure.replace('_', ' ')} {self.value} {self.bound}"


@dataclass(frozen=True, slots=True)
class Verdict:
    """Result of one hard case.

    Attributes:
        case: The case.
        checks: One check for each bound; empty if the trial was refused or failed.
        message: Error message; empty if the trial returned its measures.
        is_refused: Whether the message is a refusal that the case expects or allows.
        seconds: Wall time of the trial [s].
    """

    case: HardCase
    checks: tuple[Check, ...]
    message: str = ""
    is_refused: bool = False
    seconds: float = 0.0

    @property
    def ok(self) -> bool:
        """Whether all bounds are satisfied, or the case was refused as expected."""
        return self.is_refused or (not self.message and all(check.holds for check in self.checks))

    @property
    def closest(self) -> Check | None:
        """The check with the smallest margin."""
        return min(self.checks, key=lambda check: check.rank, default=None)

    def __str__(self) -> str:
        """Return the closest check or the error message; all failed checks if the case missed."""
        if self.message:
            return ("refused: " if self.is_refused else "") + self.message
        reported: list[Check | None] = [check for check in self.checks if not check.holds] or [self.closest]
        return "; ".join(f"{check}, margin {check.margin_text}" for check in reported if check is not None)

    def record(self) -> dict[str, Any]:
        """Return a JSON record of everything except the case."""
        checks = [asdict(check) for check in self.checks]
        return {"checks": checks, "message": self.message, "is_refused": self.is_refused, "seconds": self.seconds}

    @classmethod
    def of(cls, case: HardCase, record: dict[str, Any]) -> "Verdict":
        """Return the verdict on a case from its record."""
        return cls(case, **record | {"checks": tuple(Check(**check) for check in record["checks"])})


def attempt(case: HardCase) -> Verdict:
    """Run a case in this process; an exception becomes part of the verdict."""
    start, is_refused = time.perf_counter(), False
    try:
        measures = case.trial.measure(case.parameters)
        checks, message = tuple(_check(bound, measures) for bound in case.bounds), ""
    except Exception as error:  # any failure of a solver is a result
        checks, message = (), f"{type(error).__name__}: {error}"
        is_refused = case.may_be_refused and isinstance(error, Refused)
    seconds = time.perf_counter() - start
    if case.expect:
        is_refused = case.expect in message
        message = message or f'was not refused; expected: "{case.expect}"'
    return Verdict(case, checks, message, is_refused, seconds)


def _check(bound: Bound, measures: Mapping[str, Measured]) -> Check:
    measured = measures.get(bound.measure)
    if measured is None:
        names = ", ".join(measures)
        raise UnitError(f"bounds.{bound.measure}: nothing of that name was measured; measured: {names}")
    margin = float(bound.margin(measured))
    return Check(bound.measure, bound.shown(measured), f"{bound.sign} {bound.text}", margin)
