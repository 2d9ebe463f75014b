"""Bounds on measures: parse texts such as "0.1 %" or "> 0.2 mm" and compute the margin of a value."""

import math
import re
from dataclasses import dataclass

from reflowshock.cases.hard.trial import Measured
from reflowshock.units import UnitError, dimension, in_unit, quantity_in_si, to_si

TEXT = re.compile(r"\s*(?P<sign><=|>=|<|>|)\s*(?P<quantity>.*?)\s*")
PURE = re.compile(r"(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?P<percent>%?)")


@dataclass(frozen=True, slots=True)
class Bound:
    """An upper bound on the absolute value of a measure, or a lower bound on its value.

    Attributes:
        measure: Name of the measure.
        text: Quantity as the file has it, such as "0.1 %".
        unit: Unit of the text; "%" or "" for pure numbers.
        limit: Positive limit in SI base units.
        is_lower: Whether the bound is a lower one.
    """

    measure: str
    text: str
    unit: str
    limit: float
    is_lower: bool

    @property
    def sign(self) -> str:
        """Comparison sign of the bound as text."""
        return ">=" if self.is_lower else "<="

    def margin(self, measured: Measured) -> float:
        """Return the safety factor of a value against the bound: 1 at the bound, less beyond it, nan for nan.

        Raises:
            UnitError: If value and bound have different dimensions.
        """
        if kind(measured.unit) != kind(self.unit):
            raise UnitError(f"{self.measure} is in {measured.unit or 'pure numbers'}, its bound is {self.text}")
        value = si_value(measured)
        if not math.isfinite(value):
            return math.nan
        if self.is_lower:
            return max(0.0, value) / self.limit
        return self.limit / abs(value) if value else math.inf

    def shown(self, measured: Measured) -> str:
        """Write a value in the unit of the bound."""
        value = si_value(measured)
        if self.unit == "%":
            return f"{100.0 * value:.3g} %"
        return f"{in_unit(value, self.unit):.3g} {self.unit}".rstrip() if self.unit else f"{value:.3g}"


def read_bound(measure: str, value: object, unit: str | None) -> Bound:
    """Parse one bound.

    Args:
        measure: Name of the measure.
        value: Number, or text with an optional sign (default ``<=``) and a quantity.
        unit: Unit of the measure; None if it is unknown before the trial has run.

    Raises:
        UnitError: If the value is not a positive finite number or has the wrong dimension.
    """
    match = TEXT.fullmatch(str(value))
    text, sign = (match["quantity"], match["sign"]) if match else ("", "")
    bound_unit, limit = _quantity(text, unit)
    if not limit > 0.0:
        raise UnitError("must be positive")
    if math.isinf(limit):
        raise UnitError("must be finite")
    return Bound(measure, text, bound_unit, limit, sign.startswith(">"))


def si_value(measured: Measured) -> float:
    """Return a measured value in SI base units."""
    if measured.unit in ("", "%"):
        return measured.value / (100.0 if measured.unit else 1.0)
    return quantity_in_si(measured.value, measured.unit)


def kind(unit: str) -> str:
    """Return the dimension of a unit; "%" and "" are dimensionless."""
    return dimension("" if unit == "%" else unit)


def _quantity(text: str, unit: str | None) -> tuple[str, float]:
    """Return unit and SI value of a quantity; check its dimension if ``unit`` is not None."""
    pure = PURE.fullmatch(text)
    if pure:
        if unit is not None and kind(unit) != kind(""):
            raise UnitError(f'needs a unit, such as "{pure["number"]} {unit}"')
        return pure["percent"], float(pure["number"]) / (100.0 if pure["percent"] else 1.0)
    if unit in ("", "%"):
        raise UnitError('is not a pure number, such as "1e-3" or "0.1 %"')
    text_unit = text.partition(" ")[2].strip()
    return text_unit, to_si(text, unit or text_unit)
