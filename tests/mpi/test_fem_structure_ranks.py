"""A structure has equal results on one and on two ranks, and an error ends both."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.fem_program import run_program, run_programs
from tests.support.fem_structures import LENGTH, WIDTH, strip_mesh, structure_tables_of, write_structure

LOADS = {
    "drop": {"kind": "input_g", "peak": 1e4, "duration": 4e-5, "direction": [0.0, 0.0, 1.0]},
    "push": {"kind": "pressure", "on": "z_max", "peak": 1e5, "pulse": "constant"},
    "pull": {"kind": "motion", "on": "x_max", "component": "x", "peak": 0.1, "duration": 4e-5},
    "poke": {"kind": "point_force", "at": [1e-4, 1e-3, 7e-4], "direction": [1.0, 2.0, 3.0], "peak": 20.0}
    | {"duration": 4e-5},  # in an element next to the middle, shared by both ranks
}
SUPPORTS = {
    "clamp": {"on": "x_min", "hold": ["x", "y", "z"]},
    "foot": {"on": "z_min", "bedding": {"y": 1e11, "z": 1e12}},
}
MASSES = {
    "lid": {"mass": 1e-3, "at": [1e-4, 1e-3, 1e-3], "footprint": [6e-3, 3e-3]},
    "pin": {"mass": 1e-4, "at": [1e-4, 1e-3, 7e-4]},
}
WATCH = {
    "tip": {"at": [LENGTH / 2, 0.0, 0.0]},
    "middle": {"at": [0.0, WIDTH / 6, 1e-3]},
    "side": {"at": [LENGTH / 4, WIDTH / 2, 1e-3]},
}
DYNAMICS = {
    "duration": 5e-5,
    "damping": {"mass_ratio": 0.01, "stiffness_ratio": 0.01, "frequency": 1e4},
    "numerics": {"history_samples": 20, "field_samples": 2, "implicit_step": 5e-6},
}
FINITE = DYNAMICS | {"duration": 1e-5, "kinematics": "finite", "damping": {"mass_coefficient": 100.0}}


LONGER = structure_tables_of()["structure"] | {"length": 1.2 * LENGTH}  # longer than the mesh
OUTSIDE = {"kind": "point_force", "at": [0.55 * LENGTH, 0.0, 0.0], "direction": [0.0, 0.0, 1.0], "peak": 1.0}
OUTSIDE |= {"pulse": "constant"}
CRUSHED = {
    "loads": {"push": {"kind": "pressure", "on": "z_max", "peak": 1e12, "pulse": "constant"}},
    "dynamics": {"duration": 1e-4, "kinematics": "finite"},
}


def written(directory: Path, solver: str, dynamics: dict) -> Path:
    """Return the input of a run in a new directory."""
    directory.mkdir()
    tables = {"solver": solver, "loads": LOADS, "watch": WATCH, "dynamics": dynamics}
    return write_structure(directory, **tables, supports=SUPPORTS, masses=MASSES)


def history(directory: Path, ranks: int) -> dict[str, np.ndarray]:
    """Return the arrays of a history, name -> samples, after a check of the number of ranks."""
    result = json.loads((directory / "out" / "result.json").read_text())
    assert result["model"]["ranks"] == ranks
    with np.load(directory / "out" / "history.npz") as arrays:
        return {name: array for name, array in arrays.items() if array.dtype.kind == "f"}


@pytest.mark.parametrize(
    ("solver", "dynamics"),
    [("explicit", DYNAMICS), ("implicit", DYNAMICS), pytest.param("explicit", FINITE, marks=pytest.mark.long)],
)
def test_two_ranks_give_what_one_gives(tmp_path, solver, dynamics):
    run_programs([(ranks, written(tmp_path / f"{ranks}", solver, dynamics)) for ranks in (1, 2)])
    single, double = (history(tmp_path / f"{ranks}", ranks) for ranks in (1, 2))
    assert np.abs(single["reaction@clamp"]).max() > 0.0 and np.abs(single["reaction@foot"][:, 1:]).max() > 0.0
    for name in single.keys() - {"balance"}:
        scale = single["internal" if name == "hourglass" else name]  # small for full integration
        assert np.abs(single[name] - double[name]).max() <= 1e-8 * np.abs(scale).max(), name


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"watch": {"far": {"at": [1.0, 0.0, 0.0]}}}, "lies 0.99 m outside"),
        pytest.param(
            {"supports": {"clamp": {"on": "mounting_holes", "hold": ["x"]}}},
            "no such facet set",
            marks=pytest.mark.long,
        ),
        pytest.param(
            {"structure": LONGER, "loads": {"poke": OUTSIDE}},
            "loads.poke.at = (0.011, 0, 0) m lies outside the mesh",
            marks=pytest.mark.long,
        ),
        (CRUSHED, "m, is turned inside out"),
    ],
)
def test_error_ends_both_ranks(tmp_path, changes, message):
    done = run_program(write_structure(tmp_path, **changes), 2)
    assert done.returncode == 1
    assert message in done.stderr


def test_more_ranks_than_elements(tmp_path):
    done = run_program(write_structure(tmp_path, strip_mesh((2, 1, 1)), watch={}), 4)
    assert done.returncode == 1
    assert "a rank has no element of the mesh; use fewer ranks" in done.stderr
