"""Other methods for the shock of a package: large mass for direct acceleration, power iteration for the DNS."""

import json
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.run import package
from tests.support.fem_models import write_small_assembly
from tests.support.fem_program import run_programs

SHOCK = {
    "service_condition": "H",
    "duration": 6e-5,
    "numerics": {"kinematics": "small", "mass_scaled": ["copper"], "history_samples": 60, "field_samples": 2},
}


@pytest.fixture(scope="module")
def assembly(tmp_path_factory) -> Path:
    """Return a folder with the meshes of a small package with one joint."""
    directory = tmp_path_factory.mktemp("methods")
    write_small_assembly(directory, 1, size=1e-3)
    return directory


def request(directory: Path, mode: Literal["two_scale", "dns"], name: str, **changes) -> dict:
    """Return the input of a run as a dictionary; ``changes`` replace keys of the shock."""
    meshes = [str(directory / "assembly.msh"), str(directory / "joints.msh")]
    request = {"mode": mode, "meshes": meshes, "shock": SHOCK | changes, "output": str(directory / name)}
    return request | {"materials": {"solder": "SAC405_elastic"}}


def dns(directory: Path, name: str, **changes) -> tuple[dict, dict[str, np.ndarray]]:
    """Run one model of the package; return its result and its history."""
    (directory / name).mkdir()
    package.run_package(MPI.COMM_SELF, RunInput.model_validate(request(directory, "dns", name, **changes)))
    return results(directory / name)


def results(output: Path) -> tuple[dict, dict[str, np.ndarray]]:
    """Return result and history in a folder, after a check of the run's health."""
    result = json.loads((output / "result.json").read_text())
    assert all(check["ok"] for check in result["health"].values()), result["health"]
    with np.load(output / "history.npz") as arrays:
        return result, dict(arrays)


def difference(first: dict[str, np.ndarray], second: dict[str, np.ndarray]) -> float:
    """Return the largest relative difference of three histories, in the 2-norm."""
    names = ("die_centre", "board_strain", "von_mises_board")
    return max(float(np.linalg.norm(first[k] - second[k]) / np.linalg.norm(second[k])) for k in names)


def test_large_mass_at_the_holes_is_direct_acceleration(assembly):
    """The difference is the error of held velocity in a moving frame, a DT^2 / 8, small once the board bends."""
    inputs = {"direct": {}, "large": {"method": "large_mass"}}
    for name, changes in inputs.items():
        (assembly / f"{name}.json").write_text(json.dumps(request(assembly, "two_scale", name, **changes)))
    run_programs([(2, assembly / f"{name}.json") for name in inputs])
    result, direct = results(assembly / "direct")
    assert result["effects"]["input_g"]["why"].startswith("JEDEC service condition H, direct acceleration")
    assert not result["effects"]["gravity"]["on"]
    result, large = results(assembly / "large")
    assert "large mass" in result["effects"]["input_g"]["why"]
    assert difference(large, direct) < 5e-3


def test_power_iteration_allows_larger_substeps_of_a_dns(assembly):
    numerics = {"kinematics": "small", "history_samples": 20, "field_samples": 2}
    result, element = dns(assembly, "element", duration=2e-5, numerics=numerics)
    numerics["critical_step"] = "power_iteration"
    larger, assembled = dns(assembly, "assembled", numerics=numerics, duration=2e-5)
    assert larger["model"]["substeps"] < 0.5 * result["model"]["substeps"]
    assert assembled["time"] == pytest.approx(element["time"], rel=1e-12)
    assert difference(assembled, element) < 5e-3
