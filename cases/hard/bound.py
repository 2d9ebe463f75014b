"""A bound on a measure: a text such as "0.1 %" or "> 0.2 mm", and by what factor a value keeps it."""

import math
import re
from dataclasses import dataclass

from reflowshock.cases.hard.trial import Measured
from reflowshock.units import UnitError, dimension, in_unit, quantity_in_si, to_si

TEXT = re.compile(r"\s*(?P<sign><=|>=|<|>|)\s*(?P<quantity>.*?)\s*")
PURE = re.compile(r"(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?P<percent>%?)")


@dataclass(frozen=True, slots=True)
class Bound:
    """A limit that a measure stays below, or above.

    Attributes:
        measure: its name.
        text: the quantity as it was given, e.g. "0.1 %".
        unit: of the text: "%", "" or any other.
        limit: in SI base units, positive.
        is_lower: whether the measure must stay above; an upper bound is one of the absolute value.
    """

    measure: str
    text: str
    unit: str
    limit: float
    is_lower: bool

    @property
    def sign(self) -> str:
        """How it reads."""
        return ">=" if self.is_lower else "<="

    def margin(self, found: Measured) -> float:
        """Return by what factor a value keeps the bound: 1 at the bound, less beyond it, nan for nan.

        Raises:
            UnitError: the value has another dimension than the bound.
        """
        if kind(found.unit) != kind(self.unit):
            raise UnitError(f"{self.measure} is in {found.unit or 'pure numbers'}, its bound is {self.text}")
        value = si_value(found)
        if not math.isfinite(value):
            return math.nan
        if self.is_lower:
            return max(0.0, value) / self.limit
        return self.limit / abs(value) if value else math.inf

    def shown(self, found: Measured) -> str:
        """Write a value in the unit of the bound."""
        value = si_value(found)
        if self.unit == "%":
            return f"{100.0 * value:.3g} %"
        return f"{in_unit(value, self.unit):.3g} {self.unit}".rstrip() if self.unit else f"{value:.3g}"


def read_bound(measure: str, given: object, unit: str | None) -> Bound:
    """Read one bound.

    Args:
        measure: what it bounds.
        given: a number, or a text: a sign or none (for <=) and a quantity.
        unit: of the measure; None where it is not known yet.

    Raises:
        UnitError: no number, another dimension, not positive, or infinite.
    """
    match = TEXT.fullmatch(str(given))
    text, sign = (match["quantity"], match["sign"]) if match else ("", "")
    own, limit = _quantity(text, unit)
    if not limit > 0.0:
        raise UnitError("must be positive")
    if math.isinf(limit):
        raise UnitError("must be finite")
    return Bound(measure, text, own, limit, sign.startswith(">"))


def si_value(found: Measured) -> float:
    """Return a measured value in SI base units."""
    if found.unit in ("", "%"):
        return found.value / (100.0 if found.unit else 1.0)
    return quantity_in_si(found.value, found.unit)


def kind(unit: str) -> str:
    """Name the dimension of a unit, "%" and "" included."""
    return dimension("" if unit == "%" else unit)


def _quantity(text: str, unit: str | None) -> tuple[str, float]:
    """Return unit and SI value of a quantity, which must be of the dimension of a unit if one is given."""
    pure = PURE.fullmatch(text)
    if pure:
        if unit is not None and kind(unit) != kind(""):
            raise UnitError(f'needs a unit, such as "{pure["number"]} {unit}"')
        return pure["percent"], float(pure["number"]) / (100.0 if pure["percent"] else 1.0)
    if unit in ("", "%"):
        raise UnitError('is not a pure number, such as "1e-3" or "0.1 %"')
    own = text.partition(" ")[2].strip()
    return own, to_si(text, unit or own)
