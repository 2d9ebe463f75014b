"""The trial of all families that runs an ordinary case file with settings, judged by the metrics of its summary."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from fem.own_job import own_environment
from workflow.problems import as_toml
from workflow.scales import dotted
from workflow.stress_test.trial import Measured, Trial

LAST_LINES = 3


class RunParameters(BaseModel):
    """A case file, its name relative to the hard case's own, and settings: dotted keys with values as for --set."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    case: str = Field(min_length=1)
    settings: dict = {}


def run_case(parameters: RunParameters) -> dict[str, Measured]:
    """Run a case to its report; all its metrics.

    Raises:
        RuntimeError: the run failed or a check did not hold; with its last words.
    """
    settings = [part for key, value in dotted(parameters.settings) for part in ("--set", f"{key}={as_toml(value)}")]
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "workflow", "run", parameters.case, "--out", folder, "-j", "1", *settings]
        environment = own_environment(os.environ)
        process = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
        if process.returncode:
            raise RuntimeError("; ".join(process.stderr.strip().splitlines()[-LAST_LINES:]))
        metrics = json.loads((Path(folder) / "summary.json").read_text())["metrics"]
    return {name: Measured(entry["value"], entry["unit"]) for name, entry in metrics.items()}


def _located(table: dict, folder: Path) -> dict:
    return table | ({"case": str(folder / table["case"])} if isinstance(table.get("case"), str) else {})


TRIALS = {"run": Trial(RunParameters, run_case, None, _located)}
