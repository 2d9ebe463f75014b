"""Case file reader: detects the kind by its characteristic table, converts and checks every value."""

from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from reflowshock.problem import Problem
from reflowshock.workflow.case import fields
from reflowshock.workflow.case.case import FULL, Case
from reflowshock.workflow.case.problems import CaseError, Origin
from reflowshock.workflow.case.scales import choose, is_key, override_value, take_scales
from reflowshock.workflow.case.toml_file import is_too_deep, parse_toml, read_text
from reflowshock.workflow.case.toml_places import Places
from reflowshock.workflow.case.validation import translate
from reflowshock.workflow.kinds import kind_named_in
from reflowshock.workflow.pipeline import gate
from reflowshock.workflow.pipeline.gate import Leave

SETTING = "--set"  # origin of overridden values in error messages


def read_case(path: Path, overrides: Sequence[str] = (), oversubscribe: bool = False, force: bool = False) -> Case:
    """Read and check a case file and all its input files, so that the case can run.

    Args:
        path: TOML file.
        overrides: "dotted.key=value" settings that override the file and its scale; values are TOML, quotes may be
            omitted.
        oversubscribe: Whether more MPI ranks than cores and more memory than this machine has are allowed, e.g. for
            cases that run elsewhere.
        force: Whether implausible values are allowed.

    Returns:
        The case, every value checked.

    Raises:
        CaseError: With all problems and their positions: syntax, names, units, ranges, impossible geometry, unreadable
            files, too large models.
    """
    text = read_text(path)
    table = parse_toml(str(path), text)
    origins: dict[str, Origin] = {}
    try:
        return _checked_case(path, table, overrides, origins, Leave(oversubscribe, force))
    except CaseError as error:
        raise CaseError(str(path), error.problems, origins).located(Places(text)) from error


def _checked_case(path: Path, table: dict, overrides: Sequence[str], origins: dict[str, Origin], leave: Leave) -> Case:
    """Return the case of a table and record origins of overridden keys; errors have no positions yet."""
    problems: list[Problem] = []
    origins |= _override(table, overrides, problems)
    try:
        kind = kind_named_in(table).case
    except CaseError as error:
        raise CaseError(str(path), error.problems + problems) from None
    values = kind.located(fields.to_si_table(kind, kind.completed(table), "", problems), path.parent)
    case = None
    try:
        case = kind.model_validate(values, strict=True)
    except ValidationError as error:
        problems += translate(kind, error, table, {problem.key for problem in problems})
    if case is not None and not problems:
        case = case.resolved()
        problems = gate.problems_of(case, leave)
    if case is None or problems:
        raise CaseError(str(path), problems)
    return case


def _override(table: dict, overrides: Sequence[str], problems: list[Problem]) -> dict[str, Origin]:
    """Write the values of the chosen scale, then overrides, into a table; return the origin of each key."""
    settings = [_setting(override, problems) for override in overrides]
    scales, chosen = take_scales(table, problems), table.get("scale", FULL)
    chosen = next((value for key, value in reversed(settings) if key == "scale"), chosen)
    of_scale = choose(chosen, scales, problems)
    wrong = {problem.key for problem in problems}
    for key, value in [*of_scale.items(), *settings]:
        if key not in wrong and not set_value(table, key.split("."), value):
            problems.append(Problem(key, "cannot be set: the key above it has a value, not a table", value))
    of_file = {key: Origin(f"[scales.{chosen}]", f"scales.{chosen}.{key}") for key in of_scale}
    return of_file | {key: Origin(SETTING) for key, _ in settings}


def _setting(override: str, problems: list[Problem]) -> tuple[str, object]:
    """Return key and value of an override; add a problem if it has no valid key or value."""
    key, equals, text = override.partition("=")
    key, value = key.strip(), override_value(text.strip())
    if not equals or not is_key(key):
        problems.append(Problem(key or override, "is not a setting", override, "--set dotted.key=value"))
    elif is_too_deep(value):
        problems.append(Problem(key, "has lists or tables nested too deeply", None, "a value, or a list of values"))
    return key or override, value


def set_value(table: dict, path: list[str], value: object) -> bool:
    """Set a value in nested tables, in place, creating missing tables.

    Args:
        table: Outermost table.
        path: Names of the tables and of the key, the outermost first.
        value: Value to set.

    Returns:
        Whether the value was set: False if the path leads through a value that is not a table.
    """
    for name in path[:-1]:
        table = table.setdefault(name, {})
        if not isinstance(table, dict):
            return False
    table[path[-1]] = value
    return True
