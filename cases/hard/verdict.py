"""Trying a hard case and judging it: what was measured against each bound, or why there is no measure."""

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

    @property
    def margin_text(self) -> str:
        """The margin in words."""
        return f"> {LARGEST_SHOWN:g}" if self.margin > LARGEST_SHOWN else f"{self.margin:.3g}"

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

    def __str__(self) -> str:
        """Say how it ended: the closest of its checks, or why there is none; where it missed, all that it missed."""
        if self.message:
            return ("refused: " if self.is_refused else "") + self.message
        shown: list[Check | None] = [check for check in self.checks if not check.holds] or [self.closest]
        return "; ".join(f"{check}, margin {check.margin_text}" for check in shown if check is not None)

    def record(self) -> dict[str, Any]:
        """Return all but the case, to be sent from one process to another."""
        checks = [asdict(check) for check in self.checks]
        return {"checks": checks, "message": self.message, "is_refused": self.is_refused, "seconds": self.seconds}

    @classmethod
    def of(cls, case: HardCase, record: dict[str, Any]) -> "Verdict":
        """Return the verdict on a case from its record."""
        return cls(case, **record | {"checks": tuple(Check(**check) for check in record["checks"])})


def attempt(case: HardCase) -> Verdict:
    """Try a case in this process; any error of it becomes part of the verdict."""
    start, is_refused = time.perf_counter(), False
    try:
        found = case.trial.measure(case.parameters)
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
