"""Large elastic compression without growth of any element mode."""

import json
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.run.structure import run_structure
from tests.support.fem_structures import LENGTH, STEEL, structure_input, structure_tables_of

DURATION = 4e-4
SIDES = {side: {"on": side, "hold": [side[0]]} for side in ("x_min", "y_min", "y_max", "z_min", "z_max")}


def compressed(directory: Path, stretch: float, formulation: str) -> dict:
    """Compress a soft bar in a rigid channel to a fraction of its length and return the result."""
    speed = 0.5 * np.pi * LENGTH * (1.0 - stretch) / DURATION
    request = structure_input(
        directory,
        supports=SIDES,
        materials={"steel": STEEL | {"young_modulus": 2e9}},
        structure=structure_tables_of()["structure"] | {"formulation": formulation},
        loads={"push": {"kind": "motion", "on": "x_max", "component": "x", "peak": -speed, "duration": DURATION}},
        dynamics={
            "duration": 1.5 * DURATION,
            "kinematics": "finite",
            "numerics": {"history_samples": 100, "field_samples": 2, "energy_balance_limit": 10.0},
        },
    )
    run_structure(MPI.COMM_SELF, request)
    return json.loads((request.output / "result.json").read_text())


@pytest.mark.parametrize("formulation", ["one_point", "incompatible_modes"])
def test_elements_survive_compression_to_half_the_length(tmp_path, formulation):
    """Unstable elements show spurious mode growth in this test (Wriggers & Reese, CMAME 135, 1996)."""
    health = compressed(tmp_path, 0.5, formulation)["health"]
    assert health["energy_balance_error"]["value"] < 1e-4
    if formulation == "incompatible_modes":
        assert health["hourglass_energy_fraction"]["value"] < 1e-5
