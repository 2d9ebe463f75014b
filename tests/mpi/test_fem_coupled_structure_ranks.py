"""Two coupled models of a structure have equal results on one rank and on several, in both placements."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.fem_bars import bar_layers, write_bar
from tests.support.fem_program import run_programs

LAYERS = bar_layers(("FR4", 6e-3, 6, (2, 2)), ("FR4", 1e-3, 4, (3, 3)), ("FR4", 6e-3, 6, (2, 2)))
TABLES = {
    "supports": {"clamp": {"on": "z_min", "hold": ["x", "y", "z"]}},
    "loads": {
        "side": {"kind": "pressure", "on": "x_max", "peak": 1e5, "duration": 1e-5},
        "pull": {"kind": "motion", "on": "z_max", "component": "z", "peak": 0.1, "duration": 1e-5},
    },
    "watch": {name: {"at": [0.0, 0.0, z]} for name, z in (("low", 1e-3), ("inside", 6.5e-3), ("high", 12e-3))},
}


def request(directory: Path, ranks: int, scheme: str, placement: str) -> Path:
    """Write mesh and input of a bar in two coupled models; return the path of the input."""
    coupling = {"scheme": scheme, "placement": placement}
    numerics = {"history_samples": 20, "field_samples": 2}
    dynamics = {"duration": 1e-5, "ranks": ranks, "coupling": coupling, "numerics": numerics}
    bar = write_bar(directory, 2e-3, LAYERS, 1e-5, **TABLES, dynamics=dynamics)
    (directory / "input.json").write_text(bar.model_dump_json())
    return directory / "input.json"


def history(directory: Path, placement: str) -> dict[str, np.ndarray]:
    """Return the arrays of a history, name -> samples, after a check of placement and models."""
    result = json.loads((directory / "out" / "result.json").read_text())
    assert result["model"]["placement"] == placement
    assert set(result["model"]["models"]) == {"macro", "meso"}
    with np.load(directory / "out" / "history.npz") as arrays:
        return {name: array for name, array in arrays.items() if array.dtype.kind == "f"}


@pytest.mark.parametrize("scheme", [pytest.param("held_velocity", marks=pytest.mark.long), "local_steps"])
def test_placements_give_what_one_rank_gives(tmp_path, scheme):
    runs = {"one": (1, "shared"), "two": (2, "shared"), "three": (3, "disjoint")}
    run_programs([(ranks, request(tmp_path / name, ranks, scheme, way)) for name, (ranks, way) in runs.items()])
    reference, *others = (history(tmp_path / name, way) for name, (_, way) in runs.items())
    for other in others:
        for name in reference.keys() - {"balance", "interface"}:  # these are differences of the others
            scale = reference["internal" if name == "hourglass" else name]  # small for full integration
            assert np.abs(reference[name] - other[name]).max() <= 1e-8 * np.abs(scale).max(), name
