"""Failure criterion: judges a drop by a value against a limit, or says why it does not apply."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from reflowshock.fem.output.ranking import Arrays
from reflowshock.fem.problem.failure import Failure
from reflowshock.workflow.case.text import SHOWN
from reflowshock.workflow.package.case import BoardDropCase

PASS, FAIL, NO_LIMIT = "PASS", "FAIL", "NO LIMIT"


@dataclass(frozen=True, slots=True)
class JudgedDrop:
    """Results of a drop that criteria judge.

    Attributes:
        case: Case of the drop.
        metrics: Metrics of the shock, name -> {"value", "unit"}.
        history: Arrays of ``history.npz``.
        coarse: Joints with the coarse mesh, whose values are approximate.
        reference: Metrics of the reference design; None without one.
    """

    case: BoardDropCase
    metrics: Mapping[str, Mapping[str, Any]]
    history: Arrays
    coarse: Collection[str] = field(default=())
    reference: Mapping[str, Mapping[str, Any]] | None = None

    @property
    def failure(self) -> Failure:
        """Failure criteria of the case."""
        return self.case.shock.failure

    def value(self, metric: str) -> float | None:
        """Return a metric in its SI unit; None if the drop does not have it."""
        return self.metrics[metric]["value"] if metric in self.metrics else None


@dataclass(frozen=True, slots=True)
class Judgement:
    """Value of a criterion against its limit, in SI units.

    Attributes:
        name: Name of the criterion.
        source: Source of the limit; empty if the criterion does not apply.
        value: Value; None if it is unknown or, for a life, unlimited.
        limit: Limit; None if the criterion does not apply.
        unit: SI unit of value and limit.
        why: Formula with its numbers, or why the criterion does not apply.
        joint: Joint with the value; empty for the whole package.
        is_least: Whether the limit is the least allowed value instead of the largest one.
    """

    name: str
    source: str = ""
    value: float | None = None
    limit: float | None = None
    unit: str = ""
    why: str = ""
    joint: str = ""
    is_least: bool = False

    @property
    def applies(self) -> bool:
        """Whether the criterion applies to the drop."""
        return self.limit is not None

    @property
    def margin(self) -> float | None:
        """Limit over value, or value over a least allowed value; None without a limit or a positive value."""
        if self.limit is None or self.value is None or self.value <= 0.0:
            return None
        return self.value / self.limit if self.is_least else self.limit / self.value

    @property
    def verdict(self) -> str:
        """``PASS``, ``FAIL``, or ``NO LIMIT`` if the criterion does not apply."""
        if not self.applies:
            return NO_LIMIT
        return FAIL if self.margin is not None and self.margin < 1.0 else PASS

    @property
    def rank(self) -> float:
        """Margin as a number to sort by; infinite without one."""
        return float("inf") if self.margin is None else self.margin

    @property
    def record(self) -> dict[str, Any]:
        """Record in ``summary.json``."""
        names = ("name", "value", "limit", "unit", "margin", "source", "applies", "why", "verdict")
        joint = {"joint": self.joint} if self.joint else {}
        return {name: getattr(self, name) for name in names} | joint


class Criterion(ABC):
    """Failure criterion with its formula, source and range of validity.

    Attributes:
        name: Name in ``summary.json``.
        words: Name in reports.
        formula: Condition to survive.
        valid: Range of validity.
        label: Short source, printed behind the margin; empty where the user gives the source.
    """

    name: str
    words: str
    formula: str
    valid: str
    label: str = ""

    @abstractmethod
    def judge(self, drop: JudgedDrop) -> Judgement:
        """Judge a drop."""


def worst(judgements: Iterable[Judgement]) -> Judgement | None:
    """Return the judgement with the smallest margin, the ratio of limit and value; None if no criterion applies.

    Args:
        judgements: Value and limit of each criterion; those that do not apply are skipped.
    """
    applying = [judgement for judgement in judgements if judgement.applies]
    return min(applying, key=lambda judgement: judgement.rank, default=None)


def value_text(value: float, unit: str) -> tuple[str, str]:
    """Return a value as text with three digits in a usual unit, and this unit; strains in microstrain.

    Args:
        value: Value in SI units.
        unit: SI unit, "m/m" for strains; empty for ratios.
    """
    factor, display_unit = (1e6, "µm/m") if unit == "m/m" else SHOWN.get(unit, (1.0, unit))
    return f"{factor * value:.3g}", display_unit


def margin_text(margin: float) -> str:
    """Return a margin as text with two digits; it is a ratio of limit and value, and below 1 the limit is violated."""
    return f"{margin:.2g}" if margin < 99.5 else f"{margin:.0f}"


def length_text(length: float) -> str:
    """Return a length [m] with three digits in millimetres."""
    return f"{1e3 * length:.3g} mm"
