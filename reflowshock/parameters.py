"""Base class of all parameter models."""

from collections.abc import Mapping
from functools import reduce
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict

Values = dict[str, object]  # dotted key -> value in SI units
Model = TypeVar("Model", bound=BaseModel)


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


def with_values(model: Model, values: Mapping[str, object]) -> Model:
    """Return a copy of a model with other values at dotted keys, without validation.

    Args:
        model: Parameters; not changed.
        values: Dotted key, e.g. "solder.numerics.spacing" -> new value, in SI units.
    """
    return reduce(lambda copy, item: with_value(copy, *item), values.items(), model)
