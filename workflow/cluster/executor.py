"""Where stages run: on this machine, or as jobs of a cluster; how Snakemake is told so, watched and ended."""

import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from workflow.case_kind import Case
from workflow.cluster.checks import check_slurm
from workflow.cluster.profile import Profile
from workflow.cluster.queue import NoAnswer, cancel, jobs_in
from workflow.cluster.resources import stage_resources
from workflow.launch import DIE_WITH_PARENT, LAUNCHER, end_group

SAID = "logs/snakemake.txt"  # what Snakemake says of its jobs, below its working folder
LONGEST_END = 70.0  # seconds that Snakemake has to cancel its jobs


class Executor(Protocol):
    """Where stages run, one of `Local`, `Slurm`."""

    @property
    def arguments(self) -> Sequence[str]:
        """Options of Snakemake."""

    @property
    def guard(self) -> Sequence[str]:
        """What stands before Snakemake, and ends it should this process be killed."""

    @property
    def environment(self) -> Mapping[str, str]:
        """Variables that stages see."""

    def resources(self, cases: Sequence[Case]) -> list[dict[str, dict[str, Any]]]:
        """Check that the cases can be run, and return what the job of each stage asks for; nothing where it is no job.

        Raises:
            CaseError: they cannot; nothing was started.
        """

    def output(self, folder: Path) -> Path | None:
        """Return the file that takes what Snakemake says; None: the terminal."""

    def left_over(self, folder: Path) -> list[str]:
        """Return the jobs of an earlier command that are still at work in a folder."""

    def end(self, process: subprocess.Popen, folder: Path) -> None:
        """End Snakemake, which works in a folder, and all that it started."""


@dataclass(frozen=True, slots=True)
class Local:
    """Stages run on this machine, as processes that end with the command; ``cores`` that they may use."""

    cores: int

    @property
    def arguments(self) -> Sequence[str]:
        """All that stages say goes to the terminal; Snakemake says nothing."""
        return ("--cores", str(self.cores), "--quiet", "all")

    guard = DIE_WITH_PARENT
    environment: Mapping[str, str] = {}

    def resources(self, cases: Sequence[Case]) -> list[dict[str, dict[str, Any]]]:
        """No stage is a job."""
        return [{} for _ in cases]

    def output(self, folder: Path) -> Path | None:
        """To the terminal."""
        return None

    def left_over(self, folder: Path) -> list[str]:
        """Nothing outlives a command."""
        return []

    def end(self, process: subprocess.Popen, folder: Path) -> None:
        """End the process group."""
        end_group(process)


@dataclass(frozen=True, slots=True)
class Slurm:
    """Stages are jobs of Slurm, submitted, watched and cancelled by Snakemake's own plugin.

    Attributes:
        profile: of the cluster.
        jobs: how many may be queued or at work at a time.
    """

    profile: Profile
    jobs: int

    @property
    def arguments(self) -> Sequence[str]:
        """What Snakemake says is kept: it knows of jobs that Slurm ended."""
        profile = str(self.profile.folder.resolve())
        jobs = ("--executor", "slurm", "--jobs", str(self.jobs), "--workflow-profile", profile)
        return (*jobs, "--nocolor", "--quiet", "progress", "host")

    @property
    def guard(self) -> Sequence[str]:
        """Interrupted, Snakemake cancels its jobs; it must hear that also in a script's background, where it is ignored."""
        return ("setpriv", "--pdeathsig", "INT", "env", "--default-signal=INT")

    @property
    def environment(self) -> Mapping[str, str]:
        """What starts MPI ranks in the jobs."""
        return {LAUNCHER: self.profile.launcher}

    def resources(self, cases: Sequence[Case]) -> list[dict[str, dict[str, Any]]]:
        """What ``plan`` foresees, with a margin."""
        cores = check_slurm(self.profile, cases).largest
        factor, launcher = self.profile.walltime_factor, self.profile.launcher
        return [
            {stage: wanted.of_rule(launcher) for stage, wanted in stage_resources(case, factor, cores).items()}
            for case in cases
        ]

    def output(self, folder: Path) -> Path | None:
        """To a file."""
        return folder / SAID

    def left_over(self, folder: Path) -> list[str]:
        """Those that Slurm knows; none where it does not answer."""
        with suppress(NoAnswer):
            return jobs_in(folder)
        return []

    def end(self, process: subprocess.Popen, folder: Path) -> None:
        """Interrupt Snakemake, which cancels its jobs at once, but may wait long before it ends; leave no job."""
        process.send_signal(signal.SIGINT)
        deadline = time.monotonic() + LONGEST_END
        while process.poll() is None and time.monotonic() < deadline and self.left_over(folder):
            time.sleep(1.0)
        end_group(process)
        cancel(self.left_over(folder))
