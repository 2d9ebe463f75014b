"""What jobs say, shown as it comes: each stage that is a job writes to a file of its own."""

import re
from collections.abc import Iterable
from pathlib import Path

from workflow.terminal import console, errors

# Options of env: Open MPI would take a stage that is a step of Slurm for one of the ranks that srun starts.
OWN_STEP = "-u SLURM_STEPID -u SLURM_STEP_ID"
ERROR = "error: "  # begins what a stage says when it fails
# How Snakemake says that a job failed; its message ends where the command, advice or the next entry begins.
FAILED = re.compile(
    r"^Error in rule (?P<rule>\S+):\n\s+message: (?P<why>.*?)"
    r"\s*(?:sbatch call:|For further error details|\n    jobid:)",
    re.MULTILINE | re.DOTALL,
)


def log_of(stage: str) -> str:
    """Return the file, relative to the run folder, that takes what a stage says."""
    return f"logs/{stage}.txt"


class JobOutput:
    """Follows the output of stages; what an earlier run said is removed."""

    def __init__(self, folder: Path, stages: Iterable[str]) -> None:
        self._read = {folder / log_of(stage): 0 for stage in stages}
        self._failed: set[str] = set()
        (folder / "logs").mkdir(parents=True, exist_ok=True)
        for path in self._read:
            path.unlink(missing_ok=True)

    def show(self) -> None:
        """Print the lines that are new; from a stage's error on they go to standard error."""
        for path, done in self._read.items():
            if not path.is_file():
                continue
            with path.open("rb") as file:
                file.seek(done)
                new = file.read()
            complete = new[: new.rfind(b"\n") + 1]
            self._read[path] = done + len(complete)
            for line in complete.decode(errors="replace").splitlines():
                self._print(path.stem, line)

    def _print(self, stage: str, line: str) -> None:
        if line.startswith(ERROR):
            self._failed.add(stage)
        where = errors if stage in self._failed else console
        where.print(line, soft_wrap=True)

    def untold(self, said: Path) -> list[str]:
        """Say why Snakemake failed: of jobs without a word of their own, as one that Slurm has ended.

        Args:
            said: file with the output of Snakemake, which is named where no job has failed.
        """
        text = said.read_text(encoding="utf-8", errors="replace") if said.is_file() else ""
        found = {match["rule"]: match["why"] for match in FAILED.finditer(text)}
        if not found and not self._failed:
            return [f"Snakemake has ended; what it said is in {said}"]
        return [f"stage {stage} failed: {why}" for stage, why in found.items() if stage not in self._failed]
