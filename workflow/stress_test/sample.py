"""A sample: the random cases of one file, their verdicts, and the simplest that misses as a file."""

from dataclasses import dataclass, field
from typing import Any

from reflowshock.cases.hard.hard_case import HardCase
from reflowshock.cases.hard.random_cases import RandomFile
from reflowshock.cases.hard.verdict import Check, Verdict

MOST_REFUSED = 0.2  # largest share of cases that may be refused in words instead of tried


@dataclass(slots=True)
class Sample:
    """Random cases that were tried.

    Attributes:
        file: what drew them.
        cases: in the order in which they were drawn.
        found: their verdicts, as they came.
        simplest: the simplest case that misses, as a file has it; None where all survived.
    """

    file: RandomFile
    cases: list[HardCase]
    found: list[Verdict] = field(default_factory=list)
    simplest: dict[str, Any] | None = None

    @property
    def name(self) -> str:
        """Name of the file."""
        return self.file.name

    @property
    def family(self) -> str:
        """Family of the cases."""
        return self.cases[0].family

    @property
    def verdicts(self) -> list[Verdict]:
        """The verdicts in the order in which the cases were drawn."""
        return sorted(self.found, key=lambda verdict: self.cases.index(verdict.case))

    @property
    def missed(self) -> list[Verdict]:
        """Those that did not survive."""
        return [verdict for verdict in self.verdicts if not verdict.ok]

    @property
    def refused(self) -> int:
        """How many were refused in words."""
        return sum(verdict.is_refused for verdict in self.found)

    @property
    def too_many_refused(self) -> bool:
        """Whether so many were refused that the sample says little."""
        return self.refused > MOST_REFUSED * len(self.found)

    @property
    def ok(self) -> bool:
        """Whether all survived, and enough were tried."""
        return not self.missed and not self.too_many_refused

    @property
    def closest(self) -> Check | None:
        """The check of all cases that was kept by the smallest factor."""
        checks = [verdict.closest for verdict in self.found if verdict.closest is not None]
        return min(checks, key=lambda check: check.rank, default=None)
