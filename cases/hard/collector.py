"""Pytest collector of hard cases: each combination of varied values is a test, its bounds are the assertions.

Without options the first combination of each file runs, and no random case; files marked long run with -m long.
"""

from collections.abc import Iterator
from pathlib import Path

import pytest

from reflowshock.cases.hard.hard_case import HardCase, read_hard_cases
from reflowshock.cases.hard.random_cases import LONGEST_SEARCH, RandomFile, read_random_file
from reflowshock.cases.hard.verdict import attempt
from reflowshock.workflow.case.problems import CaseError

HARD = Path(__file__).resolve().parent


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options of hard cases."""
    group = parser.getgroup("hard cases")
    group.addoption("--every-combination", action="store_true", help="try all values that hard cases vary")
    group.addoption("--random-seed", type=int, default=1, help="of random hard cases")
    group.addoption("--random-cases", action="append", metavar="NAME=COUNT", default=[], help="of a random file")
    group.addoption("--simplify", action="append", metavar="NAME=NUMBER", default=[], help="of a random case instead")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> "HardFile | None":
    """Collect the files of the program and explicitly named files."""
    is_hard = file_path.resolve().parent == HARD or parent.session.isinitpath(file_path)
    return HardFile.from_parent(parent, path=file_path) if is_hard and file_path.suffix == ".toml" else None


class HardFile(pytest.File):
    """A file of hard cases."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield the cases, or the search for a simpler one."""
        try:
            random = read_random_file(self.path)
            if random is None:
                cases = read_hard_cases(self.path)
                yield from map(self._item, cases if self.config.getoption("every_combination", False) else cases[:1])
            else:
                yield from self._random_items(random)
        except CaseError as error:
            raise self.CollectError(str(error)) from error

    def _random_items(self, file: RandomFile) -> Iterator[pytest.Item]:
        count, number = (self._number(option) for option in ("random_cases", "simplify"))
        if number is not None and count is not None:
            yield Search.from_parent(self, name="simplest", file=file, drawn=(count, number))
        elif count is not None:
            yield from map(self._item, file.cases(count, self.config.getoption("random_seed")))

    def _item(self, case: HardCase) -> "HardItem":
        return HardItem.from_parent(self, name=case.tried or case.name, case=case)

    def _number(self, option: str) -> int | None:
        numbers = dict(text.split("=") for text in self.config.getoption(option, []))
        return int(numbers[self.path.stem]) if self.path.stem in numbers else None


class MissError(Exception):
    """A hard case that missed its bounds."""


class HardItem(pytest.Item):
    """Hard case as a test; its report has the verdict as property "verdict"."""

    def __init__(self, *, case: HardCase, **others) -> None:
        """Set the time limit of the case."""
        super().__init__(**others)
        self.case = case
        self.add_marker(pytest.mark.timeout(case.deadline, method="thread"))
        if case.long and not self.config.getoption("every_combination", False):
            self.add_marker(pytest.mark.long)

    def runtest(self) -> None:
        """Run the case."""
        verdict = attempt(self.case)
        self.user_properties.append(("verdict", verdict.record()))
        if not verdict.ok:
            raise MissError(verdict)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style=None):
        """Return the verdict of a miss."""
        return str(excinfo.value) if isinstance(excinfo.value, MissError) else super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, None, str]:
        """Return file and name of the case."""
        return self.path, None, f"{self.path.stem} ({self.name})"


class Search(pytest.Item):
    """Search for the simplest random case that misses; its report has the table as property "simplest"."""

    def __init__(self, *, file: RandomFile, drawn: tuple[int, int], **others) -> None:
        """Store the number of drawn cases and the number of the missed one."""
        super().__init__(**others)
        self.file, self.drawn = file, drawn
        self.add_marker(pytest.mark.timeout(3.0 * LONGEST_SEARCH, method="thread"))

    def runtest(self) -> None:
        """Run the search."""
        count, number = self.drawn
        table = self.file.simplest(count, self.config.getoption("random_seed"), number)
        self.user_properties.append(("simplest", table))
