"""A package whose coarse model drives the fine model of a joint, as a program run."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.grids import joint_mesh
from reflowshock.fem.errors import AgreedError
from reflowshock.fem.mesh.mesh import append
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.problem.shock_checks import problems
from reflowshock.fem.run.package import run_package
from reflowshock.materials.roles import ELASTIC
from tests.support.fem_models import SITES, write_msh, write_small_assembly

SHOCK = {
    "peak_acceleration": 14709.975,
    "pulse_duration": 5e-4,
    "duration": 2e-5,
    "ranks": {"total": 1},
    "numerics": {"kinematics": "small", "history_samples": 50, "field_samples": 2},
}


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> Path:
    """Return a folder with the meshes of the small package and its coarse joints."""
    directory = tmp_path_factory.mktemp("one_way")
    write_small_assembly(directory)
    coarse = []
    for name, site in SITES.items():
        mesh = joint_mesh(name, *site, layers=2, edges=1)
        facets = {f"pad_board@{name}": mesh.facets[f"foot@{name}"], f"pad_package@{name}": mesh.facets[f"head@{name}"]}
        facets = mesh.facets | facets
        coarse.append(replace(mesh, part=0 * mesh.part, part_names=(f"solder@{name}",), facets=facets))
    write_msh(append(coarse), directory / "coarse.msh")
    return directory


def request(files: Path, name: str, **coupling) -> RunInput:
    """Return the input of a run with one-way coupling and changed settings."""
    return RunInput(
        mode="two_scale",
        materials=ELASTIC,
        meshes=(files / "assembly.msh", files / "joints.msh"),
        coarse_joints=files / "coarse.msh",
        shock=SHOCK | {"coupling": coupling},
        output=files / name,
    )


def results(files: Path, name: str, **coupling) -> tuple[dict, dict[str, np.ndarray]]:
    """Run the package with one-way coupling; return its result and its history."""
    (files / name).mkdir()
    run_package(MPI.COMM_SELF, request(files, name, **coupling))
    with np.load(files / name / "history.npz") as arrays:
        return json.loads((files / name / "result.json").read_text()), dict(arrays)


def test_driven_joint_is_stressed_as_a_coupled_one(files):
    one_way, driven = results(files, "one_way", direction="one_way", fine_joints=("A3",))
    two, coupled = results(files, "two_way", scheme="held_velocity", fine_joints=("A3",))
    assert one_way["coupling"]["direction"] == "one_way"
    assert all(check["ok"] for check in (one_way["health"] | two["health"]).values())
    assert list(driven["joints"]) == list(coupled["joints"])
    joint = list(driven["joints"]).index("A3")
    for end in ("von_mises_board", "von_mises_package"):
        stress, expected = driven[end][:, joint], coupled[end][:, joint]
        assert np.linalg.norm(stress - expected) < 0.1 * np.linalg.norm(expected), end
    counts = one_way["model"]["elements"]
    assert counts["macro"] + counts["meso"] > sum(two["model"]["elements"].values())
    assert one_way["model"]["model_mass"] == pytest.approx(two["model"]["model_mass"], rel=0.02)  # copper in one only


def test_all_joints_can_be_driven(files):
    result, history = results(files, "all", direction="one_way")
    assert result["model"]["substeps"] >= 2
    assert (history["von_mises_board"].max(axis=0) > 0.0).all()


def test_one_way_without_coarse_joints_is_an_error(files):
    whole = request(files, "none", direction="one_way").model_copy(update={"coarse_joints": None})
    with pytest.raises(AgreedError, match="no file of coarse joints"):
        run_package(MPI.COMM_SELF, whole)


def test_schemes_that_need_an_answer_are_refused_one_way(files):
    messages = problems(request(files, "x", direction="one_way", scheme="gravouil_combescure").shock)
    assert [problem.key for problem in messages] == ["shock.coupling.scheme"]


def test_pulse_that_is_over_within_a_window_is_an_error_that_names_both(files):
    short = request(files, "short", direction="one_way")
    short = short.model_copy(update={"shock": short.shock.model_copy(update={"pulse_duration": 1e-9})})
    with pytest.raises(AgreedError, match=r"a pulse of 1e-09 s is shorter than a window of \S+e-0[89] s"):
        run_package(MPI.COMM_SELF, short)
