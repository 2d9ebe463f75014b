"""Executors of stages, on this machine or on a Slurm cluster: options for Snakemake, and how to end it."""

import signal
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol, Self

from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.jobs.checks import NoAnswer, cancel, check_slurm, jobs_in
from reflowshock.workflow.jobs.profile import Profile, read_profile
from reflowshock.workflow.pipeline.resources import MOST_CORES, stage_resources
from reflowshock.workflow.process.environment import available_cores
from reflowshock.workflow.process.launch import DIE_WITH_PARENT, LAUNCHER, end_group

LONGEST_END = 70.0  # time for Snakemake to cancel its jobs [s]
JOBS = 20  # default limit of queued and running jobs

Jobs = dict[str, dict[str, Any]]  # stage -> resources of its job, as Snakemake names them


class ExecutorName(StrEnum):
    """Names of the executors."""

    LOCAL = "local"
    SLURM = "slurm"


class Executor(Protocol):
    """Executor of stages, either ``Local`` or ``Slurm``."""

    @property
    def oversubscribe(self) -> bool:
        """Whether MPI may have more ranks than cores."""

    @property
    def largest(self) -> int:
        """Largest number of cores of a stage."""

    @property
    def cluster(self) -> "Slurm | None":
        """The executor itself if it submits jobs to a cluster, None on this machine."""

    @property
    def options(self) -> Sequence[str]:
        """Command-line options of Snakemake."""

    @property
    def guard(self) -> Sequence[str]:
        """Command prefix that ends Snakemake if this process is killed."""

    @property
    def environment(self) -> dict[str, str]:
        """Environment variables of the stages."""

    def jobs(self, case: Case) -> Jobs:
        """Return the resources that the job of each stage requests; empty on this machine."""

    def left_over(self, folder: Path) -> list[str]:
        """Return the jobs of an earlier command that are still running in a folder."""

    def end(self, process: subprocess.Popen, folder: Path) -> None:
        """End Snakemake and all processes or jobs that it started in a folder."""


@dataclass(frozen=True, slots=True)
class Local:
    """Executor that runs stages as processes of this machine, which end with the command.

    Attributes:
        cores: Number of cores for all stages.
        oversubscribe: Whether MPI may have more ranks than cores.
    """

    cores: int
    oversubscribe: bool = False
    guard: Sequence[str] = DIE_WITH_PARENT
    environment: dict[str, str] = field(default_factory=dict)

    @property
    def largest(self) -> int:
        """All cores: one stage may use them."""
        return self.cores

    @property
    def cluster(self) -> None:
        """None: stages run on this machine."""

    @property
    def options(self) -> Sequence[str]:
        """Option with the number of cores."""
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
    """Executor that runs stages as Slurm jobs, submitted, monitored and cancelled by Snakemake's plugin.

    Attributes:
        profile: Profile of the cluster.
        at_once: Maximum number of queued and running jobs.
        largest: Number of cores of the largest node.
        oversubscribe: Whether MPI may have more ranks than cores.
    """

    profile: Profile
    at_once: int = JOBS
    largest: int = MOST_CORES
    oversubscribe: bool = False
    # Snakemake cancels its jobs on SIGINT, which background processes of a script would ignore by default.
    guard: Sequence[str] = ("setpriv", "--pdeathsig", "INT", "env", "--default-signal=INT")

    @property
    def cluster(self) -> Self:
        """This executor, which submits jobs to a cluster."""
        return self

    @property
    def environment(self) -> dict[str, str]:
        """Variable with the launcher of MPI ranks in the jobs."""
        return {LAUNCHER: self.profile.launcher}

    @property
    def options(self) -> Sequence[str]:
        """Options with the profile and the number of jobs."""
        profile = str(self.profile.folder.resolve())
        jobs = ("--executor", "slurm", "--jobs", str(self.at_once), "--workflow-profile", profile)
        return (*jobs, "--nocolor", "--quiet", "progress", "host")

    def jobs(self, case: Case) -> Jobs:
        """Return the predicted resources with the margin of the profile."""
        stages = stage_resources(case, self.profile.walltime_factor, self.largest)
        return {stage: resources.of_rule(self.profile.launcher) for stage, resources in stages.items()}

    def left_over(self, folder: Path) -> list[str]:
        """Return the jobs known to Slurm, or an empty list if it does not answer."""
        with suppress(NoAnswer):
            return jobs_in(folder)
        return []

    def end(self, process: subprocess.Popen, folder: Path) -> None:
        """Interrupt Snakemake, which then cancels its jobs; end it after ``LONGEST_END`` and cancel remaining jobs."""
        process.send_signal(signal.SIGINT)
        deadline = time.monotonic() + LONGEST_END
        while process.poll() is None and time.monotonic() < deadline and self.left_over(folder):
            time.sleep(0.5)
        end_group(process)
        cancel(self.left_over(folder))


def executor_for(
    name: ExecutorName, profile: Path | None, at_once: int | None, oversubscribe: bool, cases: Sequence[Case]
) -> Local | Slurm:
    """Return the executor of the stages after checking that it is available.

    Args:
        name: Name of the executor.
        profile: Folder of the cluster profile; None for the default profile.
        at_once: Maximum number of cores (local) or jobs (Slurm); None for all cores or ``JOBS`` jobs.
        oversubscribe: Whether MPI may have more ranks than cores.
        cases: Cases to run.

    Returns:
        Executor of this machine (processes) or of the cluster (Slurm jobs).

    Raises:
        CaseError: Jobs cannot be submitted here, or a case is too large for the cluster.
    """
    if name == ExecutorName.SLURM:
        chosen = read_profile(profile)
        return Slurm(chosen, at_once or JOBS, check_slurm(chosen, cases).largest, oversubscribe)
    if profile is not None:
        raise CaseError("run", [Problem("--profile", "needs a cluster", str(profile), "with --executor slurm")])
    return Local(at_once or available_cores(), oversubscribe)
