"""Where stages run: on this machine, or as jobs of a cluster; options of Snakemake for that, and how it is ended."""

import signal
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.jobs.checks import NoAnswer, cancel, check_slurm, jobs_in
from reflowshock.workflow.jobs.profile import Profile, read_profile
from reflowshock.workflow.pipeline.resources import MOST_CORES, stage_resources
from reflowshock.workflow.process.environment import available_cores
from reflowshock.workflow.process.launch import DIE_WITH_PARENT, LAUNCHER, end_group

LONGEST_END = 70.0  # seconds that Snakemake has to cancel its jobs
JOBS = 20  # that may be queued or at work at a time, unless the user says how many

Jobs = dict[str, dict[str, Any]]  # stage -> resources of its job, as Snakemake knows them


class ExecutorName(StrEnum):
    """Where stages run."""

    LOCAL = "local"
    SLURM = "slurm"


class Executor(Protocol):
    """Where stages run, one of `Local`, `Slurm`."""

    @property
    def oversubscribe(self) -> bool:
        """Whether MPI may have more ranks than cores."""

    @property
    def options(self) -> Sequence[str]:
        """Options of Snakemake."""

    @property
    def guard(self) -> Sequence[str]:
        """What stands before Snakemake, and ends it should this process be killed."""

    @property
    def environment(self) -> dict[str, str]:
        """Variables that stages see."""

    def jobs(self, case: Case) -> Jobs:
        """Return the resources that the job of each stage requests; empty on this machine."""

    def left_over(self, folder: Path) -> list[str]:
        """Return the jobs of an earlier command that are still at work in a folder."""

    def end(self, process: subprocess.Popen, folder: Path) -> None:
        """End Snakemake, which works in a folder, and all that it started."""


@dataclass(frozen=True, slots=True)
class Local:
    """Stages are processes of this machine and end with the command.

    Attributes:
        cores: that they may use.
        oversubscribe: whether MPI may have more ranks than cores.
    """

    cores: int
    oversubscribe: bool = False
    guard: Sequence[str] = DIE_WITH_PARENT
    environment: dict[str, str] = field(default_factory=dict)

    @property
    def options(self) -> Sequence[str]:
        """Cores that may be used."""
        return ("--cores", str(self.cores))

    def jobs(self, case: Case) -> Jobs:
        """Return an empty table: no stage is a job."""
        return {}

    def left_over(self, folder: Path) -> list[str]:
        """Return an empty list: no process outlives a command."""
        return []

    def end(self, process: subprocess.Popen, folder: Path) -> None:
        """End the process group."""
        end_group(process)


@dataclass(frozen=True, slots=True)
class Slurm:
    """Stages are jobs of Slurm, submitted, watched and cancelled by Snakemake's own plugin.

    Attributes:
        profile: of the cluster.
        at_once: how many jobs may be queued or at work at a time.
        largest: cores of the largest machine.
        oversubscribe: whether MPI may have more ranks than cores.
    """

    profile: Profile
    at_once: int = JOBS
    largest: int = MOST_CORES
    oversubscribe: bool = False
    # Interrupted, Snakemake cancels its jobs; in the background of a script it would ignore that.
    guard: Sequence[str] = ("setpriv", "--pdeathsig", "INT", "env", "--default-signal=INT")

    @property
    def environment(self) -> dict[str, str]:
        """What starts MPI ranks in the jobs."""
        return {LAUNCHER: self.profile.launcher}

    @property
    def options(self) -> Sequence[str]:
        """The profile, and how many jobs there may be."""
        profile = str(self.profile.folder.resolve())
        jobs = ("--executor", "slurm", "--jobs", str(self.at_once), "--workflow-profile", profile)
        return (*jobs, "--nocolor", "--quiet", "progress", "host")

    def jobs(self, case: Case) -> Jobs:
        """Return the predicted resources with the margin of the profile."""
        wanted = stage_resources(case, self.profile.walltime_factor, self.largest)
        return {stage: resources.of_rule(self.profile.launcher) for stage, resources in wanted.items()}

    def left_over(self, folder: Path) -> list[str]:
        """Return the jobs known to Slurm, or an empty list if it does not answer."""
        with suppress(NoAnswer):
            return jobs_in(folder)
        return []

    def end(self, process: subprocess.Popen, folder: Path) -> None:
        """Interrupt Snakemake, which cancels its jobs at once, but may wait long before it ends; leave no job."""
        process.send_signal(signal.SIGINT)
        deadline = time.monotonic() + LONGEST_END
        while process.poll() is None and time.monotonic() < deadline and self.left_over(folder):
            time.sleep(0.5)
        end_group(process)
        cancel(self.left_over(folder))


def executor_for(
    name: ExecutorName, profile: Path | None, at_once: int | None, oversubscribe: bool, cases: Sequence[Case]
) -> Local | Slurm:
    """Return where stages run, when it is known that they can.

    Args:
        name: where.
        profile: folder of the cluster's profile; None for the default one.
        at_once: cores of this machine, or jobs, that may be used at a time; None for all cores, ``JOBS`` jobs.
        oversubscribe: whether MPI may have more ranks than cores.
        cases: that are to be run.

    Raises:
        CaseError: jobs cannot be submitted here, or a case asks for more than there is.
    """
    if name == ExecutorName.SLURM:
        chosen = read_profile(profile)
        return Slurm(chosen, at_once or JOBS, check_slurm(chosen, cases).largest, oversubscribe)
    if profile is not None:
        raise CaseError("run", [Problem("--profile", "needs a cluster", str(profile), "with --executor slurm")])
    return Local(at_once or available_cores(), oversubscribe)
