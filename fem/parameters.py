"""Parameters of the drop shock: pulse, coupling, ranks.

All values are SI floats; see ``meshing.parameters`` for what the unit strings mean.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field


class Parameters(BaseModel):
    """Base of all parameter models: immutable, unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")


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
