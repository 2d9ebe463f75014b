"""Parameters of materials: isotropic and orthotropic elasticity, thermal expansion, Johnson-Cook plasticity.

All values are SI floats; ``Quantity`` names the unit that case files and messages use.
"""

import math
from typing import Annotated, ClassVar, Literal, NamedTuple, Self

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

Pressure = Annotated[float, Quantity("GPa")]
Stress = Annotated[float, Quantity("MPa")]
Density = Annotated[float, Quantity("kg/m^3")]
Temperature = Annotated[float, Quantity("degC")]
Expansion = Annotated[float | None, Quantity("ppm/K")]


class Expanding(Parameters):
    """Base of materials: thermal expansion, which is optional at constant temperature, and elastic by default."""

    EXPANSION: ClassVar[tuple[str, str, str]]

    @property
    def unknown_expansion(self) -> tuple[str, ...]:
        """Names of the missing coefficients of thermal expansion."""
        return tuple(name for name in dict.fromkeys(self.EXPANSION) if getattr(self, name) is None)

    @property
    def yield_constants(self) -> tuple[float, ...] | None:
        """Constants of ``plasticity.plastic_constants``; None for an elastic material."""
        return None

    @property
    def expansion(self) -> tuple[float, float, float]:
        """Coefficients of linear thermal expansion along x, y, z [1/K].

        Raises:
            ValueError: A coefficient is missing.
        """
        if self.unknown_expansion:
            raise ValueError(f"{' and '.join(self.unknown_expansion)} of {self!r} must be given")
        x, y, z = (getattr(self, name) for name in self.EXPANSION)
        return x, y, z


class EngineeringConstants(NamedTuple):
    """Elastic constants of an orthotropic material along the axes x, y, z.

    Attributes:
        young: Young's moduli E_x, E_y, E_z [Pa].
        poisson: Poisson's ratios nu_xy, nu_yz, nu_xz; nu_ij is the contraction along j under tension along i.
        shear: Shear moduli G_xy, G_yz, G_xz [Pa].
    """

    young: tuple[float, float, float]
    poisson: tuple[float, float, float]
    shear: tuple[float, float, float]


def inadmissible(allowed: str) -> PydanticCustomError:
    """Return a validation error of an elastic constant for which the strain energy is not positive.

    Args:
        allowed: Allowed range of the constant in words, in the context of the error as ``allowed``.
    """
    message = "contradicts the values above it: the strain energy would not be positive"
    return PydanticCustomError("inadmissible", message, {"allowed": allowed})


class JohnsonCook(Parameters):
    """Yield stress (A + B p^n) (1 + C ln max(1, rate / reference_rate)) (1 - T*^m) of Johnson and Cook.

    p is the equivalent plastic strain and T* = (temperature - room_temperature) / (melting_temperature -
    room_temperature), at least 0 (Johnson & Cook, Proc. 7th Int. Symp. Ballistics, 1983).
    """

    A: Stress = Field(gt=0)
    B: Stress = Field(0.0, ge=0)
    n: float = Field(1.0, gt=0, le=1)
    C: float = Field(0.0, ge=0)
    reference_rate: Annotated[float, Quantity("s^-1")] = Field(1.0, gt=0)
    room_temperature: Temperature = Field(298.15, gt=0)
    melting_temperature: Temperature = Field(490.15, gt=0)
    m: float = Field(1.0, gt=0)

    @field_validator("melting_temperature")
    @classmethod
    def _melts_above_room_temperature(cls, value: float, info: ValidationInfo) -> float:
        room = info.data.get("room_temperature", 0.0)
        if value > room:
            return value
        allowed = f"> {room - 273.15:.6g} degC, the room_temperature"
        raise PydanticCustomError("inadmissible", "is out of range", {"allowed": allowed})

    def softening(self, temperature: float) -> float:
        """Return the factor 1 - T*^m on the yield stress at a temperature [K]."""
        relative = (temperature - self.room_temperature) / (self.melting_temperature - self.room_temperature)
        return 1.0 - max(0.0, relative) ** self.m


