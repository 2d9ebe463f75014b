"""Scales of a case: tables ``[scales.NAME]`` of dotted keys whose values replace those in the file.

scale = "full"                                   # or --set scale="quick"
[scales.quick]
"board.numerics.coarse_size" = "2 mm"
"""

import tomllib
from collections.abc import Iterator

from reflowshock.names import find_nearest
from reflowshock.problem import Problem, as_toml
from reflowshock.workflow.case.case import FULL
from reflowshock.workflow.case.names import is_name, wrong_name
from reflowshock.workflow.case.toml_file import DEEPEST

KEYS = 'a table of dotted keys, e.g. "board.numerics.coarse_size" = "2 mm"'


def take_scales(table: dict, problems: list[Problem]) -> dict[str, dict[str, object]]:
    """Remove the scales from the table of a case file and return them.

    Args:
        table: Contents of the file; ``scales`` is removed.
        problems: List to which errors are added.

    Returns:
        Name of a scale -> its values by dotted key.
    """
    tables = table.pop("scales", {})
    if not isinstance(tables, dict):
        problems.append(Problem("scales", "must be a table", tables, "tables [scales.NAME]"))
        return {}
    scales = {}
    for name, values in tables.items():
        if name == FULL:
            problems.append(Problem(f"scales.{name}", "is reserved for the file itself", None, "another name"))
        elif not is_name(name):
            problems.append(wrong_name("scales", name))
        elif not isinstance(values, dict):
            problems.append(Problem(f"scales.{name}", "must be a table", values, KEYS))
        else:
            settings = dict(dotted(values))
            scales[name] = {key: value for key, value in settings.items() if is_key(key)}
            problems += [
                Problem(f"scales.{name}.{key}", "is not a dotted key", value, KEYS)
                for key, value in settings.items()
                if key not in scales[name]
            ]
    return scales


def is_key(text: str) -> bool:
    """Return whether a text is a valid dotted key: names separated by dots, none empty, and not nested too deep."""
    names = text.split(".")
    return all(names) and len(names) <= DEEPEST


def choose(name: object, scales: dict[str, dict[str, object]], problems: list[Problem]) -> dict[str, object]:
    """Return the values of a scale by dotted key: empty for ``full``; add a problem for an unknown scale.

    Args:
        name: Name of the scale as the user wrote it.
        scales: Name of a scale -> its values by dotted key, without ``full``, which changes nothing.
        problems: List to which an unknown scale is added.
    """
    if isinstance(name, str) and (name == FULL or name in scales):
        return scales.get(name, {})
    names = [FULL, *scales]
    problems.append(
        Problem("scale", "unknown scale", name, "one of " + ", ".join(names), find_nearest(str(name), names))
    )
    return {}


def scales_text(scales: dict[str, dict[str, object]]) -> Iterator[str]:
    """Write scales as tables of a case file, one text each.

    Args:
        scales: Name of a scale -> its values by dotted key.
    """
    for name, values in scales.items():
        lines = [f"{as_toml(key)} = {as_toml(value)}" for key, value in values.items()]
        yield "\n".join([f'# Values that change with --set scale="{name}".', f"[scales.{name}]", *lines, ""])


def dotted(values: dict, prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield dotted key and value of every entry of nested tables that is not a table itself.

    Args:
        values: Nested tables.
        prefix: Prefix of all keys, with its dot.
    """
    for key, value in values.items():
        if isinstance(value, dict):
            yield from dotted(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def override_value(text: str) -> object:
    """Parse the value of a ``--set`` option as TOML; text that is not valid TOML is returned as it is."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text
