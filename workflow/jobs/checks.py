"""Slurm: its partitions, the jobs of a folder, and what can be wrong before any job is submitted."""

import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from reflowshock.names import nearest
from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.jobs.profile import FILE, Profile

WAIT = 60  # seconds for an answer


PLUGIN = "snakemake_executor_plugin_slurm"


class NoAnswer(RuntimeError):
    """Slurm's commands do not answer; the message has their words."""


@dataclass(frozen=True, slots=True)
class Partition:
    """Slurm partition: name, total cores, cores of its largest node, whether it is the default."""

    name: str
    cores: int
    largest: int
    is_default: bool


def partitions() -> list[Partition]:
    """Return the partitions of the cluster.

    Raises:
        NoAnswer: Slurm cannot be reached.
    """
    found: dict[str, Partition] = {}
    for line in _ask("sinfo", "--noheader", "--format=%P|%C|%c"):
        name, cores, of_node = line.strip().split("|")
        number = re.match(r"\d+", of_node)
        before = found.get(name.rstrip("*"), Partition("", 0, 0, False))
        found[name.rstrip("*")] = Partition(
            name.rstrip("*"),
            before.cores + int(cores.split("/")[-1]),
            max(before.largest, int(number.group()) if number else 1),
            name.endswith("*"),
        )
    return list(found.values())


def jobs_in(folder: Path) -> list[str]:
    """Return the jobs of this user that are queued or at work with a folder as their working directory.

    Raises:
        NoAnswer: Slurm cannot be reached.
    """
    rows = [line.split(maxsplit=1) for line in _ask("squeue", "--me", "--noheader", "--format=%A %Z")]
    return [row[0] for row in rows if len(row) == 2 and Path(row[1]).resolve() == folder.resolve()]


def cancel(jobs: list[str]) -> None:
    """Cancel jobs that have not ended."""
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
    """Find out whether jobs can be submitted, and whether a case asks for more than there is.

    Args:
        profile: of the cluster.
        cases: that are to be run.

    Returns:
        The partition that jobs go to.

    Raises:
        CaseError: with all that is wrong.
    """
    problems = list(_missing())
    if problems:
        raise CaseError("run", problems)
    try:
        found = partitions()
    except NoAnswer as error:
        raise CaseError("run", [Problem("--executor", f"Slurm does not answer: {error}", "slurm")]) from error
    partition = _chosen(profile, found)
    problems = [problem for case in cases for problem in _too_large(case, partition)]
    if problems:
        raise CaseError("run", problems)
    return partition


def _missing() -> Iterator[Problem]:
    if shutil.which("sbatch") is None:
        where = "a machine with Slurm's commands, or --executor local"
        yield Problem("--executor", "sbatch is not installed here", "slurm", where)
    if find_spec(PLUGIN) is None:
        message = "Snakemake's plugin for Slurm is not installed; pip install 'reflowshock[cluster]' brings it"
        yield Problem("--executor", message, "slurm")


def _chosen(profile: Profile, found: Sequence[Partition]) -> Partition:
    """Return the partition of the profile, else the default one; where there is none, the first."""
    if not found:
        raise CaseError("run", [Problem("--executor", "Slurm has no partition for you", "slurm")])
    if not profile.partition:
        return next((partition for partition in found if partition.is_default), found[0])
    names = [partition.name for partition in found]
    if profile.partition not in names:
        key, hint = "default-resources.slurm_partition", nearest(profile.partition, names)
        problem = Problem(key, "is not a partition here", profile.partition, ", ".join(names), hint)
        raise CaseError(str(profile.folder / FILE), [problem])
    return found[names.index(profile.partition)]


def _too_large(case: Case, partition: Partition) -> Iterator[Problem]:
    for key, ranks in case.ranks_by_key.items():
        if ranks > partition.cores:
            message = (
                f"asks for {ranks} MPI ranks, but the Slurm partition {partition.name} has {partition.cores} cores"
            )
            yield Problem(key, message, ranks, f"<= {partition.cores} in total")
