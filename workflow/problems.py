"""What is wrong with a case: records that name the key, the value and what is allowed."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, slots=True)
class Problem:
    """One mistake in a case file or on the command line.

    Attributes:
        key: dotted key, e.g. "package.pitch"; empty where the file as a whole is meant.
        message: what is wrong.
        value: the value as the user wrote it; None where a value is missing.
        allowed: allowed range or dimension, or empty.
        hint: the nearest valid name, or empty.
    """

    key: str
    message: str
    value: object = None
    allowed: str = ""
    hint: str = ""

    def __str__(self) -> str:
        place = self.key if self.value is None else f"{self.key} = {as_toml(self.value)}"
        parts = [": ".join(part for part in (place, self.message) if part)]
        if self.allowed:
            parts.append(f"allowed: {self.allowed}")
        if self.hint:
            parts.append(f"did you mean {self.hint}?")
        return "; ".join(parts)


class CaseError(ValueError):
    """A case that must not run, with everything that is wrong with it."""

    def __init__(self, source: str, problems: list[Problem], origins: Mapping[str, str] = MappingProxyType({})) -> None:
        """Take what is wrong, the file, and where keys were given that were not given there."""
        self.source = source
        self.problems = problems
        self.origins = origins
        super().__init__("\n".join(self.lines()))

    def lines(self) -> list[str]:
        """One line a problem, each beginning with where the value was given."""
        return [f"{self._place(problem)}: {problem}" for problem in self.problems]

    def _place(self, problem: Problem) -> str:
        places = [place for key, place in self.origins.items() if f"{key}.".startswith(f"{problem.key}.")]
        return places[-1] if places else self.source


def as_toml(value: object) -> str:
    """Write a value as a user wrote it in TOML, shortened to fit a line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, dict):
        return "{ … }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(as_toml(item) for item in value) + "]"
    return str(value)
