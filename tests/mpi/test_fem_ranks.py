"""Ranks must not change results, and an error on one rank must end all of them."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from reflowshock.fem.mesh.mesh import append
from tests.support.fem_models import board_mesh, package_mesh, small_assembly, write_msh, write_small_assembly
from tests.support.fem_program import run_program

ROOT = Path(__file__).resolve().parents[2]
SHOCK = {
    "peak_acceleration": 14709.975,
    "pulse_duration": 5e-4,
    "duration": 2e-5,
    "picture_times": [1e-5, 2e-5],
    "numerics": {"mass_scaled": ["copper"], "history_samples": 50, "field_samples": 2},
}


def start(directory: Path, ranks: int, **changes) -> subprocess.CompletedProcess:
    """Run ``python -m fem`` on some ranks; changes replace keys of the input."""
    meshes = [str(directory / "assembly.msh"), str(directory / "joints.msh")]
    request = {"mode": "dns", "meshes": meshes, "shock": SHOCK, "output": str(directory / "out")} | changes
    path = directory / "input.json"
    path.write_text(json.dumps(request))
    return run_program(path, ranks)


def history(
    directory: Path, ranks: tuple[int, int], mode: str, placement: str = "disjoint", scheme: str = "held_velocity"
) -> dict[str, np.ndarray]:
    output = directory / f"{mode}_{ranks[0]}_{ranks[1]}_{placement}_{scheme}"
    macro = {"macro": ranks[0]} if placement == "disjoint" else {}
    shock = SHOCK | {"ranks": {"total": sum(ranks), "placement": placement} | macro, "coupling": {"scheme": scheme}}
    done = start(directory, sum(ranks), mode=mode, shock=shock, output=str(output))
    assert done.returncode == 0, done.stderr
    result = json.loads((output / "result.json").read_text())
    assert all(check["ok"] for check in result["health"].values())
    assert result["model"]["ranks"] == sum(ranks)
    return arrays_of(output)


def arrays_of(output: Path) -> dict[str, np.ndarray]:
    """Return the history and, by names with an @, the pictures of the interface."""
    with np.load(output / "history.npz") as history, np.load(output / "interface.npz") as interface:
        return {**history, **interface}


@pytest.fixture(scope="module")
def assembly(tmp_path_factory) -> Path:
    directory = tmp_path_factory.mktemp("assembly")
    write_small_assembly(directory)
    return directory


def assert_same(first: dict[str, np.ndarray], second: dict[str, np.ndarray]) -> None:
    pictures = [name for name in first if "@" in name]
    assert len(pictures) == 12
    for name in (
        *pictures,
        "board_centre",
        "die_centre",
        "von_mises_board",
        "von_mises_package",
        "von_mises_max",
        "board_strain",
        "peel_board",
        "section_board",
        "section_package",
    ):
        scale = np.abs(first[name]).max()
        assert np.abs(first[name] - second[name]).max() <= 1e-8 * scale, name


@pytest.fixture(scope="module")
def reference(assembly) -> dict[str, np.ndarray]:
    return history(assembly, (1, 1), "two_scale")


@pytest.mark.parametrize(
    "ranks", [(1, 2), pytest.param((2, 1), marks=pytest.mark.long), pytest.param((2, 2), marks=pytest.mark.long)]
)
def test_two_scale_is_the_same_on_more_ranks(assembly, reference, ranks):
    assert_same(reference, history(assembly, ranks, "two_scale"))


@pytest.mark.parametrize("ranks", [(1, 0), (1, 1), (1, 2), pytest.param((2, 2), marks=pytest.mark.long)])
def test_two_scale_is_the_same_when_ranks_carry_both_models(assembly, reference, ranks):
    assert_same(reference, history(assembly, ranks, "two_scale", "shared"))


def test_local_steps_are_the_same_on_any_ranks(assembly):
    one = history(assembly, (1, 0), "two_scale", "shared", "local_steps")
    assert_same(one, history(assembly, (1, 2), "two_scale", "disjoint", "local_steps"))
    assert_same(one, history(assembly, (2, 2), "two_scale", "shared", "local_steps"))


def test_ranks_that_carry_both_models_do_not_wait_for_large_messages(tmp_path):
    script = tmp_path / "turns.py"
    script.write_text(
        "import numpy as np\n"
        "from mpi4py import MPI\n"
        "from reflowshock.fem.parallel.exchange import Channel\n"
        "world, count = MPI.COMM_WORLD, 50_000  # far more than Open MPI buffers\n"
        "here, nowhere = np.arange(count, dtype=np.int32), np.full(count, -1, np.int32)\n"
        "channel = Channel(world, *((here, nowhere) if world.rank == 0 else (nowhere, here)), receiver_waits=False)\n"
        "values = np.full((count, 3), 7.0 if world.rank == 0 else 0.0)\n"
        "channel.send(values)\n"
        "world.Barrier()  # a turn of another model\n"
        "channel.receive(values)\n"
        "assert (values == 7.0).all()\n"
    )
    done = subprocess.run(
        ["mpirun", "--allow-run-as-root", "--oversubscribe", "-n", "2", sys.executable, str(script)],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_dns_is_the_same_on_one_and_two_ranks(assembly):
    one = start(assembly, 1, output=str(assembly / "dns_1"))
    assert one.returncode == 0, one.stderr
    assert_same(arrays_of(assembly / "dns_1"), history(assembly, (1, 1), "dns"))


def fails(directory: Path, ranks: int, message: str, **changes) -> None:
    begin = time.perf_counter()
    done = start(directory, ranks, **changes)
    assert done.returncode == 1
    assert message in done.stderr
    assert time.perf_counter() - begin < 30


def test_wrong_number_of_ranks_ends_the_run(assembly):
    fails(assembly, 3, "asks for 2 ranks (ranks.total), mpirun started 3", mode="two_scale")


def test_missing_mesh_ends_all_ranks(assembly):
    fails(assembly, 2, "nowhere.msh", meshes=["nowhere.msh"])


def test_joint_beside_the_board_ends_all_ranks(tmp_path):
    joints = small_assembly()[2:]
    joints[0].points[:, 0] += 9e-3
    write_msh(append([board_mesh(), package_mesh()]), tmp_path / "assembly.msh")
    write_msh(append(joints), tmp_path / "joints.msh")
    fails(tmp_path, 2, "foot@B2: the node at", mode="two_scale")


def test_energy_that_does_not_balance_ends_all_ranks(assembly):
    numerics, held = SHOCK["numerics"] | {"energy_balance_limit": 1e-12}, {"scheme": "held_velocity"}
    fails(assembly, 2, "energy_balance_limit", mode="two_scale", shock=SHOCK | {"numerics": numerics, "coupling": held})


def test_crash_of_one_rank_ends_all(assembly, tmp_path):
    """A rank that fails where nobody agrees on anything: it aborts the others."""
    script = tmp_path / "crash.py"
    script.write_text(
        "import sys\n"
        "from mpi4py import MPI\n"
        "from reflowshock.fem.coupling import held_velocity; from reflowshock.fem.run import program\n"
        "def broken(self): raise ZeroDivisionError('broken rank')\n"
        "held_velocity.HeldVelocityMeso.begin_window = broken\n"
        "sys.exit(program.main(MPI.COMM_WORLD, sys.argv[1:]))\n"
    )
    path = tmp_path / "input.json"
    meshes = [str(assembly / "assembly.msh"), str(assembly / "joints.msh")]
    path.write_text(json.dumps({"mode": "two_scale", "meshes": meshes, "shock": SHOCK, "output": str(tmp_path)}))
    done = subprocess.run(
        ["mpirun", "--allow-run-as-root", "-n", "2", sys.executable, str(script), str(path)],
        env=os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode != 0
    assert "broken rank" in done.stderr
