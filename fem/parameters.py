"""The base of all parameter models of fem."""

from pydantic import BaseModel, ConfigDict


class Parameters(BaseModel):
    """Base of all parameter models: immutable, unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")
