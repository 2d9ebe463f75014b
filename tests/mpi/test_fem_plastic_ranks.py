"""Plastic flow of solder is equal on any number of ranks."""

import json
from pathlib import Path

import numpy as np

from reflowshock.fem.output.watch_joints import FLOWS
from tests.support.fem_models import write_small_assembly
from tests.support.fem_program import run_programs

SHOCK = {
    "peak_acceleration": 2e7,
    "pulse_duration": 2e-5,
    "duration": 1e-5,
    "numerics": {"kinematics": "small", "mass_scaled": ["copper"], "history_samples": 20, "field_samples": 2},
}


def request(meshes: list[Path], macro: int, meso: int) -> Path:
    """Write the input of a run on some ranks into the folder of the meshes."""
    output = meshes[0].parent / f"{macro}_{meso}"
    shock = SHOCK | {"ranks": {"total": macro + meso, "placement": "disjoint", "macro": macro}}
    scene = {"mode": "two_scale", "meshes": [str(path) for path in meshes], "shock": shock, "output": str(output)}
    path = output.with_suffix(".json")
    path.write_text(json.dumps(scene | {"materials": {"solder": "SAC405"}}))
    return path


def outcome(output: Path) -> tuple[dict[str, np.ndarray], dict]:
    """Return history and result of a run."""
    with np.load(output / "history.npz") as arrays:
        return dict(arrays), json.loads((output / "result.json").read_text())


def test_flow_is_the_same_on_more_ranks(tmp_path):
    meshes = write_small_assembly(tmp_path)
    inputs = [(1 + meso, request(meshes, 1, meso)) for meso in (1, 2)]
    run_programs(inputs)
    (expected, result), (actual, other) = (outcome(path.with_suffix("")) for _, path in inputs)
    for name in (*FLOWS, "plastic_strain_max", "von_mises_max", "plastic", "section_board", "section_package"):
        scale = np.abs(expected[name]).max()
        assert scale > 0.0
        assert np.abs(actual[name] - expected[name]).max() <= 1e-8 * scale, name
    assert all(check["ok"] for check in (result["health"] | other["health"]).values())
