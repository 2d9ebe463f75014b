"""Hard cases: TOML files, with one case for each combination of varied values, validated before any runs."""

import itertools
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from reflowshock.cases.hard.bound import Bound, read_bound
from reflowshock.cases.hard.trial import FAMILIES, Trial, trials
from reflowshock.names import find_nearest
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
    """Content of a hard case file.

    ``parameters`` belong to the trial; ``vary`` lists values of some of them; ``bounds`` are upper bounds on absolute
    values or, with a sign such as "> 0.2", lower bounds. ``expect`` is a part of the error with which the case must be
    refused. After the deadline a case counts as hanging. ``long`` cases run in ``make test-long`` only.
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
    """One hard case.

    Attributes:
        name: Name of the file without suffix.
        tried: Varied values as text; empty without variation.
        family: One of ``FAMILIES``.
        title: Title of the case.
        why: Weakness of other solvers that the case tests.
        trial: Trial to run.
        table: Parameters of the trial as in the file.
        parameters: Parameters in SI values.
        bounds: Bounds on the measures.
        expect: Part of the error with which the case must be refused; empty if it must run.
        deadline: Time limit [s].
        long: Whether only ``make test-long`` runs the case.
        may_be_refused: Whether a refusal is not a miss.
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
        CaseError: With all problems of the file: syntax, unknown names, units, ranges.
    """
    return hard_cases(path.stem, read_toml(path), str(path), path.parent)


def hard_cases(name: str, table: Mapping[str, Any], source: str, folder: Path) -> list[HardCase]:
    """Return the cases of the table of a file.

    Args:
        name: Name of the case.
        table: Content of the file.
        source: Source named in errors.
        folder: Base folder of file names in the table.

    Raises: as ``read_hard_cases``.
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
    """Validate the file except the tables of the trial."""
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
        choice, hint = "one of " + ", ".join(FAMILIES), find_nearest(head.family, FAMILIES)
        problems.append(Problem("family", "unknown family", head.family, choice, hint))
    if head is None or problems:
        raise CaseError(source, problems)
    return head


def _trial_of(head: HardCaseFile, source: str) -> Trial:
    all_trials = trials()
    if head.trial not in all_trials:
        choice, hint = "one of " + ", ".join(all_trials), find_nearest(head.trial, all_trials)
        raise CaseError(source, [Problem("trial", "unknown trial", head.trial, choice, hint)])
    return all_trials[head.trial]


def _bounds(head: HardCaseFile, trial: Trial, problems: list[Problem]) -> Iterator[Bound]:
    """Yield the bounds; a measure may have a list of bounds."""
    if not head.bounds and not head.expect:
        problems.append(Problem("bounds", "nothing is judged: give bounds, or expect", None))
    if head.bounds and head.expect:
        problems.append(Problem("bounds", "nothing is measured of a case that must be refused", None, "expect alone"))
    for measure, values in head.bounds.items():
        key, names = f"bounds.{measure}", trial.measures
        if names is not None and measure not in names:
            choice, hint = "one of " + ", ".join(names), find_nearest(measure, names)
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
    """Return the TOML text of a hard case: its values, then its tables."""
    values = [f"{name} = {as_toml(value)}\n" for name, value in table.items() if not isinstance(value, Mapping)]
    tables = [(f"{prefix}{name}", value) for name, value in table.items() if isinstance(value, Mapping)]
    return "".join(values) + "".join(f"\n[{name}]\n{hard_case_text(value, f'{name}.')}" for name, value in tables)


def _combinations(head: HardCaseFile, problems: list[Problem]) -> Iterator[tuple[str, dict]]:
    """Yield text and parameters of each combination of varied values."""
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
    """Validate and convert the parameters of a trial; add problems and return None if they are invalid."""
    found_problems: list[Problem] = []
    values = trial.located(fields.to_si_table(trial.parameters, table, "", found_problems), folder)
    parameters = None
    try:
        parameters = trial.parameters.model_validate(values, strict=True)
    except ValidationError as error:
        found_problems += translate(trial.parameters, error, table, {problem.key for problem in found_problems})
    problems += [replace(problem, key=f"parameters.{problem.key}".rstrip(".")) for problem in found_problems]
    return None if found_problems else parameters
