"""Pytest session that runs hard cases in several worker processes and replaces workers that hang or crash.

It ignores the user's pytest configuration.
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
# Workers have one thread; the user's plugins and options of pytest are disabled.
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
        properties: Properties recorded by the test.
        seconds: Time since the start of the test [s].
        code: Exit code of its worker; None if the worker goes on.
    """

    properties: Mapping[str, Any]
    seconds: float
    code: int | None


class Reports:
    """Pytest plugin that receives test reports in place of the terminal.

    SIGINT is blocked while workers start: they inherit this and are never interrupted themselves.
    """

    def __init__(self, take: Callable[[str, Report], None]) -> None:
        """Store the function that receives the name and report of each test."""
        self._take = take
        self._since: dict[str, float] = {}
        self._code: int | None = None
        self.broken = ""

    @pytest.hookimpl(trylast=True)
    def pytest_configure(self, config: pytest.Config) -> None:
        """Silence the terminal."""
        config.pluginmanager.unregister(name="terminalreporter")

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Note that a worker cannot read the cases."""
        if report.failed:
            self.broken = str(report.longrepr)

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Note the start time of a test."""
        self._since[nodeid] = time.monotonic()

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_setupnodes(self) -> None:
        """Block SIGINT before workers start."""
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodeready(self) -> None:
        """Unblock SIGINT after workers have started."""
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any, error: object) -> None:
        """Note the exit code of a crashed worker, which precedes the report of its test; another worker will start."""
        if error:
            self._code = node.gateway._io.wait()
            self.pytest_xdist_setupnodes()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Pass on the report of a completed test or crashed worker (which xdist reports without a phase)."""
        if report.when in ("setup", "teardown") and report.passed:
            return
        seconds = time.monotonic() - self._since[report.nodeid]
        properties = dict(report.user_properties)
        self._take(report.nodeid, Report(properties, seconds, None if properties else self._code))


@dataclass(frozen=True, slots=True)
class Session:
    """Settings of a pytest session for hard cases.

    Attributes:
        cores: Number of workers.
        seed: Seed of the random cases.
        counts: Numbers of random cases by file name.
    """

    cores: int
    seed: int
    counts: Mapping[str, int]

    def attempt(self, cases: Mapping[Path, Sequence[HardCase]], report_verdict: Callable[[Verdict], None]) -> None:
        """Run the cases of files and report each verdict as soon as it is available."""
        waiting = {_node_id(path, case.tried or case.name): case for path, group in cases.items() for case in group}

        def take(name: str, report: Report) -> None:
            case, content = waiting.pop(name), report.properties.get("verdict")
            report_verdict(_lost(case, report) if content is None else Verdict.of(case, content))

        code = self._pytest(cases, ["--every-combination"], take)
        for case in waiting.values():
            report_verdict(Verdict(case, (), f"did not run: pytest ended with code {code}"))

    def simplest(self, missed: Mapping[Path, int]) -> dict[str, dict[str, Any]]:
        """Search for the simplest counterexample of random files.

        Args:
            missed: Number of a missed case, by file.

        Returns:
            Table of parameters by file name, without files whose search was interrupted.
        """
        tables: dict[str, dict[str, Any]] = {}

        def take(name: str, report: Report) -> None:
            if "simplest" in report.properties:
                tables[Path(name.partition("::")[0]).stem] = report.properties["simplest"]

        self._pytest(missed, [f"--simplify={path.stem}={number}" for path, number in missed.items()], take)
        return tables

    def _pytest(
        self, files: Mapping[Path, Any], options: Sequence[str], take: Callable[[str, Report], None]
    ) -> pytest.ExitCode | int:
        """Run pytest without the user's configuration and return its exit code.

        Raises:
            KeyboardInterrupt: The session was interrupted.
            RuntimeError: A worker could not read the cases.
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
    """Return the pytest node id of a test, relative to the root of the file system."""
    return f"{path.resolve()}::{name}".removeprefix("/")


def _lost(case: HardCase, report: Report) -> Verdict:
    """Return the verdict on a case whose worker has ended."""
    hangs = report.seconds > 0.95 * case.deadline
    message = (
        f"no answer in {case.deadline:g} s: assumed to hang" if hangs else f"the process ended with code {report.code}"
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
