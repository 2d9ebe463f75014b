"""A sample: the random cases of one random trial, their verdicts, and the simplest that misses as a file."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from reflowshock.workflow.stress_test.families import random_trials
from reflowshock.workflow.stress_test.pool import Pool
from reflowshock.workflow.stress_test.random_cases import Simplifier, drawn, file_table, random_case, shares
from reflowshock.workflow.stress_test.random_trial import RandomTrial
from reflowshock.workflow.stress_test.verdict import Check, Verdict


@dataclass(frozen=True, slots=True)
class Sample:
    """Random cases that were tried.

    Attributes:
        trial: what was drawn.
        tables: parameters of each, as a file has them.
        verdicts: one a table.
        simplest: the simplest case that misses, as a file has it; None where all survived.
    """

    trial: RandomTrial
    tables: list[dict[str, Any]]
    verdicts: list[Verdict]
    simplest: dict[str, Any] | None

    @property
    def family(self) -> str:
        """Family of the trial."""
        return self.trial.name.split("_")[0]

    @property
    def missed(self) -> list[Verdict]:
        """Those that did not survive."""
        return [verdict for verdict in self.verdicts if not verdict.ok]

    @property
    def refused(self) -> int:
        """How many were refused in words."""
        return sum(verdict.is_refused for verdict in self.verdicts)

    @property
    def too_many_refused(self) -> bool:
        """Whether so many were refused that the sample says little."""
        return self.refused > self.trial.most_refused * len(self.verdicts)

    @property
    def ok(self) -> bool:
        """Whether all survived, and enough were tried."""
        return not self.missed and not self.too_many_refused

    @property
    def closest(self) -> Check | None:
        """The check of all cases that was kept by the smallest factor."""
        checks = [verdict.closest for verdict in self.verdicts if verdict.closest is not None]
        return min(checks, key=lambda check: check.rank, default=None)


def try_sample(family: str, count: int, seed: int, pool: Pool) -> Iterator[Sample]:
    """Try random cases of a family, one random trial after the other.

    Args:
        family: its name.
        count: of cases, over all its random trials.
        seed: from which they are drawn.
        pool: which tries.
    """
    for trial, own in shares(random_trials(family), count):
        tables = drawn(trial, own, seed)
        cases = [random_case(trial, table, number) for number, table in enumerate(tables)]
        by_name = {verdict.case.tried: verdict for verdict in pool.attempt(cases)}
        verdicts = [by_name[case.tried] for case in cases]
        simplest = None
        if any(not verdict.ok for verdict in verdicts):
            tried = list(zip(tables, verdicts, strict=True))
            first = next(table for table, verdict in tried if not verdict.ok)
            simplest = file_table(trial, Simplifier.of(trial, pool, tried).search(own, seed) or first)
        yield Sample(trial, tables, verdicts, simplest)
