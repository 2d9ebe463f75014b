"""Runs of the program on several ranks, launched in the same way as user runs."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from reflowshock.fem.problem.inputs import RunInput
from tests.support.fem_program import run_program

COMPARED = ("board_centre", "die_centre", "von_mises_board", "von_mises_package", "board_strain")


def launch(request: RunInput, ranks: dict, output: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Run an input on several ranks.

    Args:
        request: Input of the run.
        ranks: Values of ``shock.ranks``: ``total`` and ``placement``.
        output: Folder of the results, which is created.

    Returns:
        History, name -> samples, and contents of ``result.json``.

    Raises:
        RuntimeError: The run failed.
    """
    output.mkdir(parents=True)
    tables = request.model_dump(mode="json")
    tables["shock"]["ranks"] |= ranks
    path = output / "input.json"
    path.write_text(json.dumps(tables | {"output": str(output)}))
    done = run_program(path, ranks["total"])
    if done.returncode:
        raise RuntimeError(f"the run on {ranks} failed:\n{done.stderr}")
    with np.load(output / "history.npz") as arrays:
        return dict(arrays), json.loads((output / "result.json").read_text())


def largest_difference(values: dict[str, np.ndarray], reference: dict[str, np.ndarray]) -> float:
    """Return the largest difference of two histories, relative to the largest value of each array.

    Args:
        values: Arrays of one history by name, of which those in ``COMPARED`` are used.
        reference: Arrays of the other history, of equal shapes.
    """
    return max(float(np.abs(values[name] - reference[name]).max() / np.abs(reference[name]).max()) for name in COMPARED)
