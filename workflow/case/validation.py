"""Translation of pydantic's validation errors to the keys and values of a case file."""

from collections.abc import Iterator, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from reflowshock.names import find_nearest
from reflowshock.problem import Problem
from reflowshock.workflow.case import fields
from reflowshock.workflow.case.names import wrong_name

RANGES = ("greater_than", "greater_than_equal", "less_than", "less_than_equal", "finite_number")


def translate(model: type[BaseModel], error: ValidationError, table: dict, reported: set[str]) -> list[Problem]:
    """Translate validation errors of pydantic to problems in the words of the case file.

    Args:
        model: The validated model of the case.
        error: Error of pydantic.
        table: Table as written by the user.
        reported: Dotted keys with a problem already reported, which are skipped.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) per key.
    """
    problems: dict[str, Problem] = {}
    for record in error.errors():
        names = _names(model, record["loc"])
        key = ".".join(names)
        if key not in reported:
            is_explained = bool({"allowed", "names"} & record.get("ctx", {}).keys())
            problem = _explained(names, record, table) if is_explained else _problem(model, names, record, table)
            problems.setdefault(key, problem)
    return list(problems.values())


def _problem(root: type[BaseModel], names: list[str], record: ErrorDetails, table: dict) -> Problem:
    key, value, kind, text = ".".join(names), _value(table, names), record["type"], record["msg"]
    model, field = _field(root, names, table)
    if kind == "extra_forbidden":
        siblings = list(model.model_fields) if model else []
        return Problem(key, "unknown key", value, "one of " + ", ".join(siblings), _meant(root, names, siblings))
    if field is None:
        return Problem(key, text, value)
    if kind in ("tuple_type", "too_short", "too_long") or (kind == "missing" and isinstance(record["loc"][-1], int)):
        return Problem(key, fields.item_count_message(field), value, fields.allowed(field))
    if kind == "missing":
        return Problem(key, "is missing", None, fields.allowed(field))
    if fields.models_of(field) and kind.startswith("union_tag"):
        return _kind_problem(key, value, field)
    if fields.models_of(field):
        return Problem(key, "must be a table", value)
    if kind == "literal_error":
        message = "unknown name" if len(fields.alternatives(field)) == 1 else "is not allowed"
        return Problem(key, message, value, fields.allowed(field), _nearest_name(value, field))
    if kind in RANGES:
        return Problem(key, "is out of range", value, fields.allowed(field))
    if kind == "string_pattern_mismatch":
        return wrong_name(key, value)
    return Problem(key, text[0].lower() + text[1:], value, fields.allowed(field))


def _meant(root: type[BaseModel], names: list[str], siblings: list[str]) -> str:
    """Return the existing key nearest to an unknown one, in the same or another table, or an empty string."""
    sibling = find_nearest(names[-1], siblings) or next((key for key in siblings if key.startswith(names[-1])), "")
    same_table = ".".join([*names[:-1], sibling]) if sibling else ""
    elsewhere = min(_places(root, names[-1]), key=len, default="")
    return elsewhere or same_table if len(names) == 1 else same_table or elsewhere


def _places(model: type[BaseModel], name: str, prefix: str = "") -> Iterator[str]:
    """Yield the dotted keys of a model that end with a name."""
    for key, field in model.model_fields.items():
        if key == name:
            yield prefix + key
        if not fields.holds_named_tables(field):
            for inner in fields.models_of(field):
                yield from _places(inner, name, f"{prefix}{key}.")


def _explained(names: list[str], record: ErrorDetails, table: dict) -> Problem:
    """Return the problem of a check that provides the allowed values or names itself."""
    context, value = record["ctx"], _value(table, names)
    choices = context.get("names", ())
    allowed = context.get("allowed", "one of " + ", ".join(choices))
    return Problem(".".join(names), record["msg"], value, allowed, find_nearest(str(value), choices))


def _kind_problem(key: str, value: Any, field: FieldInfo) -> Problem:
    """Return the problem of a table with a missing or unknown tag, such as its ``kind``."""
    candidates = fields.models_of(field)
    tag, kinds = fields.tag_key(candidates[0]), [fields.tag_of(candidate) for candidate in candidates]
    choice = "one of " + ", ".join(kinds)
    if not isinstance(value, dict):
        return Problem(key, "must be a table", value)
    if tag not in value:
        return Problem(f"{key}.{tag}", "is missing", None, choice)
    name = str(value[tag])
    return Problem(f"{key}.{tag}", f"unknown {tag}", name, choice, find_nearest(name, kinds))


def _nearest_name(value: Any, field: FieldInfo) -> str:
    """Return the valid name nearest to a wrong one, which may be an item of a list."""
    valid = fields.literal_names(field)
    wrong = [str(item) for item in (value if isinstance(value, list) else [value]) if item not in valid]
    return find_nearest(wrong[0], valid) if wrong else ""


def _names(model: type[BaseModel], location: Sequence[int | str]) -> list[str]:
    """Return the keys in a pydantic location, without tags and members of unions and list positions."""
    names: list[str] = []
    candidates: tuple[type[BaseModel], ...] = (model,)
    is_own_name = False
    for part in location:
        if isinstance(part, int) or (not is_own_name and _is_tag(candidates, part)):
            continue
        names.append(part)
        if is_own_name:
            is_own_name = False
            continue
        field = next((c.model_fields[part] for c in candidates if part in c.model_fields), None)
        if field is not None and len(fields.alternatives(field)) > 1:
            return names
        candidates = fields.models_of(field) if field else ()
        is_own_name = field is not None and fields.holds_named_tables(field)
    return names


def _is_tag(candidates: tuple[type[BaseModel], ...], part: str) -> bool:
    return len(candidates) > 1 and part in [fields.tag_of(candidate) for candidate in candidates]


def _field(root: type[BaseModel], names: list[str], table: dict) -> tuple[type[BaseModel] | None, FieldInfo | None]:
    """Return the model of a key's table and the field of the key in it."""
    model: type[BaseModel] | None = root
    field = None
    content: Any = table
    is_own_name = False
    for position, name in enumerate(names):
        content = content.get(name, {}) if isinstance(content, dict) else {}
        if not is_own_name:
            field = model.model_fields.get(name) if model else None
        is_own_name = not is_own_name and field is not None and fields.holds_named_tables(field)
        if field is not None and not is_own_name and position < len(names) - 1:
            model = fields.model_of(field, content if isinstance(content, dict) else {})
    return model, field


def _value(table: dict, names: list[str]) -> Any:
    value: Any = table
    for name in names:
        if not isinstance(value, dict) or name not in value:
            return None
        value = value[name]
    return value
