"""Parameters of the drop shock: materials, pulse, coupling, ranks.

All values are SI floats; see ``meshing.parameters`` for what the unit strings mean.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Pressure = Annotated[float, "GPa"]
Density = Annotated[float, "kg/m^3"]


class Parameters(BaseModel):
    """Base of all parameter models: immutable, unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Isotropic(Parameters):
    """Isotropic linear elastic material."""

    kind: Literal["isotropic"] = "isotropic"
    density: Density = Field(gt=0)
    young_modulus: Pressure = Field(gt=0)
    poisson_ratio: float = Field(gt=-1, lt=0.5)


class Orthotropic(Parameters):
    """Orthotropic linear elastic laminate, equal in x and y (z is the thickness).

    ``poisson_ratio_out_of_plane`` is nu_xz: contraction in z under tension in x.
    """

    kind: Literal["orthotropic"] = "orthotropic"
    density: Density = Field(gt=0)
    young_modulus_in_plane: Pressure = Field(gt=0)
    young_modulus_out_of_plane: Pressure = Field(gt=0)
    poisson_ratio_in_plane: float = Field(gt=-1, lt=1)
    poisson_ratio_out_of_plane: float
    shear_modulus_in_plane: Pressure = Field(gt=0)
    shear_modulus_out_of_plane: Pressure = Field(gt=0)


Material = Annotated[Isotropic | Orthotropic, Field(discriminator="kind")]

# H tables 3-5; the shear modulus G_xz and the density are from the same widely used FR4 data set, e.g.
# Syed et al., ECTC 2005, and its successors; H leaves them out (PHYSICS 1).
FR4 = Orthotropic(
    density=1910.0,
    young_modulus_in_plane=27.924e9,
    young_modulus_out_of_plane=12.204e9,
    poisson_ratio_in_plane=0.11,
    poisson_ratio_out_of_plane=0.39,
    shear_modulus_in_plane=12.6e9,
    shear_modulus_out_of_plane=5.5e9,
)
SILICON = Isotropic(density=2330.0, young_modulus=132.46e9, poisson_ratio=0.28)
COPPER = Isotropic(density=8960.0, young_modulus=141.92e9, poisson_ratio=0.35)
SAC405 = Isotropic(density=7440.0, young_modulus=44.6e9, poisson_ratio=0.40)


class Materials(Parameters):
    """The material of each role that a part of the mesh can have."""

    board: Material = FR4
    substrate: Material = FR4
    die: Material = SILICON
    copper: Material = COPPER
    solder: Material = SAC405


class Ranks(Parameters):
    """MPI ranks of each model; a DNS run uses the sum of both.

    ``split`` gives each model ranks of its own, which work at the same time; ``shared`` gives both models to all ranks,
    which take turns: better where the models' costs differ from their ranks.
    """

    macro: int = Field(1, ge=1)
    meso: int = Field(1, ge=1)
    placement: Literal["split", "shared"] = "split"


class ShockNumerics(Parameters):
    """How the shock is computed."""

    modes: tuple[Literal["two_scale", "dns"], ...] = ("two_scale", "dns")
    step_fraction: float = Field(0.9, gt=0, le=0.95)
    mass_scaled: tuple[Literal["board", "substrate", "die", "copper", "solder"], ...] = ()
    history_samples: int = Field(600, ge=2)
    field_samples: int = Field(12, ge=2)
    energy_balance_limit: float = Field(0.02, gt=0)


class Shock(Parameters):
    """Half-sine input-G at the mounting holes (JESD22-B111; H 4.4)."""

    peak_acceleration: Annotated[float, "G"] = Field(gt=0)
    pulse_duration: Annotated[float, "ms"] = Field(gt=0)
    duration: Annotated[float, "ms"] = Field(gt=0)
    ranks: Ranks = Ranks()
    numerics: ShockNumerics = ShockNumerics()
