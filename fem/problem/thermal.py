"""Parameters of the reflow temperatures: temperature profile, support of the package, effects.

All values are SI floats; ``Quantity`` names the unit that case files and messages use.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from reflowshock.effect import Switch
from reflowshock.materials.parameters import Material, Temperature
from reflowshock.parameters import Parameters
from reflowshock.problem import Problem
from reflowshock.quantity import Quantity

KELVIN = 273.15


class ThermalEffects(Parameters):
    """Effects between solder and structure.

    ``flexible``: board and package bend (off: rigid plates). ``solder_force``: the force of the solder bends them (off:
    one-way coupling). ``auto`` decides from the predicted change of the gaps. ``residual_stress``: the shock begins
    with the stress that cooling from solidification leaves in the joints.
    """

    flexible: Switch = "auto"
    solder_force: Switch = "auto"
    residual_stress: Literal["off", "on"] = "off"


class Thermal(Parameters):
    """Temperature profile of the reflow; without it nothing is heated and the plates are rigid.

    At ``reference`` all parts are flat and free of stress. They are heated to ``peak`` in ``steps`` load steps; the
    solder is liquid above ``melting`` (H 4.3: from the start, ``melting = reference``). On cooling its shape freezes at
    ``solidification``, and all parts cool to ``final``. The package floats on the solder, or the corner of the die is
    moved upwards by ``corner_displacement`` in proportion to the temperature. ``tolerance`` limits the residual force
    between solder and structure, relative to the force of the solder. Sn-Ag-Cu melts at 217 degC; peaks are 235 to
    250 degC (J-STD-020).
    """

    reference: Temperature = Field(25.0 + KELVIN, gt=0)
    peak: Temperature = Field(245.0 + KELVIN, gt=0)
    melting: Temperature = Field(217.0 + KELVIN, gt=0, validate_default=True)
    solidification: Temperature = Field(217.0 + KELVIN, gt=0, validate_default=True)
    final: Temperature = Field(25.0 + KELVIN, gt=0, validate_default=True)
    steps: int = Field(7, ge=1, le=200)
    package: Literal["floating", "moved"] = "floating"
    corner_displacement: Annotated[float | None, Quantity("mm")] = Field(None, validate_default=True)
    tolerance: float = Field(1e-3, gt=0, le=0.1)
    effects: ThermalEffects = ThermalEffects()

    @field_validator("peak")
    @classmethod
    def _is_heated(cls, value: float, info: ValidationInfo) -> float:
        return _check_range(value, info, "reference", None)

    @field_validator("melting")
    @classmethod
    def _melts_on_heating(cls, value: float, info: ValidationInfo) -> float:
        return _check_range(value, info, "reference", "peak")

    @field_validator("solidification")
    @classmethod
    def _solidifies_on_cooling(cls, value: float, info: ValidationInfo) -> float:
        return _check_range(value, info, None, "peak")

    @field_validator("final")
    @classmethod
    def _is_solid_in_the_end(cls, value: float, info: ValidationInfo) -> float:
        return _check_range(value, info, None, "solidification")

    @field_validator("corner_displacement")
    @classmethod
    def _moves_the_package(cls, value: float | None, info: ValidationInfo) -> float | None:
        package = info.data.get("package")
        if package == "floating" and value is not None:
            raise PydanticCustomError(
                "inadmissible", "cannot be combined with package = floating", {"allowed": "moved"}
            )
        if package == "moved" and value is None:
            message = "is missing: the displacement of the die's corner with package = moved"
            raise PydanticCustomError("inadmissible", message, {"allowed": 'any length, e.g. "-0.1 mm"'})
        return value

    def corner(self, temperature: float) -> float:
        """Return the displacement of the die's corner [m], linear in the temperature [K] on heating and cooling."""
        if self.corner_displacement is None:
            return 0.0
        if self.peak == self.reference:
            return self.corner_displacement
        return self.corner_displacement * (temperature - self.reference) / (self.peak - self.reference)

    @property
    def lowest_corner(self) -> float:
        """Lowest displacement of the die's corner while the solder is liquid [m]."""
        return min(map(self.corner, (self.melting, self.peak, self.solidification)))


def _check_range(value: float, info: ValidationInfo, low: str | None, high: str | None) -> float:
    """Return a temperature [K] if it lies between two other fields.

    Args:
        value: Temperature [K] to check.
        info: Fields that are already validated.
        low: Name of the field with the lower bound, or None.
        high: Name of the field with the upper bound, or None.

    Raises:
        PydanticCustomError: The temperature is out of range.
    """
    bounds = [(sign, name, info.data[name]) for sign, name in ((">=", low), ("<=", high)) if name in info.data]
    if all(value >= bound if sign == ">=" else value <= bound for sign, _, bound in bounds):
        return value
    allowed = " and ".join(f"{sign} {bound - KELVIN:.6g} degC, the {name}" for sign, name, bound in bounds)
    raise PydanticCustomError("inadmissible", "is out of range", {"allowed": allowed})


def problems(thermal: Thermal, materials: Mapping[str, Material], warpage: float) -> list[Problem]:
    """Return the contradictions of the reflow temperatures, found before anything is meshed or computed.

    Args:
        thermal: Temperature profile and effects.
        materials: Material of each role.
        warpage: Prescribed lift of the corner of the package [m].

    Returns:
        Input errors, each with key, message, value and allowed range; empty if there are none.
    """
    return [*_expansion(thermal, materials), *_warpage(thermal, warpage)]


def _expansion(thermal: Thermal, materials: Mapping[str, Material]) -> Iterator[Problem]:
    """Yield materials without thermal expansion; the expansion of liquid solder is not used."""
    for role, material in materials.items():
        if role == "solder" and thermal.effects.residual_stress == "off":
            continue
        for name in material.unknown_expansion:
            yield Problem(f"materials.{role}.{name}", "is missing, but [thermal] needs it", None, "e.g. 16 ppm/K")


def _warpage(thermal: Thermal, warpage: float) -> Iterator[Problem]:
    if warpage and thermal.effects.flexible != "off":
        message = "cannot be combined with [thermal], which computes the warpage"
        yield Problem("warpage.corner", message, warpage, "0 mm, or thermal.effects.flexible = off")
