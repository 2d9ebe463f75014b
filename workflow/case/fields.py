"""Fields of parameter models: their units, ranges, nested models, and values in either form (text, SI)."""

import math
import types
import typing
from collections.abc import Iterator

import annotated_types
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from reflowshock.problem import Problem
from reflowshock.quantity import Quantity
from reflowshock.units import UnitError
from reflowshock.workflow.case.names import is_name, wrong_name

BOUNDS: tuple[tuple[type, str, str], ...] = (
    (annotated_types.Gt, "gt", ">"),
    (annotated_types.Ge, "ge", ">="),
    (annotated_types.Lt, "lt", "<"),
    (annotated_types.Le, "le", "<="),
)


def quantity_of(field: FieldInfo) -> Quantity | None:
    """Return the physical quantity (dimension and user's unit) of a model field, or of the items of its list.

    Args:
        field: Field of a parameter model (pydantic).

    Returns:
        Quantity; None for numbers, names and tables.
    """
    return next((item for item in _metadata(field) if isinstance(item, Quantity)), None)


TAG_KEYS = ("kind", "method")  # keys whose value selects the model of a table


def holds_named_tables(field: FieldInfo) -> bool:
    """Return whether a field is a table of tables with user-defined names, such as a structure's layers.

    Args:
        field: Field of a parameter model (pydantic).
    """
    return typing.get_origin(field.annotation) is dict


def models_of(field: FieldInfo) -> tuple[type[BaseModel], ...]:
    """Return the parameter models (pydantic) that may describe the table of a field.

    Args:
        field: Field of a parameter model; for a table of tables with user-defined names, its models describe these
            tables.

    Returns:
        Models, several if the table has kinds; empty if the field is a value.
    """
    annotation = typing.get_args(field.annotation)[1] if holds_named_tables(field) else field.annotation
    annotation = _bare(annotation)
    members = typing.get_args(annotation) if _is_union(annotation) else (annotation,)
    return tuple(member for member in map(_bare, members) if isinstance(member, type) and issubclass(member, BaseModel))


def model_of(field: FieldInfo, table: dict) -> type[BaseModel] | None:
    """Return the model of a table; if a field has several models, the one with the tag of the table.

    Args:
        field: Field of a parameter model.
        table: Table of the case file; its tag is the value of ``kind`` or ``method``, else the default's.

    Returns:
        Model of the table; None for a field without models or an unknown tag.
    """
    models = models_of(field)
    if len(models) < 2:
        return models[0] if models else None
    key = tag_key(models[0])
    tag = table.get(key, getattr(field.default, key, None))
    return next((model for model in models if tag_of(model) == tag), None)


def tag_key(model: type[BaseModel]) -> str:
    """Return the key that identifies a model among the models of a table: ``kind`` or ``method``."""
    return next(key for key in TAG_KEYS if key in model.model_fields)


def tag_of(model: type[BaseModel]) -> str:
    """Return the value of the tag (``kind`` or ``method``) that selects a model, such as "pulse"."""
    return str(typing.get_args(model.model_fields[tag_key(model)].annotation)[0])


def alternatives(field: FieldInfo) -> tuple[FieldInfo, ...]:
    """Split a field that allows several types of value, such as a name or a number, into one field for each type.

    Args:
        field: Field of a parameter model (pydantic).

    Returns:
        One field per type, without None; the field itself if there is only one type.
    """
    members = typing.get_args(field.annotation) if _is_union(field.annotation) and not models_of(field) else ()
    values = [member for member in members if member is not types.NoneType]
    return tuple(map(FieldInfo.from_annotation, values)) if len(values) > 1 else (field,)


def allowed(field: FieldInfo) -> str:
    """Describe the allowed values of a field as text, for messages: names, or a range in the user's unit.

    Args:
        field: Field of a parameter model (pydantic).

    Returns:
        Text; ``any`` and the kind of quantity without bounds, and empty for other fields without a limit.
    """
    kinds = alternatives(field)
    if len(kinds) > 1:
        return ", or ".join(", ".join(literal_names(kind)) or allowed(kind) or "a list of names" for kind in kinds)
    names = literal_names(field)
    if names:
        return _choice(field) + ", ".join(names)
    if field.annotation is bool:
        return "true or false"
    quantity = quantity_of(field)
    bounds = [
        f"{sign} {quantity.text(getattr(item, attribute), 6) if quantity else f'{getattr(item, attribute):g}'}"
        for item in _metadata(field)
        for kind, attribute, sign in BOUNDS
        if isinstance(item, kind)
    ]
    if bounds:
        return " and ".join(bounds)
    return f"any {quantity.described}" if quantity else ""


def literal_names(field: FieldInfo) -> tuple[str, ...]:
    """Return the allowed names of a field, or of the items of its list; empty for other fields."""
    annotation = field.annotation
    if typing.get_origin(annotation) is tuple or _is_union(annotation):
        annotation = typing.get_args(annotation)[0]
    return typing.get_args(annotation) if typing.get_origin(annotation) is typing.Literal else ()


def item_count_message(field: FieldInfo) -> str:
    """Return the message that a list of a case file has a wrong number of items: at least one, or exactly n items.

    Args:
        field: Field of a parameter model whose type is a tuple, which gives the required number.
    """
    items = typing.get_args(field.annotation)
    return "must be a list with at least one item" if Ellipsis in items else f"must be a list of {len(items)} items"


