"""Study file: a case, its fixed and varied settings, and the metric that ranks the points."""

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
    sample_axis,
)

DESIGNS = "at least one of [grid], [[list]], [latin_hypercube]"


class StudyTable(Parameters):
    """Table ``[study]``: the case, relative to the study file, and the evaluation of the results."""

    name: Name
    title: str = ""
    case: str
    scale: Name | None = None
    rank_by: str
    goal: Literal["minimise", "maximise"] = "minimise"
    metrics: tuple[str, ...] = ()
    skip_impossible: bool = False


class LatinHypercubeTable(Parameters):
    """Table ``[latin_hypercube]``: each parameter has one sample in each of ``samples`` equal parts of its range."""

    samples: int = Field(ge=1, le=10000)
    seed: int = Field(0, ge=0)
    ranges: dict[str, Any]


class StudyFile(Parameters):
    """Tables of a study file."""

    study: StudyTable
    settings: dict[str, Any] = Field(default_factory=dict)
    grid: dict[str, Any] = Field(default_factory=dict)
    list: tuple[dict[str, Any], ...] = ()
    latin_hypercube: LatinHypercubeTable | None = None


@dataclass(frozen=True, slots=True)
class Study:
    """Parametric study.

    Attributes:
        about: Table ``[study]``: name, title, metrics.
        case: Case file.
        settings: Settings of all points, dotted key -> text.
        design: Varied settings.
    """

    about: StudyTable
    case: Path
    settings: Mapping[str, str]
    design: Design

    @property
    def metrics(self) -> tuple[str, ...]:
        """Metrics to plot; the first one ranks the points."""
        return tuple(dict.fromkeys((self.about.rank_by, *self.about.metrics)))

    @property
    def points(self) -> list[dict[str, str]]:
        """Settings of every point."""
        return [{**self.settings, **chosen} for chosen in self.design.points]


def read_study(path: Path) -> Study:
    """Read and check a study file (TOML), without its case.

    Args:
        path: Study file.

    Returns:
        Study with its case file, design (factors and settings of each point), metrics and goal.

    Raises:
        CaseError: The file is invalid; the error lists all problems.
    """
    text = read_text(path)
    try:
        return _study(path, parse_toml(str(path), text))
    except CaseError as error:
        raise error.located(Places(text)) from error


def _study(path: Path, table: dict) -> Study:
    """Return the study of a table; raise the errors of `read_study` without line numbers."""
    if "study" not in table and any(kind in table for kind in NAMES):
        raise CaseError(str(path), [Problem("", "is a case, not a study; use reflowshock plan or run")])
    values = table | ({"list": tuple(table["list"])} if isinstance(table.get("list"), list) else {})
    if isinstance(about := table.get("study"), dict) and isinstance(about.get("metrics"), list):
        values["study"] = about | {"metrics": tuple(about["metrics"])}
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
    """Return every combination of the grid, the rows of the list and the samples."""
    axes = list(grid_axes(dict(dotted(file.grid)), problems))
    if file.list:
        axes.append(list_axis([dict(dotted(row)) for row in file.list], problems))
    if file.latin_hypercube is not None:
        cube = file.latin_hypercube
        axes.append(sample_axis(dict(dotted(cube.ranges)), Hypercube(cube.samples, cube.seed), problems))
    try:
        design = Design.of(*axes)
    except TooManyPoints as error:
        problems.append(Problem("", str(error), None, f"up to {MOST_POINTS}"))
        return Design()
    problems += [
        Problem(key, "is given twice", None, "one place in [grid], [[list]] or ranges")
        for key, count in Counter(key for axis in axes for key in axis.point_keys).items()
        if count > 1
    ]
    if not design.factors and not problems:
        problems.append(Problem("", "varies nothing", None, DESIGNS))
    return design
