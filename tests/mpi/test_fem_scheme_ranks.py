"""Coupling schemes through the program: equal on one rank and on three, close to held velocity, balanced."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.fem_models import write_small_assembly
from tests.support.fem_program import run_programs

SHOCK = {
    "peak_acceleration": 14709.975,
    "pulse_duration": 5e-4,
    "duration": 1e-5,
    "numerics": {"kinematics": "small", "mass_scaled": ["copper"], "history_samples": 25, "field_samples": 2},
}
WATCHED = ("board_centre", "die_centre", "von_mises_board", "von_mises_package", "board_strain")


@pytest.fixture(scope="module")
def assembly(tmp_path_factory) -> Path:
    """Return a folder with the meshes of the small package."""
    directory = tmp_path_factory.mktemp("assembly")
    write_small_assembly(directory)
    return directory


def histories(directory: Path, *runs: tuple[str, dict]) -> list[dict[str, np.ndarray]]:
    """Return the histories of schemes on their ranks."""
    inputs = [(ranks["total"], write_input(directory, scheme, ranks)) for scheme, ranks in runs]
    run_programs(inputs)
    return [history(path.with_suffix("")) for _, path in inputs]


def write_input(directory: Path, scheme: str, ranks: dict) -> Path:
    """Write the input of a run with a coupling scheme on some ranks; return its path."""
    output = directory / f"{scheme}_{ranks['total']}"
    shock = SHOCK | {"coupling": {"scheme": scheme}, "ranks": ranks}
    meshes = [str(directory / "assembly.msh"), str(directory / "joints.msh")]
    path = output.with_suffix(".json")
    request = {"mode": "two_scale", "meshes": meshes, "shock": shock, "output": str(output)}
    path.write_text(json.dumps(request | {"materials": {"solder": "SAC405_elastic"}}))
    return path


def history(output: Path) -> dict[str, np.ndarray]:
    """Return the history of a run, name -> samples, after a check of its health."""
    result = json.loads((output / "result.json").read_text())
    assert all(check["ok"] for check in result["health"].values())
    assert result["model"]["substeps"] > 1
    with np.load(output / "history.npz") as arrays:
        return dict(arrays)


def difference(first: dict[str, np.ndarray], second: dict[str, np.ndarray]) -> float:
    """Return the largest difference of watched arrays over their largest value."""
    return max(float(np.abs(first[name] - second[name]).max() / np.abs(first[name]).max()) for name in WATCHED)


@pytest.mark.parametrize("scheme", ["gravouil_combescure", pytest.param("impulse", marks=pytest.mark.long)])
def test_a_scheme_is_the_same_on_more_ranks_and_close_to_held_velocity(assembly, scheme):
    alone, apart = {"total": 1, "placement": "shared"}, {"total": 3, "placement": "disjoint", "macro": 1}
    single_rank, three_ranks, held_velocity = histories(
        assembly, (scheme, alone), (scheme, apart), ("held_velocity", alone)
    )
    assert difference(single_rank, three_ranks) <= 1e-8
    assert np.abs(single_rank["balance"]).max() <= 1e-3 * np.abs(single_rank["external"]).max()
    assert difference(single_rank, held_velocity) <= 0.02
