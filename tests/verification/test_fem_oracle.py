"""The bare JEDEC board under 1500 G: explicit against implicit steps, both through the program."""

import json
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.output.compare_structures import solver_differences
from reflowshock.fem.run.structure import run_structure
from tests.support.fem_structures import structure_input

X, Y, Z = 66e-3, 38.5e-3, 1e-3
HOLE = (52.5e-3, 35.5e-3)


def quarter_board() -> MeshData:
    """Return a quarter of the board, fixed at the top and bottom facets within 2.5 mm of the hole axis.

    It has two layers, because one layer only resolves the neutral plane, where the bending strain is zero.
    """
    points, cells = grid(np.linspace(0, X, 23), np.linspace(0, Y, 14), [0, Z / 2, Z])
    sides = {"x_min": on(0, 0.0), "x_max": on(0, X), "y_min": on(1, 0.0), "y_max": on(1, Y)}
    faces = {"z_min": on(2, 0.0), "z_max": on(2, Z)}
    hole = {"mounting_holes": lambda c: (np.hypot(*(c[:, :2] - HOLE).T) < 2.5e-3) & (c[:, 2] % Z < 1e-9)}
    return mesh_of(points, cells, "board", sides | faces | hole)


def drop(directory: Path, solver: str) -> tuple[dict, Path]:
    """Run the board with a solver; return its result and the path of its history."""
    directory.mkdir()
    request = structure_input(
        directory,
        quarter_board(),
        solver=solver,
        structure={
            "length": 2 * X,
            "width": 2 * Y,
            "cells": [22, 13],
            "symmetry": ["x", "y"],
            "layers": {"board": {"material": "FR4", "thickness": Z, "cells": 2}},
            "holes": {"spacing": [2 * HOLE[0], 2 * HOLE[1]], "diameter": 3e-3},
        },
        supports={"holes": {"on": "mounting_holes", "hold": ["x", "y", "z"]}},
        loads={"drop": {"kind": "input_g", "service_condition": "B"}},
        watch={"centre": {"at": [0.0, 0.0, 0.0]}},
        dynamics={
            "duration": 2e-3,
            "modes": 3,
            "numerics": {"history_samples": 200, "field_samples": 2, "implicit_step": 5e-6},
        },
    )
    run_structure(MPI.COMM_SELF, request)
    return json.loads((request.output / "result.json").read_text()), request.output


def test_explicit_and_implicit_steps_agree(tmp_path):
    (explicit, first), (implicit, second) = (drop(tmp_path / name, name) for name in ("explicit", "implicit"))
    with np.load(first / "history.npz") as ours, np.load(second / "history.npz") as reference:
        differences = solver_differences(dict(ours), dict(reference))
    assert differences["displacement_difference@centre"] <= 0.01
    assert differences["strain_difference@centre"] <= 0.01
    for result in (explicit, implicit):
        assert all(check["ok"] for check in result["health"].values())
    assert implicit["metrics"]["energy_balance_error"]["value"] < 1e-9
    modes = json.loads((first / "modes.json").read_text())
    assert modes[0]["frequency"] == pytest.approx(280.0, rel=0.25)
