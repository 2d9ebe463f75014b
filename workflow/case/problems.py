"""Input errors of a case: file, line, key, value, problem and allowed values."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from reflowshock.problem import Problem, one_line
from reflowshock.workflow.case.toml_places import Place

MOST_SHOWN = 30  # problems of one file
Places = Callable[[str], Place | None]


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a value is from that stands elsewhere than under its key.

    Attributes:
        label: in words: an option, or a table of the file.
        key: under which the file has it; empty where it is not from the file.
    """

    label: str
    key: str = ""


class CaseError(ValueError):
    """A case that must not run, with everything that is wrong with it."""

    def __init__(
        self, source: str, problems: Sequence[Problem], origins: Mapping[str, Origin] = MappingProxyType({})
    ) -> None:
        """Take what is wrong, the file, and where keys were given that were not given there."""
        self.source = source
        self.problems = list(problems)
        self.origins = origins
        super().__init__("\n".join(self.lines()))

    def lines(self) -> list[str]:
        """One line a problem, each beginning with where the value was given; the first of many, and how many more."""
        lines = [f"{self._place(problem)}: {problem}" for problem in self.problems[:MOST_SHOWN]]
        more = len(self.problems) - MOST_SHOWN
        return [*lines, f"{one_line(self.source)}: {more} more problems"] if more > 0 else lines

    def _place(self, problem: Problem) -> str:
        origin = self._origin(problem)
        file = f"{self.source}{problem.position}"
        place = file if origin is None else f"{file} {origin.label}" if origin.key else origin.label
        return one_line(place)

    def _origin(self, problem: Problem) -> Origin | None:
        """Return where the key of a problem, or one below or above it, was given; None if in the file under it."""
        own = f"{problem.key}."
        found = [
            origin for key, origin in self.origins.items() if f"{key}.".startswith(own) or own.startswith(f"{key}.")
        ]
        return found[-1] if found else None

    def located(self, places: Places) -> "CaseError":
        """Return the same with the line and column of each key that the file itself gives.

        Args:
            places: from a dotted key to its place in the file.
        """
        return CaseError(self.source, [self._located(problem, places) for problem in self.problems], self.origins)

    def _located(self, problem: Problem, places: Places) -> Problem:
        origin = self._origin(problem)
        key = problem.key if origin is None else origin.key
        place = places(key) if key and problem.line is None else None
        return problem if place is None else replace(problem, line=place.line, column=place.column)