def to_si_table(model: type[BaseModel], table: dict, prefix: str, problems: list[Problem]) -> dict:
    """Convert a table of a case file to SI floats, field by field.

    Args:
        model: Model of the table; unknown keys stay, so that its validation rejects them.
        table: The table as TOML gives it.
        prefix: Dotted key of the table with its dot, or empty.
        problems: List to which unit errors are added; their values become nan.

    Returns:
        The table in SI values. Tables of the same kind as their default are completed by it.
    """
    return {
        name: _to_si_value(model.model_fields[name], value, prefix + name, problems)
        if name in model.model_fields
        else value
        for name, value in table.items()
    }


def _to_si_value(field: FieldInfo, value: object, key: str, problems: list[Problem]) -> object:
    quantity = quantity_of(field)
    if quantity is not None and isinstance(value, list):
        return tuple(_to_si_value(field, item, key, problems) for item in value)
    if quantity is not None and not any(value in literal_names(kind) for kind in alternatives(field)):
        return _converted(quantity, field, key, value, problems)
    if isinstance(value, dict) and holds_named_tables(field):
        problems += [wrong_name(key, name) for name in value if not is_name(name)]
        return {name: _of_table(field, item, f"{key}.{name}", problems) for name, item in value.items()}
    if isinstance(value, dict):
        return _of_table(field, value, key, problems)
    return tuple(value) if isinstance(value, list) else value


def _converted(quantity: Quantity, field: FieldInfo, key: str, value: object, problems: list[Problem]) -> float:
    """Convert the value of a key to SI; return nan and add a problem if it is not a valid quantity."""
    try:
        return quantity.to_si(value)
    except UnitError as error:
        problems.append(Problem(key, str(error), value, allowed(field)))
        return math.nan


def _of_table(field: FieldInfo, value: object, key: str, problems: list[Problem]) -> object:
    """Convert one table of a field; ``kind`` and missing values are taken from the default of the field."""
    if isinstance(value, dict):
        model = model_of(field, value)
        if model is None:
            return value
        default_values = field.default.model_dump() if isinstance(field.default, model) else {}
        # Model defaults except tags are left out, so that ``model_fields_set`` holds the keys of the case.
        model_fields = model.model_fields
        defaults = {
            name: default
            for name, default in default_values.items()
            if name in TAG_KEYS or default != model_fields[name].default
        }
        return defaults | to_si_table(model, value, key + ".", problems)
    return value


def leaves(parameters: BaseModel, prefix: str = "") -> Iterator[tuple[str, object, FieldInfo]]:
    """Yield dotted key, SI value and model field of every parameter, in the order of the models.

    Args:
        parameters: Case or one of its tables.
        prefix: Dotted key of the table with its dot, or empty for the case.
    """
    for name, field in type(parameters).model_fields.items():
        value = getattr(parameters, name)
        if isinstance(value, BaseModel):
            yield from leaves(value, f"{prefix}{name}.")
        elif holds_named_tables(field):
            for own_name, table in value.items():
                if isinstance(table, BaseModel):
                    yield from leaves(table, f"{prefix}{name}.{own_name}.")
                else:
                    yield f"{prefix}{name}.{own_name}", table, FieldInfo.from_annotation(type(table))
        else:
            yield prefix + name, value, field


def display(value: object, field: FieldInfo) -> str:
    """Write an SI value as text in the user's unit, as in a case file but without quotes.

    Args:
        value: Value of a parameter; tuples are written as lists.
        field: Field of the value, which gives its quantity.
    """
    quantity = quantity_of(field)
    if quantity is not None and isinstance(value, float):
        return quantity.text(value)
    if isinstance(value, tuple):
        return "[" + ", ".join(display(item, field) for item in value) + "]"
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def as_written(value: object, field: FieldInfo | None) -> object:
    """Return an SI value as text in the user's unit if its field is a quantity, otherwise the value itself.

    Args:
        value: SI value; None is returned as it is.
        field: Field of the value; None for a value without one.
    """
    return display(value, field) if value is not None and field is not None and quantity_of(field) else value


def _choice(field: FieldInfo) -> str:
    return "any of " if typing.get_origin(field.annotation) is tuple else "one of "


def _metadata(field: FieldInfo) -> Iterator[object]:
    """Yield quantities and bounds of a field, or of the items of its list."""
    yield from field.metadata
    inner = typing.get_args(field.annotation)[:1]
    while inner:
        for extra in getattr(inner[0], "__metadata__", ()):
            yield from extra.metadata if isinstance(extra, FieldInfo) else (extra,)
        inner = typing.get_args(inner[0])[:1]


def _bare(annotation: object) -> object:
    """Return a type without its ``Annotated``."""
    return typing.get_args(annotation)[0] if typing.get_origin(annotation) is typing.Annotated else annotation


def _is_union(annotation: object) -> bool:
    return typing.get_origin(annotation) in (typing.Union, types.UnionType)


def display_values(case: BaseModel) -> dict[str, str]:
    """Return every parameter that has a value: dotted key -> value as text in the user's unit.

    Args:
        case: Case or one of its tables.
    """
    return {key: display(value, field) for key, value, field in leaves(case) if value is not None}
