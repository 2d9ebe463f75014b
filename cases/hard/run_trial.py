"""Trial of all families that runs an ordinary case file with settings and returns the metrics of its summary."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from reflowshock.cases.hard.trial import Measured, Trial
from reflowshock.fem.parallel.mpi_environment import without_mpi_job
from reflowshock.parameters import Parameters
from reflowshock.problem import as_toml
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.scales import dotted
from reflowshock.workflow.pipeline.reader import read_case

LAST_LINES = 3


class RunParameters(Parameters):
    """Case file, relative to the hard case, and settings: dotted keys with values as for ``--set``."""

    case: str = Field(min_length=1)
    settings: dict = Field(default_factory=dict)

    @property
    def overrides(self) -> list[str]:
        """Settings in the form of ``--set``."""
        return [f"{key}={as_toml(value)}" for key, value in dotted(self.settings)]

    @model_validator(mode="after")
    def _case_can_run(self) -> "RunParameters":
        try:
            read_case(Path(self.case), self.overrides)
        except CaseError as error:
            raise PydanticCustomError("case", "{problems}", {"problems": "; ".join(error.lines())}) from None
        return self


def run_case(parameters: RunParameters) -> dict[str, Measured]:
    """Run a case to its report and return all its metrics.

    Raises:
        RuntimeError: If the run or a health check failed, with the last lines of its output.
    """
    settings = [part for override in parameters.overrides for part in ("--set", override)]
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "reflowshock", "run", parameters.case, "--out", folder, "-j", "1", *settings]
        environment = without_mpi_job(os.environ)
        process = subprocess.run(
            command, capture_output=True, encoding="utf-8", errors="replace", check=False, env=environment
        )
        if process.returncode:
            raise RuntimeError("; ".join(process.stderr.strip().splitlines()[-LAST_LINES:]))
        metrics = json.loads((Path(folder) / "summary.json").read_text(encoding="utf-8"))["metrics"]
    return {name: Measured(entry["value"], entry["unit"]) for name, entry in metrics.items()}


def _located(table: dict, folder: Path) -> dict:
    return table | ({"case": str(folder / table["case"])} if isinstance(table.get("case"), str) else {})


TRIALS = {"run": Trial(RunParameters, run_case, None, _located)}
