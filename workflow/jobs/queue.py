"""What Slurm says of its partitions and of the jobs of a folder; jobs that are left over are cancelled."""

import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

WAIT = 60  # seconds for an answer


class NoAnswer(RuntimeError):
    """Slurm's commands do not answer; the message has their words."""


@dataclass(frozen=True, slots=True)
class Partition:
    """A partition: its name, all its cores, those of its largest machine, and whether it is the default."""

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
    """Cancel jobs; those that have ended are none."""
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
