"""Reading the points of a study, and the case of a run folder."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.kinds import kind_named_in
from reflowshock.workflow.pipeline.reader import SETTING, read_case
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import CASE, CASE_CHANGED, read_case_table


class PointsError(CaseError):
    """Invalid points of a study, each with all its problems."""

    def __init__(self, source: str, impossible: Mapping[int, CaseError], settings: Sequence[Mapping[str, str]]) -> None:
        """Store the file, the errors by index of the point, and the settings of all points."""
        self.impossible = impossible
        self.settings = settings
        super().__init__(source, [problem for error in impossible.values() for problem in error.problems])

    def lines(self) -> list[str]:
        """Return one line per problem with its first point and the number of further points."""
        numbers: dict[str, list[int]] = {}
        for number, error in self.impossible.items():
            for line in error.lines():
                numbers.setdefault(line.removeprefix(f"{SETTING}: "), []).append(number)
        return [f"{self._location(numbers_of_line)}: {line}" for line, numbers_of_line in numbers.items()]

    def _location(self, numbers: Sequence[int]) -> str:
        others = f" and {len(numbers) - 1} more" if len(numbers) > 1 else ""
        return f"{self.source}: point {numbers[0] + 1} ({settings_text(self.settings[numbers[0]])}){others}"


def read_possible_points(
    case: Path, settings: Sequence[Mapping[str, str]], oversubscribe: bool = False, force: bool = False
) -> tuple[list[Point], dict[int, CaseError]]:
    """Read and check a case with several settings.

    Args:
        case: TOML file.
        settings: For each point, values as text by dotted key.
        oversubscribe: Whether more MPI ranks than cores are allowed.
        force: Whether implausible values are allowed.

    Returns:
        The valid points, and the errors of the others by index in ``settings``.
    """
    points: list[Point] = []
    impossible: dict[int, CaseError] = {}
    for number, values in enumerate(settings):
        try:
            points.append(Point(values, read_case(case, overrides(values), oversubscribe, force)))
        except CaseError as error:
            impossible[number] = error
    return points, impossible


def overrides(settings: Mapping[str, str]) -> list[str]:
    """Return settings as ``--set`` arguments, "key=value" each.

    Args:
        settings: Dotted key -> value as text.
    """
    return [f"{key}={value}" for key, value in settings.items()]


def settings_text(settings: Mapping[str, str]) -> str:
    """Return settings as readable text, "key = value" separated by commas.

    Args:
        settings: Dotted key -> value as text; empty for the case as it is.
    """
    return ", ".join(f"{key} = {value}" for key, value in settings.items()) or "the case as it is"


def read_case_of_run(folder: Path) -> Case:
    """Return the case of a run folder, from the file in its store.

    Args:
        folder: Run folder.

    Raises:
        CaseError: The folder is not a run folder, or its case is damaged.
    """
    table = read_case_table(folder)
    try:
        return kind_named_in(table).case.model_validate(table)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise CaseError(str(folder / CASE), [Problem("", CASE_CHANGED)]) from error