class Isotropic(Expanding):
    """Isotropic linear elastic material, plastic if ``plasticity`` is given.

    ``temperature`` is the temperature during the shock, which lowers the yield stress.
    """

    EXPANSION: ClassVar[tuple[str, str, str]] = ("thermal_expansion",) * 3
    kind: Literal["isotropic"] = "isotropic"
    density: Density = Field(gt=0)
    young_modulus: Pressure = Field(gt=0)
    poisson_ratio: float = Field(gt=-1, lt=0.5)
    thermal_expansion: Expansion = None
    plasticity: JohnsonCook | None = None
    temperature: Temperature = Field(298.15, gt=0, validate_default=True)

    @field_validator("temperature")
    @classmethod
    def _is_solid(cls, value: float, info: ValidationInfo) -> float:
        plasticity = info.data.get("plasticity")
        if plasticity is None or value < plasticity.melting_temperature:
            return value
        allowed = f"< {plasticity.melting_temperature - 273.15:.6g} degC, the melting_temperature"
        raise PydanticCustomError("inadmissible", "is out of range", {"allowed": allowed})

    @property
    def engineering_constants(self) -> EngineeringConstants:
        """Elastic constants along the axes."""
        young, ratio = self.young_modulus, self.poisson_ratio
        return EngineeringConstants((young,) * 3, (ratio,) * 3, (self.shear_modulus,) * 3)

    @property
    def shear_modulus(self) -> float:
        """Shear modulus G = E / (2 (1 + nu)) [Pa]."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def softening(self) -> float:
        """Factor on the yield stress at the temperature of the material."""
        return 1.0 if self.plasticity is None else self.plasticity.softening(self.temperature)

    @property
    def yield_constants(self) -> tuple[float, ...] | None:
        """Constants of ``plasticity.plastic_constants``: 3 G, softened A and B [Pa], n, C, reference rate [1/s]."""
        law, softening = self.plasticity, self.softening
        if law is None:
            return None
        return 3.0 * self.shear_modulus, law.A * softening, law.B * softening, law.n, law.C, law.reference_rate

    @property
    def elastic(self) -> Self:
        """Same material without plasticity."""
        return self.model_copy(update={"plasticity": None})


class Orthotropic(Expanding):
    """Orthotropic linear elastic laminate with equal constants in x and y (z is the thickness direction).

    ``poisson_ratio_out_of_plane`` is nu_xz: contraction in z under tension in x.
    """

    plasticity: ClassVar[None] = None
    EXPANSION: ClassVar[tuple[str, str, str]] = (
        "thermal_expansion_in_plane",
        "thermal_expansion_in_plane",
        "thermal_expansion_out_of_plane",
    )
    kind: Literal["orthotropic"] = "orthotropic"
    density: Density = Field(gt=0)
    young_modulus_in_plane: Pressure = Field(gt=0)
    young_modulus_out_of_plane: Pressure = Field(gt=0)
    poisson_ratio_in_plane: float = Field(gt=-1, lt=1)
    poisson_ratio_out_of_plane: float
    shear_modulus_in_plane: Pressure = Field(gt=0)
    shear_modulus_out_of_plane: Pressure = Field(gt=0)
    thermal_expansion_in_plane: Expansion = None
    thermal_expansion_out_of_plane: Expansion = None

    @field_validator("poisson_ratio_out_of_plane")
    @classmethod
    def _stores_energy(cls, value: float, info: ValidationInfo) -> float:
        names = ("young_modulus_in_plane", "young_modulus_out_of_plane", "poisson_ratio_in_plane")
        if not all(name in info.data for name in names):
            return value  # the missing or invalid values are reported themselves
        in_plane, out_of_plane, ratio = (info.data[name] for name in names)
        bound = math.sqrt(0.5 * (1.0 - ratio) * in_plane / out_of_plane)
        if abs(value) < bound:
            return value
        raise inadmissible(f"> {-bound:.6g} and < {bound:.6g}")

    @property
    def engineering_constants(self) -> EngineeringConstants:
        """Elastic constants along the axes."""
        in_plane, out_of_plane = self.shear_modulus_in_plane, self.shear_modulus_out_of_plane
        return EngineeringConstants(
            (self.young_modulus_in_plane, self.young_modulus_in_plane, self.young_modulus_out_of_plane),
            (self.poisson_ratio_in_plane, self.poisson_ratio_out_of_plane, self.poisson_ratio_out_of_plane),
            (in_plane, out_of_plane, out_of_plane),
        )


class GeneralOrthotropic(Expanding):
    """Orthotropic linear elastic material with nine constants along the axes x, y, z.

    ``poisson_ratio_xy`` is the contraction in y under tension in x, the others likewise.
    """

    plasticity: ClassVar[None] = None
    EXPANSION: ClassVar[tuple[str, str, str]] = ("thermal_expansion_x", "thermal_expansion_y", "thermal_expansion_z")
    kind: Literal["general_orthotropic"] = "general_orthotropic"
    density: Density = Field(gt=0)
    young_modulus_x: Pressure = Field(gt=0)
    young_modulus_y: Pressure = Field(gt=0)
    young_modulus_z: Pressure = Field(gt=0)
    poisson_ratio_xy: float
    poisson_ratio_yz: float
    poisson_ratio_xz: float
    shear_modulus_xy: Pressure = Field(gt=0)
    shear_modulus_yz: Pressure = Field(gt=0)
    shear_modulus_xz: Pressure = Field(gt=0)
    thermal_expansion_x: Expansion = None
    thermal_expansion_y: Expansion = None
    thermal_expansion_z: Expansion = None

    @field_validator("poisson_ratio_xy", "poisson_ratio_yz", "poisson_ratio_xz")
    @classmethod
    def _stores_energy_in_pairs(cls, value: float, info: ValidationInfo) -> float:
        first, second = (info.data.get(f"young_modulus_{axis}") for axis in str(info.field_name)[-2:])
        if first and second and abs(value) >= math.sqrt(first / second):
            raise inadmissible(f"> {-math.sqrt(first / second):.6g} and < {math.sqrt(first / second):.6g}")
        return value

    @field_validator("poisson_ratio_xz")
    @classmethod
    def _stores_energy(cls, value: float, info: ValidationInfo) -> float:
        names = [f"young_modulus_{axis}" for axis in "xyz"] + ["poisson_ratio_xy", "poisson_ratio_yz"]
        if not all(name in info.data for name in names):
            return value  # the missing or invalid values are reported themselves
        x, y, z, xy, yz = (info.data[name] for name in names)
        # With r_ij = nu_ij sqrt(E_j / E_i) the determinant 1 - r_xy^2 - r_yz^2 - r_xz^2 - 2 r_xy r_yz r_xz must be > 0.
        first, second = xy * math.sqrt(y / x), yz * math.sqrt(z / y)
        reach = math.sqrt((1.0 - first**2) * (1.0 - second**2))
        low, high = ((-first * second + sign * reach) * math.sqrt(x / z) for sign in (-1.0, 1.0))
        if low < value < high:
            return value
        raise inadmissible(f"> {low:.6g} and < {high:.6g}")

    @property
    def engineering_constants(self) -> EngineeringConstants:
        """Elastic constants along the axes."""
        return EngineeringConstants(
            (self.young_modulus_x, self.young_modulus_y, self.young_modulus_z),
            (self.poisson_ratio_xy, self.poisson_ratio_yz, self.poisson_ratio_xz),
            (self.shear_modulus_xy, self.shear_modulus_yz, self.shear_modulus_xz),
        )


Material = Annotated[Isotropic | Orthotropic | GeneralOrthotropic, Field(discriminator="kind")]
