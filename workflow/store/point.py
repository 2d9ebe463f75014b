"""A point: a case file with settings, known by what all its stages depend on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from reflowshock.workflow.case.kind import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import SETTING, read_case
from reflowshock.workflow.store.keys import product_keys


@dataclass(frozen=True, slots=True)
class Point:
    """A case with settings.

    Attributes:
        settings: dotted key -> value, as text for ``--set``.
        case: the resolved case.
        digests: stage -> key of its product.
    """

    settings: Mapping[str, str]
    case: Case
    digests: Mapping[str, str] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "digests", product_keys(self.case))

    @property
    def key(self) -> str:
        """The digest of its last stage, the report, which follows all others."""
        return self.digests[self.case.pipeline.names[-1]]


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
        return f"{self.source}: point {places[0] + 1} ({told(self.settings[places[0]])}){others}"


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


def told(settings: Mapping[str, str]) -> str:
    """Write settings for a reader."""
    return ", ".join(f"{key} = {value}" for key, value in settings.items()) or "the case as it is"
