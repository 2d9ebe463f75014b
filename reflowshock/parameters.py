"""The base of all models of parameters."""

from typing import Any

from pydantic import BaseModel, ConfigDict


class Parameters(BaseModel):
    """Immutable; unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def changed(model: BaseModel, key: str, value: object) -> Any:
    """Return a model with another value at a dotted key; nothing is checked."""
    name, _, rest = key.partition(".")
    return model.model_copy(update={name: changed(getattr(model, name), rest, value) if rest else value})
