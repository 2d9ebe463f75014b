"""Case file writer: every parameter with value, default and range."""

import json
import textwrap
from pathlib import Path

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from reflowshock.materials.roles import ByName
from reflowshock.names import find_nearest
from reflowshock.problem import Problem, as_toml
from reflowshock.workflow.case.case import CASES, Case, Title
from reflowshock.workflow.case.fields import (
    allowed,
    alternatives,
    display,
    holds_named_tables,
    literal_names,
    models_of,
    quantity_of,
)
from reflowshock.workflow.case.names import is_name, wrong_name
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.scales import scales_text, take_scales
from reflowshock.workflow.case.toml_file import read_toml
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.schema import case_schema

COMMENT_COLUMN = 44
HEADER = """\
#:schema reflowshock.schema.json
# Case "{name}", from the template "{template}".
# All parameters are listed, except constants of library materials. A quantity is a string with any unit of its
# dimension ("0.48 mm", "480 um").
# Tables named "numerics" contain solver settings, all others the model. Lines that repeat a default can be removed.
"""


def templates() -> dict[str, Path]:
    """Return the case files that are shipped with the program.

    Returns:
        Name of a case -> path of its file.
    """
    return {path.parent.name: path for path in sorted(CASES.glob("*/case.toml"))}


def write_new_case(name: str, template: str, folder: Path = Path()) -> Path:
    """Write ``<folder>/<name>.toml``, complete and commented.

    Args:
        name: Name of the case.
        template: Name of the shipped case to copy.
        folder: Output folder.

    Returns:
        The path of the file.

    Raises:
        CaseError: The name is invalid, the template does not exist, or the file exists already.
    """
    cases = templates()
    if template not in cases:
        choice, hint = "one of " + ", ".join(cases), find_nearest(template, cases)
        raise CaseError("new", [Problem("--template", "unknown template", template, choice, hint)])
    if not is_name(name):
        raise CaseError("new", [wrong_name("NAME", name)])
    path = folder / f"{name}.toml"
    if path.exists():
        raise CaseError("new", [Problem("NAME", f"{path} exists already", name)])
    case = read_case(cases[template], [f"case.name='{name}'"], oversubscribe=True)
    scales = scales_text(take_scales(read_toml(cases[template]), []))
    path.write_text("\n".join([case_text(case, template), *scales]), encoding="utf-8")
    write_schema(folder)
    return path


def write_schema(folder: Path) -> None:
    """Write the JSON schema of case files, with which editors complete and check a new case.

    Args:
        folder: Folder into which ``reflowshock.schema.json`` is written; an existing one is replaced.
    """
    (folder / "reflowshock.schema.json").write_text(json.dumps(case_schema(), indent=2), encoding="utf-8")


def case_text(case: Case, template: str) -> str:
    """Write a case as TOML with comments, every parameter in the user's unit.

    Args:
        case: Case to write.
        template: Name of the shipped case that it starts from, named in a comment.
    """
    blocks = [HEADER.format(name=case.case.name, template=template)]
    _add_table(blocks, "", case)
    return "\n".join(blocks)


def _add_table(blocks: list[str], key: str, parameters: BaseModel) -> None:
    """Append the block of a table, then the blocks of its subtables."""
    lines, tables, absent = [], [], []
    for name, field in type(parameters).model_fields.items():
        value = getattr(parameters, name)
        if library_name := _library_name(value, field):
            remark = f" # name of the library, or a table; default {_library_name(field.default, field)}"
            lines.append(f'{name} = "{library_name}"'.ljust(COMMENT_COLUMN) + remark)
        elif isinstance(value, BaseModel):
            tables.append((f"{key}.{name}".lstrip("."), value))
        elif holds_named_tables(field) and not models_of(field):
            lines.append(f"{name} = {{ {', '.join(f'{kind} = {as_toml(item)}' for kind, item in value.items())} }}")
        elif holds_named_tables(field):
            tables += [(f"{key}.{name}.{own_name}".lstrip("."), table) for own_name, table in value.items()]
        elif value is None and models_of(field):
            absent.append(_absent_table(f"{key}.{name}".lstrip("."), models_of(field)[0]))
        else:
            lines.append(_line(name, value, field))
    header = [*_describe(type(parameters)), *([f"[{key}]"] if lines else [])] if key else []
    if header or lines:
        blocks.append("\n".join([*header, *lines, ""]))
    blocks.extend(absent)
    kind = getattr(parameters, "kind", "")
    for name, table in sorted(tables, key=lambda item: item[0] not in ("case", kind)):
        _add_table(blocks, name, table)


def _library_name(value: object, field: FieldInfo) -> str | None:
    """Return the library name of a material, or None for other values."""
    choices = next((item.choices for item in field.metadata if isinstance(item, ByName)), {})
    return next((name for name, material in choices.items() if material == value), None)


def _absent_table(key: str, model: type[BaseModel]) -> str:
    """Return an absent table as comments."""
    lines, tables = [], []
    for name, field in model.model_fields.items():
        value = None if field.is_required() else field.get_default()
        if isinstance(value, BaseModel):
            tables.append(_absent_table(f"{key}.{name}", type(value)))
        else:
            lines.append(_line(name, value, field))
    commented = [line if line.startswith("#") else f"# {line}" for line in (f"[{key}]", *lines)]
    return "\n".join([*_describe(model, "Not given: "), *commented, "", *tables])


def _line(name: str, value: object, field: FieldInfo) -> str:
    if value is None:
        return f"# {name} = ...".ljust(COMMENT_COLUMN) + f" # {'; '.join(filter(None, ('not given', allowed(field))))}"
    text = _value(value, field)
    is_fixed = len(literal_names(field)) == len(alternatives(field)) == 1
    remarks = [] if is_fixed else [allowed(field)]
    if field.default not in (PydanticUndefined, "", None):
        remarks.append(f"default {_default(field)}")
    comment = "; ".join(remark for remark in remarks if remark)
    line = f"{name} = {text}"
    return f"{line:<{COMMENT_COLUMN}} # {comment}" if comment else line


def _value(value: object, field: FieldInfo) -> str:
    """Write a value as TOML, a quantity with its unit."""
    if isinstance(value, tuple):
        return "[" + ", ".join(_value(item, field) for item in value) + "]"
    return f'"{display(value, field)}"' if quantity_of(field) else as_toml(value)


def _default(field: FieldInfo) -> str:
    is_switch = isinstance(field.default, bool)
    return as_toml(field.default) if is_switch else display(field.default, field)


def _describe(model: type[BaseModel], before: str = "") -> list[str]:
    """Return comment lines from the docstring of a model, without ReST marks."""
    if model is Title:
        return []
    text = before + " ".join((model.__doc__ or "").replace("``", "").split())
    return textwrap.wrap(text, 118, initial_indent="# ", subsequent_indent="# ")
