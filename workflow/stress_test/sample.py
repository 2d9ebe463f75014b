"""Sample of random cases of one file with verdicts and simplest counterexample."""

from dataclasses import dataclass, field
from typing import Any

from reflowshock.cases.hard.hard_case import HardCase
from reflowshock.cases.hard.random_cases import RandomFile
from reflowshock.cases.hard.verdict import Check, Verdict

MOST_REFUSED = 0.2  # largest share of cases that may be refused with a message


@dataclass(slots=True)
class Sample:
    """Random cases of one file.

    Attributes:
        file: File that defines the distribution.
        cases: Cases in the order of drawing.
        completed: Verdicts in the order of completion.
        simplest: Simplest counterexample as the table of a file; None without one.
    """

    file: RandomFile
    cases: list[HardCase]
    completed: list[Verdict] = field(default_factory=list)
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
        """Verdicts in the order of the cases."""
        return sorted(self.completed, key=lambda verdict: self.cases.index(verdict.case))

    @property
    def missed(self) -> list[Verdict]:
        """Verdicts on cases outside their bounds."""
        return [verdict for verdict in self.verdicts if not verdict.ok]

    @property
    def refused(self) -> int:
        """Number of cases refused with a message."""
        return sum(verdict.is_refused for verdict in self.completed)

    @property
    def too_many_refused(self) -> bool:
        """Whether more than the share ``MOST_REFUSED`` was refused."""
        return self.refused > MOST_REFUSED * len(self.completed)

    @property
    def ok(self) -> bool:
        """Whether no case missed its bounds and not too many were refused."""
        return not self.missed and not self.too_many_refused

    @property
    def closest(self) -> Check | None:
        """Check with the smallest margin of all cases."""
        checks = [verdict.closest for verdict in self.completed if verdict.closest is not None]
        return min(checks, key=lambda check: check.rank, default=None)
