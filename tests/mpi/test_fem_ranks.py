"""Results do not depend on the ranks, and an error on one rank ends all of them."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from reflowshock.fem.mesh.mesh import append
from tests.support.fem_models import board_mesh, package_mesh, small_assembly, write_msh, write_small_assembly
from tests.support.fem_program import run_program, run_programs, run_python, run_warm

SHOCK = {
    "peak_acceleration": 14709.975,
    "pulse_duration": 5e-4,
    "duration": 2e-5,
    "picture_times": [1e-5, 2e-5],
    "numerics": {"kinematics": "small", "mass_scaled": ["copper"], "history_samples": 50, "field_samples": 2},
}

# A gauge across the interface of the models, one centred on a symmetry plane, a mass and another package.
FITTED = {
    "watch": {"edge": {"at": [8e-3, 4e-3, 0.0]}},
    "gauges": {
        "near": {"at": [3.2e-3, 1e-3], "direction": [2.0, 1.0], "length": 3e-3},
        "middle": {"at": [0.0, 6e-3], "face": "upper"},
    },
    "packages": {
        "pmic": {
            "at": [10e-3, 2e-3],
            "rows": 1,
            "columns": 2,
            "pitch": 1e-3,
            "post": 0.5e-3,
            "standoff": 0.3e-3,
            "substrate": [2e-3, 1e-3, 0.4e-3],
            "die": [1e-3, 0.8e-3, 0.3e-3],
        }
    },
    "masses": {"coil": {"mass": 1e-5, "at": [7e-3, 0.0, 0.0], "footprint": [4e-3, 2e-3]}},
}


def write_input(path: Path, directory: Path, **changes) -> Path:
    """Write an input for the meshes of a directory; ``changes`` replace its keys."""
    meshes = [str(directory / "assembly.msh"), str(directory / "joints.msh")]
    request = {"mode": "dns", "meshes": meshes, "shock": SHOCK, "output": str(directory / "out")} | FITTED
    request |= {"materials": {"solder": "SAC405_elastic"}} | changes
    path.write_text(json.dumps(request))
    return path


@dataclass(frozen=True)
class Scene:
    """Run with its models and the ranks of each, macro model first."""

    mode: str
    ranks: tuple[int, int]
    placement: str = "disjoint"
    scheme: str = "held_velocity"

    def output(self, directory: Path) -> Path:
        """Return the output folder."""
        return directory / f"{self.mode}_{self.ranks[0]}_{self.ranks[1]}_{self.placement}_{self.scheme}"

    def write(self, directory: Path) -> Path:
        """Write the input into the folder of the meshes."""
        macro = {"macro": self.ranks[0]} if self.placement == "disjoint" else {}
        ranks = {"total": sum(self.ranks), "placement": self.placement} | macro
        shock = SHOCK | {"ranks": ranks, "coupling": {"scheme": self.scheme}}
        output = self.output(directory)
        return write_input(output.with_suffix(".json"), directory, mode=self.mode, shock=shock, output=str(output))

    def history(self, directory: Path) -> dict[str, np.ndarray]:
        """Return the history of a healthy run."""
        result = json.loads((self.output(directory) / "result.json").read_text())
        assert all(check["ok"] for check in result["health"].values())
        assert result["model"]["ranks"] == sum(self.ranks)
        return arrays_of(self.output(directory))


REFERENCE, LOCAL_STEPS = Scene("two_scale", (1, 1)), Scene("two_scale", (1, 0), "shared", "local_steps")
SAME = {
    "two scales": (REFERENCE, Scene("two_scale", (1, 2))),
    "one rank carries both models": (REFERENCE, Scene("two_scale", (1, 0), "shared")),
    "two ranks carry both models": (REFERENCE, Scene("two_scale", (1, 1), "shared")),
    "local steps": (LOCAL_STEPS, Scene("two_scale", (1, 2), "disjoint", "local_steps")),
    "local steps, both models": (LOCAL_STEPS, Scene("two_scale", (2, 2), "shared", "local_steps")),
    "one model": (Scene("dns", (1, 0), "shared"), Scene("dns", (1, 1))),
}
SAME_TOO = {
    "three ranks carry both models": (REFERENCE, Scene("two_scale", (1, 2), "shared")),
    "two ranks of the board": (REFERENCE, Scene("two_scale", (2, 1))),
    "two ranks of each model": (REFERENCE, Scene("two_scale", (2, 2))),
    "four ranks carry both models": (REFERENCE, Scene("two_scale", (2, 2), "shared")),
}


def run_all(directory: Path, pairs: Iterable[tuple[Scene, Scene]]) -> Path:
    """Run each scene once in one program on all ranks, which loads libraries once."""
    scenes = dict.fromkeys(scene for pair in pairs for scene in pair)
    write_small_assembly(directory)
    run_programs([(sum(scene.ranks), scene.write(directory)) for scene in scenes])
    return directory


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> Path:
    """Return the folder with the results of the runs in ``SAME``."""
    return run_all(tmp_path_factory.mktemp("runs"), SAME.values())


@pytest.fixture(scope="module")
def more_runs(tmp_path_factory) -> Path:
    """Return the folder with the results of the runs in ``SAME_TOO``."""
    return run_all(tmp_path_factory.mktemp("more"), SAME_TOO.values())


def arrays_of(output: Path) -> dict[str, np.ndarray]:
    """Return the history and, under names with an @, the pictures of the interface."""
    with np.load(output / "history.npz") as history, np.load(output / "interface.npz") as interface:
        return {**history, **interface}


@pytest.fixture(scope="module")
def assembly(tmp_path_factory) -> Path:
    """Return a folder with the meshes of the small package."""
    directory = tmp_path_factory.mktemp("assembly")
    write_small_assembly(directory)
    return directory


def assert_same(first: dict[str, np.ndarray], second: dict[str, np.ndarray]) -> None:
    """Check that two runs have equal histories and pictures, up to rounding."""
    pictures = [name for name in first if "@" in name]
    assert len(pictures) == 12 + 4 + 2  # of the interface, of a watch point, of two gauges
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


@pytest.mark.parametrize("name", SAME)
def test_results_are_the_same_on_other_ranks(runs, name):
    assert_same(*(scene.history(runs) for scene in SAME[name]))


@pytest.mark.long
@pytest.mark.parametrize("name", SAME_TOO)
def test_results_are_the_same_on_more_ranks(more_runs, name):
    assert_same(*(scene.history(more_runs) for scene in SAME_TOO[name]))


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
    run_warm([str(script)], 2)


def fails(directory: Path, ranks: int, message: str, **changes) -> None:
    """Check that a run with changed keys of its input fails on some ranks with a message."""
    done = run_program(write_input(directory / "input.json", directory, **changes), ranks)
    assert done.returncode == 1
    assert message in done.stderr


def test_wrong_number_of_ranks_ends_the_run(assembly):
    shock = SHOCK | {"ranks": {"total": 2}}
    fails(assembly, 3, "asks for 2 ranks (ranks.total), mpirun started 3", mode="two_scale", shock=shock)


def test_missing_mesh_ends_all_ranks(assembly):
    fails(assembly, 2, "nowhere.msh", meshes=["nowhere.msh"])


@pytest.mark.long
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
    """A rank that fails outside any agreement aborts the others."""
    script = tmp_path / "crash.py"
    script.write_text(
        "import sys\n"
        "from mpi4py import MPI\n"
        "from reflowshock.fem.coupling import held_velocity; from reflowshock.fem.run import program\n"
        "def broken(self): raise ZeroDivisionError('broken rank')\n"
        "held_velocity.HeldVelocityMeso.begin_window = broken\n"
        "sys.exit(program.main(MPI.COMM_WORLD, sys.argv[1:]))\n"
    )
    path = write_input(tmp_path / "input.json", assembly, mode="two_scale", output=str(tmp_path))
    done = run_python([str(script), str(path)], 2)
    assert done.returncode != 0
    assert "broken rank" in done.stderr
