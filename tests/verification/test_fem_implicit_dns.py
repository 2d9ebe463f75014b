"""A package on a board: histories of implicit steps against explicit steps."""

from pathlib import Path

from mpi4py import MPI

from reflowshock.fem.output.compare import compare_histories
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.problem.shock import Shock
from reflowshock.fem.run.package import run_package
from reflowshock.materials.roles import ELASTIC
from tests.support.fem_models import write_small_assembly


def dns(meshes: list[Path], directory: Path, solver: str) -> Path:
    """Run a DNS of a part of the pulse; return its history."""
    directory.mkdir()
    numerics = {"kinematics": "small", "mass_scaled": ("copper",), "history_samples": 20, "field_samples": 2}
    numerics |= {"dns_solver": solver}
    shock = Shock(service_condition="B", duration=1e-5, numerics=numerics)
    run_package(
        MPI.COMM_SELF,
        RunInput(mode="dns", meshes=meshes, materials=ELASTIC, shock=shock, output=directory),
    )
    return directory / "history.npz"


def test_implicit_dns_has_the_histories_of_the_explicit_one(tmp_path):
    meshes = write_small_assembly(tmp_path, 1, size=1e-3)
    explicit, implicit = (dns(meshes, tmp_path / solver, solver) for solver in ("explicit", "implicit"))
    comparison = compare_histories(implicit, explicit)
    assert comparison["board_displacement_error"] < 0.01
    assert comparison["die_displacement_error"] < 0.01
    assert comparison["worst_joint_stress_error"] < 0.02
