"""Random cases: drawn by hypothesis from a seed, tried like any other, and the first that misses made simple."""

import contextlib
import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import hypothesis
from hypothesis import HealthCheck, Phase, Verbosity

from reflowshock.workflow.stress_test.hard_case import HardCase, hard_cases
from reflowshock.workflow.stress_test.pool import Pool
from reflowshock.workflow.stress_test.random_trial import RandomTrial
from reflowshock.workflow.stress_test.verdict import Verdict

LONGEST_SEARCH = 120.0  # for a simpler case that misses, too [s]
LONGEST_TRY = "120 s"


class _Miss(Exception):
    """Tells hypothesis that a case misses."""


def drawn(trial: RandomTrial, count: int, seed: int) -> list[dict[str, Any]]:
    """Draw tables of parameters; the same for the same seed."""
    tables: list[dict[str, Any]] = []
    _visit(trial, count, seed, tables.append)
    return tables


def file_table(trial: RandomTrial, table: dict[str, Any]) -> dict[str, Any]:
    """Return a random case as a file of a hard case has it."""
    return {
        "family": trial.name.split("_")[0],
        "title": trial.title,
        "why": trial.why,
        "trial": trial.trial,
        "deadline": LONGEST_TRY,
        "parameters": table,
        "bounds": dict(trial.bounds),
    }


def random_case(trial: RandomTrial, table: dict[str, Any], number: int) -> HardCase:
    """Return a random case as it is tried.

    Raises:
        CaseError: what was drawn is out of the range of the parameters.
    """
    (case,) = hard_cases(trial.name, file_table(trial, table), f"random case {trial.name}", Path())
    return replace(case, tried=f"number {number}", may_be_refused=True)


@dataclass(slots=True)
class Simplifier:
    """Looks for the simplest case that misses, where one of those that were tried did.

    Attributes:
        trial: what is drawn.
        pool: which tries.
        known: whether a table survived, those that were tried already included.
        simplest: the last that missed.
    """

    trial: RandomTrial
    pool: Pool
    known: dict[str, bool] = field(default_factory=dict)
    simplest: dict[str, Any] | None = None
    end: float = 0.0

    @classmethod
    def of(cls, trial: RandomTrial, pool: Pool, tried: Sequence[tuple[dict[str, Any], Verdict]]) -> "Simplifier":
        """Start with what was tried."""
        return cls(trial, pool, {_key(table): verdict.ok for table, verdict in tried})

    def search(self, count: int, seed: int) -> dict[str, Any] | None:
        """Draw again as it was drawn, let hypothesis simplify the first miss, and return it."""
        self.end = time.monotonic() + LONGEST_SEARCH
        with contextlib.suppress(_Miss, hypothesis.errors.HypothesisException):
            _visit(self.trial, count, seed, self._judge)
        return self.simplest

    def _judge(self, table: dict[str, Any]) -> None:
        key = _key(table)
        if key not in self.known:
            self.known[key] = time.monotonic() > self.end or self._survives(table)
        if not self.known[key]:
            self.simplest = table
            raise _Miss

    def _survives(self, table: dict[str, Any]) -> bool:
        (verdict,) = self.pool.attempt([random_case(self.trial, table, 0)])
        return verdict.ok


def shares(trials: Sequence[RandomTrial], count: int) -> Iterator[tuple[RandomTrial, int]]:
    """Divide a number of cases among the random trials of a family by their shares."""
    whole, given, weight = sum(trial.share for trial in trials), 0, 0
    for trial in trials:
        weight += trial.share
        own = round(count * weight / whole) - given
        given += own
        if own:
            yield trial, own


def _visit(trial: RandomTrial, count: int, seed: int, visit: Callable[[dict[str, Any]], None]) -> None:
    """Draw tables and visit each; where a visit raises, hypothesis looks for a simpler table that does, too."""

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
    @hypothesis.given(trial.tables)
    def draw(table: dict[str, Any]) -> None:
        visit(table)

    draw()


def _key(table: dict[str, Any]) -> str:
    return json.dumps(table, sort_keys=True)
