"""Plastic structures: plastic strain in histories and fields, and bitwise restart."""

import json
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.dynamics.history import History
from reflowshock.fem.run.structure import run_structure
from tests.support.fem_structures import LENGTH, STEEL, THICKNESS, WIDTH, structure_input

YIELD, SLOPE = 2e8, 2e9
SPEED = 0.5
PULLED = {
    "materials": {"steel": STEEL | {"poisson_ratio": 0.0, "plasticity": {"A": YIELD, "B": SLOPE, "n": 1.0}}},
    "supports": {axis: {"on": f"{axis}_min", "hold": [axis]} for axis in "xyz"},
    "loads": {"pull": {"kind": "motion", "on": "x_max", "component": "x", "peak": SPEED, "duration": 3e-4}},
    "watch": {"middle": {"at": [0.0, WIDTH / 6, THICKNESS]}},
    "dynamics": {
        "duration": 3e-4,
        "damping": {"mass_ratio": 0.02, "frequency": 6e4},
        "numerics": {"history_samples": 12, "field_samples": 4, "checkpoint_seconds": 1e-9},
    },
}


def run(directory: Path, **changes) -> tuple[dict, dict[str, np.ndarray]]:
    """Run a structure in a folder with optional checkpoints; return its result and history."""
    directory.mkdir(exist_ok=True)
    request = structure_input(directory, **(PULLED | changes))
    request = request.model_copy(update={"checkpoints": directory / "checkpoints"})
    run_structure(MPI.COMM_SELF, request)
    with np.load(request.output / "history.npz") as arrays:
        return json.loads((request.output / "result.json").read_text()), dict(arrays)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> tuple[Path, dict, dict[str, np.ndarray]]:
    """Return folder, result and history of a run without interruption."""
    directory = tmp_path_factory.mktemp("plastic") / "whole"
    return directory, *run(directory)


def test_stress_follows_strain_on_the_yield_line(whole):
    """With free lateral contraction, stress = A + B p and strain = stress / E + p under increasing load."""
    _, result, history = whole
    strain, stress = history["strain@middle"][-1, 0], history["stress@middle"][-1, 0]
    plastic = history["plastic_strain@middle"][-1, 0]
    end = 2 / np.pi * SPEED * 3e-4 / LENGTH
    assert strain == pytest.approx(end, rel=0.05)
    assert stress == pytest.approx(YIELD + SLOPE * plastic, rel=5e-3)
    assert strain == pytest.approx(stress / STEEL["young_modulus"] + plastic, rel=5e-3)
    why = "board yields from 200 MPa on, hardening 2000 MPa p^1"
    assert result["effects"]["plasticity"] == {"on": True, "why": why}
    assert result["metrics"]["peak_plastic_strain@middle"]["value"] == pytest.approx(plastic, rel=1e-9)
    assert result["metrics"]["peak_element_plastic_strain@board"]["value"] > plastic * 0.99
    assert result["metrics"]["peak_plastic_energy"]["value"] > 0.0


def test_interrupted_run_continues_to_the_same_bits(whole, tmp_path, monkeypatch):
    reference, _, history = whole
    sample, calls = History.sample, []

    def broken(self, participants):
        calls.append(1)
        if len(calls) > 7:
            raise KeyboardInterrupt
        sample(self, participants)

    monkeypatch.setattr(History, "sample", broken)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "whole")
    monkeypatch.undo()
    result, again = run(tmp_path / "whole")
    assert result["continued_from"] * result["model"]["samples"] == 6 * result["model"]["windows"]
    for name, values in history.items():
        assert np.array_equal(values, again[name]), name
    fields = sorted(path.name for path in (reference / "out").glob("*.vtu"))
    assert len(fields) == 4
    for name in fields:
        assert (reference / "out" / name).read_bytes() == (tmp_path / "whole" / "out" / name).read_bytes(), name


def test_implicit_solver_refuses_what_yields(tmp_path):
    from reflowshock.fem.problem.structure_checks import check

    with pytest.raises(ValueError, match="yields, but the solver implicit is linear"):
        check(structure_input(tmp_path, **(PULLED | {"dynamics": {"duration": 1e-4, "solver": "implicit"}})))
