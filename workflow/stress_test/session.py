"""A session of pytest that tries hard cases in several processes; one that hangs or dies is replaced.

It runs apart from what a user has configured for tests of his own.
"""

import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from reflowshock.cases.hard.hard_case import HardCase
from reflowshock.cases.hard.verdict import Verdict

PLUGINS = ("xdist.plugin", "pytest_timeout", "reflowshock.cases.hard.collector")
# A process has one thread; plugins and options that a user has for tests of his own are left out.
ENVIRONMENT = {
    "NUMBA_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "PYTEST_ADDOPTS": "",
    "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
}


@dataclass(frozen=True, slots=True)
class Report:
    """Outcome of a test.

    Attributes:
        properties: that it has recorded.
        seconds: since it began [s].
        code: with which its process ended; None where it goes on.
    """

    properties: Mapping[str, Any]
    seconds: float
    code: int | None


class Reports:
    """A plugin that takes what tests report in the place of pytest's terminal.

    While a process starts, an interrupt waits: the process inherits that, and is never interrupted itself.
    """

    def __init__(self, take: Callable[[str, Report], None]) -> None:
        """Keep to whom a test's name and report go."""
        self._take = take
        self._since: dict[str, float] = {}
        self._code: int | None = None
        self.broken = ""

    @pytest.hookimpl(trylast=True)
    def pytest_configure(self, config: pytest.Config) -> None:
        """Silence the terminal."""
        config.pluginmanager.unregister(name="terminalreporter")

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Take note that a process cannot read what this one could."""
        if report.failed:
            self.broken = str(report.longrepr)

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Take note that a test begins."""
        self._since[nodeid] = time.monotonic()

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_setupnodes(self) -> None:
        """Note that processes are about to start."""
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodeready(self) -> None:
        """They have started."""
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any, error: object) -> None:
        """Take note how a process broke off, which is known before the report of its test; another will start."""
        if error:
            self._code = node.gateway._io.wait()
            self.pytest_xdist_setupnodes()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Hand over what has ended: a call, or a process, of which xdist has a report without a phase."""
        if report.when in ("setup", "teardown") and report.passed:
            return
        seconds = time.monotonic() - self._since[report.nodeid]
        properties = dict(report.user_properties)
        self._take(report.nodeid, Report(properties, seconds, None if properties else self._code))


@dataclass(frozen=True, slots=True)
class Session:
    """How hard cases are tried.

    Attributes:
        cores: processes at a time.
        seed: of random cases.
        counts: of random cases, by the name of their file.
    """

    cores: int
    seed: int
    counts: Mapping[str, int]

    def attempt(self, cases: Mapping[Path, Sequence[HardCase]], tell: Callable[[Verdict], None]) -> None:
        """Try the cases of files, and tell their verdicts as they come."""
        waiting = {_node_id(path, case.tried or case.name): case for path, own in cases.items() for case in own}

        def take(name: str, report: Report) -> None:
            case, found = waiting.pop(name), report.properties.get("verdict")
            tell(_lost(case, report) if found is None else Verdict.of(case, found))

        code = self._pytest(cases, ["--every-combination"], take)
        for case in waiting.values():
            tell(Verdict(case, (), f"was not tried: pytest ended with code {code}"))

    def simplest(self, missed: Mapping[Path, int]) -> dict[str, dict[str, Any]]:
        """Search for the simplest case of random files that misses.

        Args:
            missed: number of a case that did, by file.

        Returns:
            Parameters as a file has them by the name of their file; none where the search broke off.
        """
        found: dict[str, dict[str, Any]] = {}

        def take(name: str, report: Report) -> None:
            if "simplest" in report.properties:
                found[Path(name.partition("::")[0]).stem] = report.properties["simplest"]

        self._pytest(missed, [f"--simplify={path.stem}={number}" for path, number in missed.items()], take)
        return found

    def _pytest(
        self, files: Mapping[Path, Any], options: Sequence[str], take: Callable[[str, Report], None]
    ) -> pytest.ExitCode | int:
        """Run pytest apart from what a user has configured for tests of his own; return its exit code.

        Raises:
            KeyboardInterrupt: it was interrupted.
            RuntimeError: a process could not read the cases.
        """
        arguments = ["-c", os.devnull, "--rootdir=/", "--noconftest", "-p", "no:cacheprovider"]
        arguments += [part for plugin in PLUGINS for part in ("-p", plugin)]
        arguments += [f"--numprocesses={self.cores}", "--max-worker-restart=1000000", f"--random-seed={self.seed}"]
        arguments += [f"--random-cases={name}={count}" for name, count in self.counts.items()]
        reports = Reports(take)
        with _environment():
            code = pytest.main([*arguments, *options, *(str(path.resolve()) for path in files)], plugins=[reports])
            reports.pytest_testnodeready()
        if reports.broken:
            raise RuntimeError(reports.broken)
        if code == pytest.ExitCode.INTERRUPTED:
            raise KeyboardInterrupt
        return code


def _node_id(path: Path, name: str) -> str:
    """Return the name of a test to pytest, whose root is that of all files."""
    return f"{path.resolve()}::{name}".removeprefix("/")


def _lost(case: HardCase, report: Report) -> Verdict:
    """Return the verdict on a case whose process has ended."""
    hangs = report.seconds > 0.95 * case.deadline
    message = (
        f"no answer in {case.deadline:g} s: taken to hang" if hangs else f"the process ended with code {report.code}"
    )
    return Verdict(case, (), message, seconds=report.seconds)


@contextmanager
def _environment() -> Iterator[None]:
    before = dict(os.environ)
    os.environ.update(ENVIRONMENT)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)
