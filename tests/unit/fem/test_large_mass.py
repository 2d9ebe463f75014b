"""A large mass at mounting holes with smaller steps than the board: these elements join the meso model."""

import json
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.errors import AgreedError
from reflowshock.fem.mesh.mesh import append
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.run.package import run_package
from reflowshock.materials.roles import ELASTIC
from tests.support.fem_models import BOARD_X, BOARD_Y, small_assembly, write_msh

SIZE = 0.5e-3
SHOCK = {
    "service_condition": "H",
    "duration": 4e-5,
    "ranks": {"total": 1},
    "coupling": {"scheme": "local_steps"},
    "numerics": {"kinematics": "small", "mass_scaled": ["copper"], "history_samples": 40, "field_samples": 2},
}


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> Path:
    """Write an assembly whose hole elements are a third as long as the others."""
    directory = tmp_path_factory.mktemp("large_mass")
    board, package, *joints = small_assembly(1, size=SIZE)
    near = (np.abs(board.points[:, 0] - BOARD_X + SIZE) < 1e-9) & (board.points[:, 1] > BOARD_Y - 1.1e-3)
    board.points[near, 0] += SIZE * 2.0 / 3.0
    corner = board.points[:, 1] > BOARD_Y - 1.1e-3
    holes = board.facets["mounting_holes"]
    board.facets["mounting_holes"] = holes[corner[holes].all(axis=1)]
    write_msh(append([board, package]), directory / "assembly.msh")
    write_msh(append(joints), directory / "joints.msh")
    board.facets["mounting_holes"] = holes[:0]
    write_msh(append([board, package]), directory / "no_holes.msh")
    return directory


def results(files: Path, assembly: str = "assembly.msh", **changes) -> tuple[dict, dict[str, np.ndarray]]:
    """Run the package with changed keys; return its result and its history."""
    output = files / "_".join(["out", *changes])
    output.mkdir(exist_ok=True)
    meshes = (files / assembly, files / "joints.msh")
    run_package(
        MPI.COMM_SELF,
        RunInput(mode="two_scale", meshes=meshes, materials=ELASTIC, shock=SHOCK | changes, output=output),
    )
    with np.load(output / "history.npz") as arrays:
        return json.loads((output / "result.json").read_text()), dict(arrays)


def test_holes_in_the_meso_model_are_shaken_as_the_board_would_be(files):
    result, direct = results(files)
    shaken, large = results(files, method="large_mass")
    assert result["coupling"]["levels"] == shaken["coupling"]["levels"]
    assert all(check["ok"] for check in shaken["health"].values())
    for name in ("die_centre", "von_mises_board"):
        assert np.linalg.norm(large[name] - direct[name]) < 5e-3 * np.linalg.norm(direct[name]), name


def test_large_mass_without_holes_is_refused(files):
    with pytest.raises(AgreedError, match="mounting_holes is empty"):
        results(files, "no_holes.msh", method="large_mass")
