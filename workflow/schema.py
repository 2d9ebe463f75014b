"""JSON schema of the case file, in which a quantity is a string with its unit."""

import re
from collections.abc import Iterator

from pydantic import BaseModel

from workflow.case import Case
from workflow.fields import allowed, display, models_of, unit_of
from workflow.units import QUANTITY, dimension

PATTERN = re.sub(r"\?P<\w+>", "", f"^{QUANTITY.pattern}$")


def case_schema() -> dict:
    """Return the JSON schema (draft 2020-12) of a case file."""
    schema = Case.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = "reflowshock case"
    for model in set(_reachable(Case)):
        properties = schema if model is Case else schema["$defs"][model.__name__]
        for name, field in model.model_fields.items():
            unit = unit_of(field)
            if unit is not None:
                properties["properties"][name] = {
                    "type": "string",
                    "pattern": PATTERN,
                    "description": f"{dimension(unit)}, e.g. in {unit}; {allowed(field)}",
                    "x-unit": unit,
                    **({} if field.is_required() else {"default": display(field.default, field)}),
                }
    # Defaults of whole tables would be repeated in SI floats; each field has its own.
    _drop_table_defaults(schema)
    return schema


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
