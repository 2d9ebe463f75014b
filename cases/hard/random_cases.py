"""Random cases: hypothesis draws parameters from a seed, and simplifies a case that misses."""

import contextlib
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import hypothesis
from hypothesis import HealthCheck, Phase, Verbosity

from reflowshock.cases.hard.draws import DRAWS
from reflowshock.cases.hard.hard_case import HardCase, hard_cases
from reflowshock.cases.hard.verdict import attempt
from reflowshock.names import find_nearest
from reflowshock.problem import Problem
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.toml_file import read_toml

LONGEST_SEARCH = 120.0  # time limit of the search for a simpler miss [s]


class _Miss(Exception):
    """Signal to hypothesis that a case misses."""


@dataclass(frozen=True, slots=True)
class RandomFile:
    """Hard case whose parameters are drawn.

    Attributes:
        path: File of the case.
        draws: Name of a strategy in ``DRAWS``.
        share: Relative number of cases within the family.
        table: Remaining content of the file.
    """

    path: Path
    draws: str
    share: int
    table: dict[str, Any]

    @property
    def name(self) -> str:
        """Name of the cases."""
        return self.path.stem

    def file_table(self, parameters: dict[str, Any]) -> dict[str, Any]:
        """Return a drawn case as the table of a separate file."""
        return self.table | {"parameters": parameters}

    def case(self, parameters: dict[str, Any], number: int) -> HardCase:
        """Return a drawn case.

        Raises:
            CaseError: If the drawn values are out of range.
        """
        (case,) = hard_cases(self.name, self.file_table(parameters), str(self.path), self.path.parent)
        return replace(case, tried=f"number {number}", may_be_refused=True)

    def cases(self, count: int, seed: int) -> list[HardCase]:
        """Draw cases, reproducibly for a seed."""
        tables: list[dict[str, Any]] = []
        self._visit(count, seed, tables.append)
        return [self.case(table, number) for number, table in enumerate(tables)]

    def simplest(self, count: int, seed: int, number: int) -> dict[str, Any]:
        """Draw again and let hypothesis simplify the parameters of a missed case while it still misses."""
        first, end = self.cases(count, seed)[number].table, time.monotonic() + LONGEST_SEARCH
        missed: list[dict[str, Any]] = []
        survived: dict[str, bool] = {str(first): False}

        def judge(table: dict[str, Any]) -> None:
            if not missed and table != first:
                return
            if str(table) not in survived:
                survived[str(table)] = time.monotonic() > end or attempt(self.case(table, number)).ok
            if not survived[str(table)]:
                missed.append(table)
                raise _Miss

        with contextlib.suppress(_Miss, hypothesis.errors.HypothesisException):
            self._visit(count, seed, judge)
        return missed[-1]

    def _visit(self, count: int, seed: int, visit: Callable[[dict[str, Any]], None]) -> None:
        """Draw tables and visit each; if a visit raises, hypothesis searches for a simpler table that also raises."""

        @hypothesis.settings(
            max_examples=count,
            database=None,
            deadline=None,
            phases=(Phase.generate, Phase.shrink),
            suppress_health_check=list(HealthCheck),
            report_multiple_bugs=False,
            verbosity=Verbosity.quiet,
        )
        @hypothesis.seed(seed)
        @hypothesis.given(DRAWS[self.draws])
        def draw(table: dict[str, Any]) -> None:
            visit(table)

        draw()


def read_random_file(path: Path) -> RandomFile | None:
    """Read a file of random cases; return None if its cases are fixed.

    Raises:
        CaseError: If it is not TOML or names an unknown strategy.
    """
    table = read_toml(path)
    draws, share = table.pop("draws", None), table.pop("share", 1)
    if draws is None:
        return None
    if draws not in DRAWS:
        choice, hint = "one of " + ", ".join(DRAWS), find_nearest(str(draws), DRAWS)
        raise CaseError(str(path), [Problem("draws", "unknown draw", draws, choice, hint)])
    return RandomFile(path, draws, share, table)


def shares(files: Sequence[RandomFile], count: int) -> Iterator[tuple[RandomFile, int]]:
    """Divide a number of cases among the random files of a family in proportion to their shares."""
    whole, assigned, weight = sum(file.share for file in files), 0, 0
    for file in files:
        weight += file.share
        cases_of_file = round(count * weight / whole) - assigned
        assigned += cases_of_file
        if cases_of_file:
            yield file, cases_of_file
