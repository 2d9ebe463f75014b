"""Quantities of parameter models: text with a unit in a case file, SI floats in the program."""

from dataclasses import dataclass
from typing import Any

from pydantic import GetJsonSchemaHandler
from pydantic_core import CoreSchema

from reflowshock import units


@dataclass(frozen=True, slots=True)
class Quantity:
    """Annotation of a float or a tuple of floats with a dimension: ``Annotated[float, Quantity("mm")]``.

    Models store SI floats and validate their ranges. A case file may use any unit of the same dimension.

    Attributes:
        unit: Unit for displaying values, e.g. "mm".
    """

    unit: str

    @property
    def dimension(self) -> str:
        """Name of the dimension, e.g. "length"."""
        return units.dimension(self.unit)

    @property
    def described(self) -> str:
        """Description for users, such as "length, e.g. in mm"."""
        return f"{self.dimension}, e.g. in {self.unit}"

    def to_si(self, text: object) -> float:
        """Convert text of a case file, e.g. "0.48 mm", to an SI float; raise UnitError if it is not a quantity."""
        return units.to_si(text, self.unit)

    def text(self, value: float, digits: int = 10) -> str:
        """Return an SI value as text with unit."""
        return units.from_si(value, self.unit, digits)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the schema of case files: a string with a unit, or a list of them."""
        numbers = handler(schema)
        form: dict[str, Any] = {"type": "string", "pattern": units.PATTERN, "examples": [f"1 {self.unit}"]}
        if numbers.get("type") == "array":
            sizes = {str(name): numbers[name] for name in ("minItems", "maxItems") if name in numbers}
            form = {"type": "array", "items": form, **sizes}
        return {**form, "description": self.described, "x-unit": self.unit}
