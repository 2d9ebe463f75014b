"""Input errors of a case: file, line, key, value, problem and allowed values."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from reflowshock.problem import Problem, one_line
from reflowshock.workflow.case.toml_places import Place

MOST_SHOWN = 30  # printed problems of one file
Places = Callable[[str], Place | None]


@dataclass(frozen=True, slots=True)
class Origin:
    """Origin of a value that does not stand under its own key in the file.

    Attributes:
        label: Name of an option or of a table of the file.
        key: Key of the value in the file; empty for options.
    """

    label: str
    key: str = ""


class CaseError(ValueError):
    """Invalid case, with all problems found."""

    def __init__(
        self, source: str, problems: Sequence[Problem], origins: Mapping[str, Origin] = MappingProxyType({})
    ) -> None:
        """Store the file, the problems, and the origins of keys set elsewhere than in the file."""
        self.source = source
        self.problems = list(problems)
        self.origins = origins
        super().__init__("\n".join(self.lines()))

    def lines(self) -> list[str]:
        """Return one line per problem, starting with the origin of the value; at most ``MOST_SHOWN`` problems."""
        lines = [f"{self._place(problem)}: {problem}" for problem in self.problems[:MOST_SHOWN]]
        more = len(self.problems) - MOST_SHOWN
        return [*lines, f"{one_line(self.source)}: {more} more problems"] if more > 0 else lines

    def _place(self, problem: Problem) -> str:
        origin = self._origin(problem)
        file = f"{self.source}{problem.position}"
        location = file if origin is None else f"{file} {origin.label}" if origin.key else origin.label
        return one_line(location)

    def _origin(self, problem: Problem) -> Origin | None:
        """Return the origin of a problem's key, or of a key above or below it; None if it stands in the file."""
        prefix = f"{problem.key}."
        origins = [
            origin
            for key, origin in self.origins.items()
            if f"{key}.".startswith(prefix) or prefix.startswith(f"{key}.")
        ]
        return origins[-1] if origins else None

    def located(self, places: Places) -> "CaseError":
        """Return the same error with line and column of each key in the file.

        Args:
            places: Function from a dotted key to its position in the file.
        """
        return CaseError(self.source, [self._located(problem, places) for problem in self.problems], self.origins)

    def _located(self, problem: Problem, places: Places) -> Problem:
        origin = self._origin(problem)
        key = problem.key if origin is None else origin.key
        position = places(key) if key and problem.line is None else None
        return problem if position is None else replace(problem, line=position.line, column=position.column)
