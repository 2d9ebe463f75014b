"""A study file: which case, at which settings, ranked by what."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from reflowshock.parameters import Parameters
from reflowshock.problem import Problem
from reflowshock.workflow.case.names import Name
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.scales import dotted, is_key
from reflowshock.workflow.case.toml_file import parse_toml, read_text
from reflowshock.workflow.case.toml_places import Places
from reflowshock.workflow.case.validation import translate
from reflowshock.workflow.kinds import NAMES
from reflowshock.workflow.study.designs import (
    MOST_POINTS,
    Design,
    Hypercube,
    TooManyPoints,
    as_text,
    grid_axes,
    list_axis,
    sampled,
)

DESIGNS = "at least one of [grid], [[list]], [latin_hypercube]"


class StudyTable(Parameters):
    """What the table ``[study]`` says: the case, relative to the file, and what is made of the results."""

    name: Name
    title: str = ""
    case: str
    scale: Name | None = None
    rank_by: str
    goal: Literal["minimise", "maximise"] = "minimise"
    metrics: tuple[str, ...] = ()
    skip_impossible: bool = False


class LatinHypercubeTable(Parameters):
    """A Latin hypercube: each parameter once in each of ``samples`` equal parts of its range."""

    samples: int = Field(ge=1, le=10000)
    seed: int = Field(0, ge=0)
    ranges: dict[str, Any]


class StudyFile(Parameters):
    """The tables of a study file."""

    study: StudyTable
    settings: dict[str, Any] = Field(default_factory=dict)
    grid: dict[str, Any] = Field(default_factory=dict)
    list: tuple[dict[str, Any], ...] = ()
    latin_hypercube: LatinHypercubeTable | None = None


@dataclass(frozen=True, slots=True)
class Study:
    """A study.

    Attributes:
        about: name, title, metrics.
        case: the case file.
        settings: of all points, dotted key -> text.
        design: what varies.
    """

    about: StudyTable
    case: Path
    settings: Mapping[str, str]
    design: Design

    @property
    def metrics(self) -> tuple[str, ...]:
        """The metrics that are plotted: first the one that points are ranked by."""
        return tuple(dict.fromkeys((self.about.rank_by, *self.about.metrics)))

    @property
    def points(self) -> list[dict[str, str]]:
        """Settings of every point."""
        return [{**self.settings, **chosen} for chosen in self.design.points]


def read_study(path: Path) -> Study:
    """Read and check a study file; its case is read with its points.

    Raises:
        CaseError: with all problems found.
    """
    text = read_text(path)
    try:
        return _study(path, parse_toml(str(path), text))
    except CaseError as error:
        raise error.located(Places(text)) from error


def _study(path: Path, table: dict) -> Study:
    """Return the study of a table; errors as ``read_study``, without their places."""
    if "study" not in table and any(kind in table for kind in NAMES):
        raise CaseError(str(path), [Problem("", "is a case, not a study; use reflowshock plan or run")])
    values = table | ({"list": tuple(table["list"])} if isinstance(table.get("list"), list) else {})
    if isinstance(given := table.get("study"), dict) and isinstance(given.get("metrics"), list):
        values["study"] = given | {"metrics": tuple(given["metrics"])}
    try:
        file = StudyFile.model_validate(values, strict=True)
    except ValidationError as error:
        raise CaseError(str(path), translate(StudyFile, error, table, set())) from None
    problems: list[Problem] = []
    design = _design(file, problems)
    settings = {key: as_text(value) for key, value in dotted(file.settings)}
    settings |= {"scale": file.study.scale} if file.study.scale else {}
    varied = {key for point in design.points for key in point}
    problems += [
        Problem(key, "is both fixed and varied", settings[key], "either [settings] or a design")
        for key in sorted(settings.keys() & varied)
    ]
    problems += [
        Problem(key, "is not a dotted key", None, "the key of a case, e.g. package.pitch")
        for key in sorted(settings.keys() | varied)
        if not is_key(key)
    ]
    if problems:
        raise CaseError(str(path), problems)
    return Study(file.study, path.parent / file.study.case, settings, design)


def _design(file: StudyFile, problems: list[Problem]) -> Design:
    """Every combination of the grid with every row of the list and every sample."""
    axes = list(grid_axes(dict(dotted(file.grid)), problems))
    if file.list:
        axes.append(list_axis([dict(dotted(row)) for row in file.list], problems))
    if file.latin_hypercube is not None:
        cube = file.latin_hypercube
        axes.append(sampled(dict(dotted(cube.ranges)), Hypercube(cube.samples, cube.seed), problems))
    try:
        design = Design.of(*axes)
    except TooManyPoints as error:
        problems.append(Problem("", str(error), None, f"up to {MOST_POINTS}"))
        return Design()
    problems += [
        Problem(key, "is given twice", None, "one place in [grid], [[list]] or ranges")
        for key, count in Counter(key for axis in axes for key in axis.given).items()
        if count > 1
    ]
    if not design.factors and not problems:
        problems.append(Problem("", "varies nothing", None, DESIGNS))
    return design
