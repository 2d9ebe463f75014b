"""What jobs say, shown as it comes: each stage that is a job writes to a file of its own."""

import re
from collections.abc import Iterable
from pathlib import Path

from reflowshock.workflow.process.terminal import console

# Options of env: Open MPI would take a stage that is a step of Slurm for one of the ranks that srun starts.
OWN_STEP = "-u SLURM_STEPID -u SLURM_STEP_ID"
# How Snakemake says that a job failed: its message ends where the command, advice or the next entry begins.
FAILED = re.compile(r"^Error in (?:rule|group) .*?(?=^Error in |^\[|\Z)", re.MULTILINE | re.DOTALL)
MESSAGE = re.compile(
    r"^\s+message: (?P<why>.*?)\s*(?:sbatch call:|For further error details|\n    \w+:)", re.MULTILINE | re.DOTALL
)
OUTPUT = re.compile(r"^\s+output: (?P<mark>\S+)", re.MULTILINE)


class JobOutput:
    """Follows the files that take what jobs say."""

    def __init__(self, logs: Iterable[Path]) -> None:
        self._read = dict.fromkeys(logs, 0)

    def show(self) -> None:
        """Print the lines that are new."""
        for path, done in self._read.items():
            if not path.is_file():
                continue
            with path.open("rb") as file:
                file.seek(done)
                new = file.read()
            complete = new[: new.rfind(b"\n") + 1]
            self._read[path] = done + len(complete)
            for line in complete.decode(errors="replace").splitlines():
                console.print(line, soft_wrap=True)


def failures_of(said: Path) -> dict[str, str]:
    """Return what Snakemake says of jobs that failed without a word of their own, as those that Slurm has ended.

    Args:
        said: file with the output of Snakemake.

    Returns:
        Name of the job -> why.
    """
    text = said.read_text(encoding="utf-8", errors="replace") if said.is_file() else ""
    found = {}
    for entry in FAILED.findall(text):
        why, mark = MESSAGE.search(entry), OUTPUT.search(entry)
        if why is not None and mark is not None and why["why"] != "None":
            found[Path(mark["mark"]).name] = why["why"]
    return found
