"""Cooling is equal on more ranks, and a coupled shock begins in balance."""

import json
from pathlib import Path

import meshio
import numpy as np
import pytest

from tests.support.fem_models import write_small_assembly
from tests.support.fem_program import run_programs

QUIET = 1e-6  # [m/s^2] of the pulse: any motion shows an imbalance
SHOCK = {
    "peak_acceleration": QUIET,
    "pulse_duration": 2e-5,
    "duration": 1e-5,
    "gravity": "off",
    "numerics": {
        "kinematics": "small",
        "mass_scaled": ["copper"],
        "history_samples": 20,
        "field_samples": 2,
        "formulation": "one_point",
    },
}


def written(folder: Path, meshes: list[Path], name: str, ranks: int, **more: object) -> tuple[int, Path]:
    """Return the number of ranks and an input."""
    shock = SHOCK | {"ranks": {"total": ranks}}
    request = {"meshes": [str(path) for path in meshes], "shock": shock, "output": str(folder / name)}
    path = folder / f"{name}.json"
    path.write_text(json.dumps(request | {"materials": {"solder": "SAC405"}} | more))
    return ranks, path


def result_of(folder: Path, name: str) -> dict:
    """Return the contents of ``result.json`` of a named run."""
    return json.loads((folder / name / "result.json").read_text())


@pytest.fixture(scope="module")
def cooled(tmp_path_factory) -> tuple[Path, dict]:
    """Return the folder of a cooling on two ranks, on one, and of a shock that begins with it; and its result."""
    folder = tmp_path_factory.mktemp("residual")
    meshes = write_small_assembly(folder)
    cooling = [
        written(folder, meshes, name, ranks, mode="cooling", change=-192.0)
        for name, ranks in (("cooling", 2), ("alone", 1))
    ]
    begins = str(folder / "cooling/cooling.npz")
    run_programs([*cooling, written(folder, meshes, "two_scale", 2, mode="two_scale", cooling=begins)])
    return folder, result_of(folder, "cooling")


@pytest.mark.long
def test_cooling_is_the_same_on_more_ranks(cooled):
    folder, result = cooled
    assert all(check["ok"] for check in result["health"].values())
    assert result["metrics"]["residual_plastic_strain"]["value"] > 1e-3
    here, there = (np.load(folder / name / "cooling.npz")["displacement"] for name in ("cooling", "alone"))
    assert np.abs(here - there).max() < 1e-8 * np.abs(there).max()
    fields = meshio.read(folder / "cooling/residual.vtu")
    assert fields.cell_data["von_mises"][0].max() > 40e6
    assert (fields.point_data["displacement"] == here).all()


@pytest.mark.long
def test_a_coupled_shock_begins_in_balance(cooled):
    folder, result = cooled
    shock = result_of(folder, "two_scale")
    assert shock["coupling"]["scheme"] == "held_velocity"
    with np.load(folder / "two_scale/history.npz") as history:
        assert history["von_mises_package"][0] == pytest.approx(result["joints"]["von_mises_package"], rel=1e-9)
        drift = history["von_mises_package"][-1] / history["von_mises_package"][0] - 1.0
        assert np.abs(drift).max() < 1e-8
        assert np.abs(history["die_centre"]).max() < 1e-14
        assert np.abs(history["balance"]).max() < 1e-9 * history["internal"][0]
    assert shock["metrics"]["residual_stress_critical_joint"]["value"] > 30e6
