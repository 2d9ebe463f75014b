"""Points of a study read and checked; the case of a run folder read back."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.kinds import kind_named_in
from reflowshock.workflow.pipeline.reader import SETTING, read_case
from reflowshock.workflow.store.keys import digest_of
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import SEAL
from reflowshock.workflow.store.store import CASE


class PointsError(CaseError):
    """Points that must not run, each with everything that is wrong with it."""

    def __init__(self, source: str, impossible: Mapping[int, CaseError], settings: Sequence[Mapping[str, str]]) -> None:
        """Take the file, what is wrong with a point, by its place in the list, and the settings of all."""
        self.impossible = impossible
        self.settings = settings
        super().__init__(source, [problem for error in impossible.values() for problem in error.problems])

    def lines(self) -> list[str]:
        """One line a problem, with the first point that has it, and how many others have."""
        places: dict[str, list[int]] = {}
        for place, error in self.impossible.items():
            for line in error.lines():
                places.setdefault(line.removeprefix(f"{SETTING}: "), []).append(place)
        return [f"{self._told(those)}: {line}" for line, those in places.items()]

    def _told(self, places: Sequence[int]) -> str:
        others = f" and {len(places) - 1} more" if len(places) > 1 else ""
        return f"{self.source}: point {places[0] + 1} ({settings_text(self.settings[places[0]])}){others}"


def read_possible_points(
    case: Path, settings: Sequence[Mapping[str, str]], oversubscribe: bool = False, force: bool = False
) -> tuple[list[Point], dict[int, CaseError]]:
    """Read and check a case with several settings.

    Args:
        case: TOML file.
        settings: of each point, dotted key -> value, as text for ``--set``.
        oversubscribe: whether more MPI ranks than cores are welcome.
        force: whether values that are not plausible are welcome.

    Returns:
        The points that can be, and what is wrong with the others, by place in the list.
    """
    points: list[Point] = []
    impossible: dict[int, CaseError] = {}
    for place, chosen in enumerate(settings):
        try:
            points.append(Point(chosen, read_case(case, overrides(chosen), oversubscribe, force)))
        except CaseError as error:
            impossible[place] = error
    return points, impossible


def overrides(settings: Mapping[str, str]) -> list[str]:
    """Write settings as ``--set`` takes them."""
    return [f"{key}={value}" for key, value in settings.items()]


def settings_text(settings: Mapping[str, str]) -> str:
    """Write settings for a reader."""
    return ", ".join(f"{key} = {value}" for key, value in settings.items()) or "the case as it is"


def read_case_of_run(folder: Path) -> Case:
    """Return the case of a run folder.

    Raises:
        CaseError: there is none, or it is damaged.
    """
    path = folder / CASE
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        if table.pop(SEAL) != digest_of(table):
            raise ValueError(SEAL)
        return kind_named_in(table).case.model_validate(table)
    except FileNotFoundError as error:
        raise CaseError(str(folder), [Problem("", "is not a run folder")]) from error
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        message = "was changed since it was written; `reflowshock run` with the case file writes it again"
        raise CaseError(str(path), [Problem("", message)]) from error
