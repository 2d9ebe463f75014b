"""A hard case: a TOML file, or each combination of the values that it varies, read and checked before any is run."""

import itertools
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from reflowshock.cases.hard.bound import Bound, read_bound
from reflowshock.cases.hard.trial import FAMILIES, Trial, trials
from reflowshock.names import nearest
from reflowshock.problem import Problem, as_toml
from reflowshock.quantity import Quantity
from reflowshock.units import UnitError
from reflowshock.workflow.case import fields
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.scales import dotted
from reflowshock.workflow.case.toml_file import read_toml
from reflowshock.workflow.case.validation import translate
from reflowshock.workflow.pipeline.reader import set_value

DEADLINE = 300.0
FREE_TABLES = ("parameters", "vary", "bounds")


class HardCaseFile(BaseModel):
    """A hard case as its file has it.

    ``parameters`` are those of the trial; ``vary`` gives lists of values for some of them; ``bounds`` are upper ones of
    absolute values, or lower ones with a sign: "> 0.2". ``expect`` is a part of the error with which the case must be
    refused. After the deadline a case is taken to hang. What is ``long`` is left out of `make test`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    family: str
    title: str
    why: str
    trial: str
    expect: str = ""
    deadline: Annotated[float, Quantity("s")] = Field(DEADLINE, gt=0)
    long: bool = False
    parameters: dict = {}
    vary: dict = {}
    bounds: dict = {}


@dataclass(frozen=True, slots=True)
class HardCase:
    """One case to try.

    Attributes:
        name: of its file, without suffix.
        tried: the varied values in words, "" where none is.
        family: one of `FAMILIES`.
        title: what is tried.
        why: what breaks others here.
        trial: what is done.
        given: parameters of the trial as a file has them.
        parameters: the same in SI values.
        bounds: that its measures must keep.
        expect: part of the error with which it must be refused, or "".
        deadline: after which it is taken to hang [s].
        long: whether `make test` leaves it to `make test-long`.
        may_be_refused: whether it is no miss if the trial refuses it in words.
    """

    name: str
    tried: str
    family: str
    title: str
    why: str
    trial: Trial
    table: dict[str, Any]
    parameters: BaseModel
    bounds: tuple[Bound, ...]
    expect: str
    deadline: float
    long: bool = False
    may_be_refused: bool = False


def read_hard_cases(path: Path) -> list[HardCase]:
    """Read the cases of a file.

    Raises:
        CaseError: with all problems found: syntax, unknown names, units, ranges.
    """
    return hard_cases(path.stem, read_toml(path), str(path), path.parent)


def hard_cases(name: str, table: Mapping[str, Any], source: str, folder: Path) -> list[HardCase]:
    """Make the cases of a table as a file has it.

    Args:
        name: of the case.
        table: of the file.
        source: where it is from, for errors.
        folder: that names of files in it are relative to.

    Raises: as `read_hard_cases`.
    """
    problems: list[Problem] = []
    head = _read_head(dict(table), source)
    trial = _trial_of(head, source)
    bounds = tuple(_bounds(head, trial, problems))
    cases = [
        HardCase(
            name=name,
            tried=tried,
            trial=trial,
            table=values,
            parameters=parameters,
            bounds=bounds,
            **head.model_dump(include={"family", "title", "why", "expect", "deadline", "long"}),
        )
        for tried, values in _combinations(head, problems)
        if (parameters := _parameters(trial, values, folder, problems)) is not None
    ]
    if problems:
        raise CaseError(source, list({problem.key: problem for problem in problems}.values()))
    return cases


def _read_head(table: dict, source: str) -> HardCaseFile:
    """Read all but what is in the tables of the trial."""
    problems: list[Problem] = []
    head_values = {name: value for name, value in table.items() if name not in FREE_TABLES}
    values = fields.to_si_table(HardCaseFile, head_values, "", problems) | {
        n: table[n] for n in FREE_TABLES if n in table
    }
    head = None
    try:
        head = HardCaseFile.model_validate(values, strict=True)
    except ValidationError as error:
        problems += translate(HardCaseFile, error, table, {problem.key for problem in problems})
    if head is not None and head.family not in FAMILIES:
        choice, hint = "one of " + ", ".join(FAMILIES), nearest(head.family, FAMILIES)
        problems.append(Problem("family", "unknown family", head.family, choice, hint))
    if head is None or problems:
        raise CaseError(source, problems)
    return head


def _trial_of(head: HardCaseFile, source: str) -> Trial:
    all_trials = trials()
    if head.trial not in all_trials:
        choice, hint = "one of " + ", ".join(all_trials), nearest(head.trial, all_trials)
        raise CaseError(source, [Problem("trial", "unknown trial", head.trial, choice, hint)])
    return all_trials[head.trial]


def _bounds(head: HardCaseFile, trial: Trial, problems: list[Problem]) -> Iterator[Bound]:
    """Yield the bounds; a measure may have several, as a list."""
    if not head.bounds and not head.expect:
        problems.append(Problem("bounds", "nothing is judged: give bounds, or expect", None))
    if head.bounds and head.expect:
        problems.append(Problem("bounds", "nothing is measured of a case that must be refused", None, "expect alone"))
    for measure, values in head.bounds.items():
        key, names = f"bounds.{measure}", trial.measures
        if names is not None and measure not in names:
            choice, hint = "one of " + ", ".join(names), nearest(measure, names)
            problems.append(Problem(key, f"the trial {head.trial} measures no such thing", values, choice, hint))
            continue
        texts = values if isinstance(values, list) else [values]
        if not texts:
            problems.append(Problem(key, "nothing is judged: give a bound, or a list of some", values))
        for text in texts:
            try:
                yield read_bound(measure, text, None if names is None else names[measure])
            except UnitError as error:
                problems.append(Problem(key, str(error), text))


def hard_case_text(table: Mapping[str, Any], prefix: str = "") -> str:
    """Write the table of a hard case as TOML: its values, then its tables."""
    values = [f"{name} = {as_toml(value)}\n" for name, value in table.items() if not isinstance(value, Mapping)]
    tables = [(f"{prefix}{name}", value) for name, value in table.items() if isinstance(value, Mapping)]
    return "".join(values) + "".join(f"\n[{name}]\n{hard_case_text(value, f'{name}.')}" for name, value in tables)


def _combinations(head: HardCaseFile, problems: list[Problem]) -> Iterator[tuple[str, dict]]:
    """Yield each combination of the varied values: in words, and the parameters with them."""
    varied: dict[str, list] = {}
    for key, values in dotted(head.vary):
        if not isinstance(values, list) or not values:
            problems.append(Problem(f"vary.{key}", "must be a list with at least one value", values))
            return
        varied[key] = values
    for choice in itertools.product(*varied.values()):
        table = deepcopy(head.parameters)
        for key, value in zip(varied, choice, strict=True):
            if not set_value(table, key.split("."), value):
                problems.append(
                    Problem(f"vary.{key}", "cannot be set: the key above it has a value, not a table", value)
                )
                return
        words = (f"{key.split('.')[-1].replace('_', ' ')} {value}" for key, value in zip(varied, choice, strict=True))
        yield ", ".join(words), table


def _parameters(trial: Trial, table: dict, folder: Path, problems: list[Problem]) -> BaseModel | None:
    """Convert and check the parameters of a trial; None, and problems added, where that cannot be."""
    found_problems: list[Problem] = []
    values = trial.located(fields.to_si_table(trial.parameters, table, "", found_problems), folder)
    parameters = None
    try:
        parameters = trial.parameters.model_validate(values, strict=True)
    except ValidationError as error:
        found_problems += translate(trial.parameters, error, table, {problem.key for problem in found_problems})
    problems += [replace(problem, key=f"parameters.{problem.key}".rstrip(".")) for problem in found_problems]
    return None if found_problems else parameters
