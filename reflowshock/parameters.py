"""Base class of all parameter models."""

from typing import Any

from pydantic import BaseModel, ConfigDict


class Parameters(BaseModel):
    """Immutable parameter model in which unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def with_value(model: BaseModel, key: str, value: object) -> Any:
    """Return a copy of a model with another value at a dotted key, without validation.

    Args:
        model: Parameters; not changed.
        key: Dotted names of attributes, e.g. "solder.numerics.spacing".
        value: New value, in SI units.
    """
    name, _, rest = key.partition(".")
    return model.model_copy(update={name: with_value(getattr(model, name), rest, value) if rest else value})
