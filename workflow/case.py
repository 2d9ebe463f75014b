"""The case: what a case file means, composed from the parameter models of the packages."""

import os
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo

from fem.parameters import Materials, Shock
from meshing.parameters import Board, Package, Warpage
from particles.parameters import Solder
from workflow import fields
from workflow.problems import CaseError, Problem
from workflow.validation import translate

NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"


class Title(BaseModel):
    """Name and title of a case; the name is also that of its run folder."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Field(pattern=NAME)]
    title: str = ""


class Case(BaseModel):
    """Everything that a run depends on, in SI floats."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    case: Title
    package: Package
    board: Board
    warpage: Warpage = Warpage()
    solder: Solder
    materials: Materials = Materials()
    shock: Shock


def read_case(path: Path, overrides: Sequence[str] = (), oversubscribe: bool = False) -> Case:
    """Read and check a case file.

    Args:
        path: TOML file.
        overrides: "dotted.key=value" settings, applied over the file; values are TOML, quotes may be left out.
        oversubscribe: whether more MPI ranks than cores are welcome.

    Returns:
        The case, every value checked.

    Raises:
        CaseError: with all problems found: syntax, names, units, ranges, and geometry that cannot be.
    """
    problems: list[Problem] = []
    table = _read_toml(path)
    overridden = _apply(table, overrides, problems)
    values = fields.to_si_table(Case, table, "", problems)
    case = None
    try:
        case = Case.model_validate(values, strict=True)
    except ValidationError as error:
        problems += translate(Case, error, table, {problem.key for problem in problems})
    if case is not None and not problems:
        problems = impossible(case) + too_many_ranks(case, oversubscribe)
    if case is None or problems:
        raise CaseError(str(path), problems, overridden)
    return case


def display_values(case: Case) -> dict[str, str]:
    """Return every resolved parameter as dotted key -> text in the user's unit."""
    return {key: fields.display(value, field) for key, value, field in fields.leaves(case)}


def impossible(case: Case) -> list[Problem]:
    """Find parameters that are each allowed, but that make no possible package, joint or board together."""
    from meshing import checks as meshing_checks
    from meshing.pads import pad_table
    from particles import checks as particles_checks
    from workflow.reflow_pool import joint_geometries

    contradictions = meshing_checks.problems(case.package, case.board, case.warpage)
    if contradictions:
        known = {key: field for key, _, field in fields.leaves(case)}
        return [
            Problem(found.key, found.message, _shown(found.value, known.get(found.key)), found.allowed)
            for found in contradictions
        ]
    geometries = joint_geometries(pad_table(case.package, case.board, case.warpage))
    impossible_joints = particles_checks.problems(case.solder, geometries, case.package.pitch)
    return [Problem(found.key, found.message, found.value, found.allowed) for found in impossible_joints]


def too_many_ranks(case: Case, oversubscribe: bool) -> list[Problem]:
    """Find out whether the shock asks for more MPI ranks than there are cores."""
    ranks, cores = case.shock.ranks.macro + case.shock.ranks.meso, available_cores()
    if oversubscribe or ranks <= cores:
        return []
    message = f"macro and meso ask for {ranks} MPI ranks, this machine offers {cores} cores"
    return [Problem("shock.ranks", message, ranks, f"<= {cores} in all, or more with --oversubscribe")]


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0))


def _shown(value: object, field: FieldInfo | None) -> object:
    """Write an SI value as its field is shown to users."""
    return fields.display(value, field) if field is not None and fields.unit_of(field) else value


def _read_toml(path: Path) -> dict:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise CaseError(str(path), [Problem("", "no such case file")]) from error
    except (OSError, UnicodeDecodeError) as error:
        raise CaseError(str(path), [Problem("", f"cannot be read: {error}")]) from error
    except tomllib.TOMLDecodeError as error:
        raise CaseError(str(path), [Problem("", f"is not TOML: {error}")]) from error


def _apply(table: dict, overrides: Sequence[str], problems: list[Problem]) -> list[str]:
    """Write overrides into a table; return their keys."""
    keys = []
    for override in overrides:
        key, equals, text = override.partition("=")
        key = key.strip()
        keys.append(key)
        if not equals or not all(key.split(".")):
            problems.append(Problem(key, "is no setting", override, "--set dotted.key=value"))
        elif not _set(table, key.split("."), _override_value(text.strip())):
            problems.append(Problem(key, "lies below a value, not a table", text))
    return keys


def _override_value(text: str) -> object:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _set(table: dict, path: list[str], value: object) -> bool:
    for name in path[:-1]:
        table = table.setdefault(name, {})
        if not isinstance(table, dict):
            return False
    table[path[-1]] = value
    return True
