"""What is wrong with a case: records that name the place, the key, the value and what is allowed."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from reflowshock.workflow.case.toml_places import Place

if TYPE_CHECKING:
    from reflowshock.particles.parameters.checks import Problem as ParticlesProblem

LONGEST = 120  # characters of a value or key in a message
MOST_SHOWN = 30  # problems of one file
Places = Callable[[str], Place | None]


@dataclass(frozen=True, slots=True)
class Problem:
    """One mistake in a case file or on the command line.

    Attributes:
        key: dotted key, e.g. "package.pitch"; empty where the file as a whole is meant.
        message: what is wrong.
        value: the value as the user wrote it; None where a value is missing.
        allowed: allowed range or dimension, or empty.
        hint: the nearest valid name, or empty.
        line: where the key stands in its file, from 1 on; None where it is not known.
        column: the same in the line.
    """

    key: str
    message: str
    value: object = None
    allowed: str = ""
    hint: str = ""
    line: int | None = None
    column: int | None = None

    def __str__(self) -> str:
        key = shortened(self.key)
        place = key if self.value is None else f"{key} = {shortened(as_toml(self.value))}"
        parts = [": ".join(part for part in (place, self.message) if part)]
        if self.allowed:
            parts.append(f"allowed: {self.allowed}")
        if self.hint:
            parts.append(f"did you mean {self.hint}?")
        return one_line("; ".join(parts))

    @property
    def position(self) -> str:
        """Return ":line:column", as editors read it; empty where it is not known."""
        return "" if self.line is None else f":{self.line}:{self.column or 1}"


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


def as_toml(value: object) -> str:
    """Write a value as a user wrote it in TOML; of a table only that it is one."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, dict):
        return "{ … }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(as_toml(item) for item in value) + "]"
    if isinstance(value, int) and value.bit_length() > 1000:  # Python refuses to write those of thousands of digits
        return f"{'-' if value < 0 else ''}{abs(value) >> (value.bit_length() - 30)}…"
    return str(value)


def shortened(text: str) -> str:
    """Cut a text that would fill the terminal."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"


def one_line(text: str) -> str:
    """Write characters that move the cursor, or that no terminal shows, as their escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def of_particles(found: "Sequence[ParticlesProblem]") -> list[Problem]:
    """Say what the checks of the particles found, in the words of a case file."""
    return [Problem(problem.key, problem.message, problem.value or None, problem.allowed) for problem in found]
