"""Slurm queries: partitions, jobs of a folder, and checks before any job is submitted."""

import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from reflowshock.names import find_nearest
from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.jobs.profile import FILE, Profile

WAIT = 60  # time limit of a Slurm command [s]


PLUGIN = "snakemake_executor_plugin_slurm"


class NoAnswer(RuntimeError):
    """Error of a Slurm command; the message contains its output."""


@dataclass(frozen=True, slots=True)
class Partition:
    """Slurm partition: name, total cores, cores of its largest node, whether it is the default."""

    name: str
    cores: int
    largest: int
    is_default: bool


def partitions() -> list[Partition]:
    """Return the partitions of the cluster: name, total cores, cores of the largest node, whether it is the default.

    Raises:
        NoAnswer: Slurm cannot be reached.
    """
    partition_by_name: dict[str, Partition] = {}
    for line in _ask("sinfo", "--noheader", "--format=%P|%C|%c"):
        name, cores, of_node = line.strip().split("|")
        number = re.match(r"\d+", of_node)
        previous = partition_by_name.get(name.rstrip("*"), Partition("", 0, 0, False))
        partition_by_name[name.rstrip("*")] = Partition(
            name.rstrip("*"),
            previous.cores + int(cores.split("/")[-1]),
            max(previous.largest, int(number.group()) if number else 1),
            name.endswith("*"),
        )
    return list(partition_by_name.values())


def jobs_in(folder: Path) -> list[str]:
    """Return the numbers of this user's queued or running Slurm jobs whose working directory is a folder.

    Raises:
        NoAnswer: Slurm cannot be reached.
    """
    rows = [line.split(maxsplit=1) for line in _ask("squeue", "--me", "--noheader", "--format=%A %Z")]
    return [row[0] for row in rows if len(row) == 2 and Path(row[1]).resolve() == folder.resolve()]


def cancel(jobs: list[str]) -> None:
    """Cancel Slurm jobs that have not ended.

    Args:
        jobs: Numbers of the jobs; empty is allowed.
    """
    if jobs:
        subprocess.run(["scancel", *jobs], capture_output=True, timeout=WAIT, check=False)


def _ask(*command: str) -> Iterator[str]:
    try:
        answer = subprocess.run(
            command, capture_output=True, encoding="utf-8", errors="replace", timeout=WAIT, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NoAnswer(f"{command[0]}: {error}") from error
    if answer.returncode != 0:
        raise NoAnswer(answer.stderr.strip() or f"{command[0]} ended with exit code {answer.returncode}")
    yield from answer.stdout.splitlines()


def check_slurm(profile: Profile, cases: Sequence[Case]) -> Partition:
    """Check that jobs can be submitted and that the cases fit into the partition.

    Args:
        profile: Profile of the cluster.
        cases: Cases to run.

    Returns:
        The partition of the jobs.

    Raises:
        CaseError: Jobs cannot be submitted, or a case is too large; with all problems.
    """
    problems = list(_missing())
    if problems:
        raise CaseError("run", problems)
    try:
        available = partitions()
    except NoAnswer as error:
        raise CaseError("run", [Problem("--executor", f"Slurm does not answer: {error}", "slurm")]) from error
    partition = _select_partition(profile, available)
    problems = [problem for case in cases for problem in _too_large(case, partition)]
    if problems:
        raise CaseError("run", problems)
    return partition


def _missing() -> Iterator[Problem]:
    if shutil.which("sbatch") is None:
        where = "a machine with the Slurm commands, or --executor local"
        yield Problem("--executor", "sbatch is not installed here", "slurm", where)
    if find_spec(PLUGIN) is None:
        message = "the Slurm plugin of Snakemake is not installed; try: pip install 'reflowshock[cluster]'"
        yield Problem("--executor", message, "slurm")


def _select_partition(profile: Profile, available: Sequence[Partition]) -> Partition:
    """Return the partition of the profile, otherwise the default partition, otherwise the first."""
    if not available:
        raise CaseError("run", [Problem("--executor", "no Slurm partition is available to you", "slurm")])
    if not profile.partition:
        return next((partition for partition in available if partition.is_default), available[0])
    names = [partition.name for partition in available]
    if profile.partition not in names:
        key, hint = "default-resources.slurm_partition", find_nearest(profile.partition, names)
        problem = Problem(key, "is not a partition here", profile.partition, ", ".join(names), hint)
        raise CaseError(str(profile.folder / FILE), [problem])
    return available[names.index(profile.partition)]


def _too_large(case: Case, partition: Partition) -> Iterator[Problem]:
    for key, ranks in case.ranks_by_key.items():
        if ranks > partition.cores:
            message = (
                f"asks for {ranks} MPI ranks, but the Slurm partition {partition.name} has {partition.cores} cores"
            )
            yield Problem(key, message, ranks, f"<= {partition.cores} in total")
