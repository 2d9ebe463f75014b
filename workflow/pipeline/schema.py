"""JSON schema of the case file, where quantities are strings with units."""

from collections.abc import Iterator
from functools import cache
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from reflowshock.quantity import Quantity
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.fields import allowed, display, holds_named_tables, models_of, quantity_of
from reflowshock.workflow.case.names import NAME
from reflowshock.workflow.kinds import KINDS

SCALES = {
    "description": "values by dotted keys, which replace values of the file if this scale is selected",
    "type": "object",
    "propertyNames": {"pattern": NAME},
    "additionalProperties": {"type": "object"},
}


@cache
def case_schema() -> dict:
    """Return the JSON schema (draft 2020-12) of case files of all kinds; the result is cached, do not modify it."""
    kinds: list[dict] = []
    definitions: dict = {}
    for kind in (record.case for record in KINDS):
        schema = _with_own_names(_kind_schema(kind), kind.kind, definitions)
        definitions |= schema.pop("$defs")
        schema["properties"]["scales"] = SCALES
        kinds.append(schema)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "reflowshock case",
        "anyOf": kinds,
        "$defs": definitions,
    }


def _with_own_names(schema: dict, kind: str, taken: dict) -> dict:
    """Prefix the names of definitions with the kind if another kind defines one of them differently."""
    definitions = schema["$defs"]
    if all(taken.get(name, definition) == definition for name, definition in definitions.items()):
        return schema
    renamed = _replaced(schema, {f"#/$defs/{name}": f"#/$defs/{kind}.{name}" for name in definitions})
    return renamed | {"$defs": {f"{kind}.{name}": definition for name, definition in renamed["$defs"].items()}}


def _replaced(node: Any, texts: dict[str, str]) -> Any:
    """Replace texts in all values of a nested structure."""
    if isinstance(node, dict):
        return {key: _replaced(value, texts) for key, value in node.items()}
    if isinstance(node, list):
        return [_replaced(value, texts) for value in node]
    return texts.get(node, node) if isinstance(node, str) else node


def _kind_schema(kind: type[Case]) -> dict:
    schema = kind.model_json_schema()
    for model in set(_reachable(kind)):
        properties = schema if model is kind else schema["$defs"][model.__name__]
        for name, field in model.model_fields.items():
            if (quantity := quantity_of(field)) is not None:
                _add_range_and_default(properties["properties"][name], quantity, field)
            if holds_named_tables(field):
                properties["properties"][name]["propertyNames"] = {"pattern": NAME}
    # Defaults of whole tables would repeat the defaults of their fields as SI floats.
    _drop_table_defaults(schema)
    return schema


def _add_range_and_default(schema: dict, quantity: Quantity, field: FieldInfo) -> None:
    """Add description with range, and default, to the schema of a quantity."""
    schema["description"] = f"{quantity.described}; {allowed(field)}"
    if field.default in (PydanticUndefined, None):
        schema.pop("default", None)
    else:
        schema["default"] = display(field.default, field)


def _reachable(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    yield model
    for field in model.model_fields.values():
        for member in models_of(field):
            yield from _reachable(member)


def _drop_table_defaults(node: object) -> None:
    if isinstance(node, dict):
        if isinstance(node.get("default"), dict):
            del node["default"]
        for value in node.values():
            _drop_table_defaults(value)
    elif isinstance(node, list):
        for value in node:
            _drop_table_defaults(value)
