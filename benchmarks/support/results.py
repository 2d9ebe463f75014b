"""Results of benchmarks: ``benchmarks/results/NAME.json``, kept with the project.

Each file has the figures of one benchmark, and the conditions of its last measurement: date, machine and load.
"""

import datetime
import json
import os
import platform
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[1] / "results"
_LOAD_AT_START = os.getloadavg()[1]


def read_figures(name: str) -> dict[str, Any]:
    """Return the stored figures of the benchmark ``name``; empty if it has not been run."""
    path = path_of(name)
    return json.loads(path.read_text())["figures"] if path.exists() else {}


def write_figures(name: str, figures: dict[str, Any] | list) -> None:
    """Store the figures of a benchmark in ``results/NAME.json`` with the conditions of the measurement.

    Args:
        name: Name of the benchmark.
        figures: Data that JSON can represent.
    """
    FOLDER.mkdir(exist_ok=True)
    text = json.dumps({"conditions": describe_conditions(), "figures": figures}, indent=1)
    path_of(name).write_text(text + "\n")


def write_and_print(name: str, figures: dict[str, Any]) -> None:
    """Store the figures of the benchmark ``name`` and print them as JSON."""
    write_figures(name, figures)
    print(json.dumps(figures, indent=1))


def path_of(name: str) -> Path:
    """Return the path of the results of the benchmark ``name``, ``results/NAME.json``; the file may not exist."""
    return FOLDER / f"{name}.json"


def describe_conditions() -> dict[str, Any]:
    """Return the conditions of a measurement.

    Returns:
        ``date``, ``processor``, number of ``cores``, and load averages over five minutes ``load_at_start`` of the
        program and ``load_at_end``, now.
    """
    return {
        "date": datetime.date.today().isoformat(),
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)),
        "load_at_start": round(_LOAD_AT_START, 1),
        "load_at_end": round(os.getloadavg()[1], 1),
    }


def _processor() -> str:
    """Return the model of the processor."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())
