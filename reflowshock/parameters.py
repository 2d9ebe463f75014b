"""The base of all models of parameters."""

from pydantic import BaseModel, ConfigDict


class Parameters(BaseModel):
    """Immutable; unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")
