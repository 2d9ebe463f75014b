"""Reading a case file: its kind, by the table that only this kind has, every value converted and checked."""

import os
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

from pydantic import ValidationError

from fem.names import nearest
from workflow import fields
from workflow.board_drop_case import BoardDropCase, PackageCase
from workflow.case_kind import FULL, Case
from workflow.problems import CaseError, Problem
from workflow.scales import choose, take_scales
from workflow.scene_cases import DropCase, DropsCase, JointCase, OscillationCase
from workflow.structure.case import StructureCase
from workflow.validation import translate

SETTING = "--set"  # where a value is from that an option gives
KINDS: dict[str, type[Case]] = {
    model.kind: model for model in (BoardDropCase, DropCase, JointCase, DropsCase, OscillationCase, StructureCase)
}


def kind_of(table: Mapping) -> type[Case]:
    """Return the model of a case file.

    Raises:
        CaseError: the file has the tables of no kind, or of several.
    """
    found = [kind for kind in KINDS if kind in table]
    if found == [PackageCase.kind] and not any(nearest(name, ("shock",)) for name in table):
        return PackageCase
    if len(found) == 1:
        return KINDS[found[0]]
    choice = "exactly one of " + ", ".join(f"[{kind}]" for kind in KINDS)
    if found:
        message = "is of several kinds at once: it has " + " and ".join(f"[{kind}]" for kind in found)
        raise CaseError("case", [Problem("", message, None, choice)])
    hint = next((f"[{near}]" for name in table if (near := nearest(name, KINDS))), "")
    raise CaseError("case", [Problem("", "says not what kind of case it is", None, choice, hint)])


def read_case(path: Path, overrides: Sequence[str] = (), oversubscribe: bool = False) -> Case:
    """Read and check a case file.

    Args:
        path: TOML file.
        overrides: "dotted.key=value" settings, applied over the file and its scale; values are TOML, quotes may be
            left out.
        oversubscribe: whether more MPI ranks than cores are welcome.

    Returns:
        The case, every value checked.

    Raises:
        CaseError: with all problems found: syntax, names, units, ranges, and geometry that cannot be.
    """
    problems: list[Problem] = []
    table = read_toml(path)
    origins = _override(table, overrides, path, problems)
    try:
        kind = kind_of(table)
    except CaseError as error:
        raise CaseError(str(path), error.problems + problems, origins) from None
    values = kind.located(fields.to_si_table(kind, kind.completed(table), "", problems), path.parent)
    case = None
    try:
        case = kind.model_validate(values, strict=True)
    except ValidationError as error:
        problems += translate(kind, error, table, {problem.key for problem in problems})
    if case is not None and not problems:
        problems = case.problems() + too_many_ranks(case, oversubscribe)
    if case is None or problems:
        raise CaseError(str(path), problems, origins)
    return case


def display_values(case: Case) -> dict[str, str]:
    """Return every parameter that has a value as dotted key -> text in the user's unit."""
    return {key: fields.display(value, field) for key, value, field in fields.leaves(case) if value is not None}


def too_many_ranks(case: Case, oversubscribe: bool) -> list[Problem]:
    """Find out whether a case asks for more MPI ranks than there are cores."""
    cores = available_cores()
    return [
        Problem(
            key,
            f"asks for {ranks} MPI ranks, this machine offers {cores} cores",
            ranks,
            f"<= {cores} in all, or more with --oversubscribe",
        )
        for key, ranks in case.ranks_by_key.items()
        if ranks > cores and not oversubscribe
    ]


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0))


def read_toml(path: Path) -> dict:
    """Read a TOML file; CaseError where it cannot be read."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise CaseError(str(path), [Problem("", "no such case file")]) from error
    except (OSError, UnicodeDecodeError) as error:
        raise CaseError(str(path), [Problem("", f"cannot be read: {error}")]) from error
    except tomllib.TOMLDecodeError as error:
        raise CaseError(str(path), [Problem("", f"is not TOML: {error}")]) from error


def _override(table: dict, overrides: Sequence[str], path: Path, problems: list[Problem]) -> dict[str, str]:
    """Write the values of the chosen scale, then overrides, into a table; return where each key was given."""
    settings = [_setting(override, problems) for override in overrides]
    scales, chosen = take_scales(table, problems), table.get("scale", FULL)
    chosen = next((value for key, value in reversed(settings) if key == "scale"), chosen)
    of_scale = choose(chosen, scales, problems)
    for key, value in [*of_scale.items(), *settings]:
        if all(key.split(".")) and not set_value(table, key.split("."), value):
            problems.append(Problem(key, "lies below a value, not a table", value))
    return dict.fromkeys(of_scale, f"{path} [scales.{chosen}]") | {key: SETTING for key, _ in settings}


def _setting(override: str, problems: list[Problem]) -> tuple[str, object]:
    """Return key and value of an override."""
    key, equals, text = override.partition("=")
    key = key.strip()
    if not equals or not all(key.split(".")):
        problems.append(Problem(key, "is no setting", override, "--set dotted.key=value"))
        return "", None
    return key, override_value(text.strip())


def override_value(text: str) -> object:
    """Return the value that a setting's text stands for: TOML, quotes may be left out."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def set_value(table: dict, path: list[str], value: object) -> bool:
    """Write a value at a path of names; False where the path leads through a value."""
    for name in path[:-1]:
        table = table.setdefault(name, {})
        if not isinstance(table, dict):
            return False
    table[path[-1]] = value
    return True
