"""Bitwise restart of interrupted structure runs for each solver, law and kind of state."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.run import time_loop
from reflowshock.fem.run.structure import run_structure
from tests.support.fem_structures import STEEL, structure_input

NUMERICS = {"history_samples": 20, "field_samples": 3, "checkpoint_seconds": 1e-9}
DYNAMICS = {"duration": 2e-5, "numerics": NUMERICS}
WEAK = STEEL | {"plasticity": {"A": 2e6, "B": 1e8, "n": 0.5, "C": 0.05, "reference_rate": 1.0}}
DROP = {"kind": "input_g", "peak": 1e5, "duration": 4e-5}
SCENES = {
    "implicit": {"solver": "implicit", "dynamics": DYNAMICS | {"solver": "implicit"}},
    "plastic": {"materials": {"steel": WEAK}, "loads": {"drop": DROP}, "dynamics": DYNAMICS},
    "finite": {"dynamics": DYNAMICS | {"kinematics": "finite"}},
    "large_mass": {"loads": {"drop": DROP | {"method": "large_mass"}, "weight": {"kind": "gravity"}}},
    "loads": {
        "loads": {
            "push": {"kind": "pressure", "on": "z_max", "peak": 1e5, "pulse": "constant"},
            "shake": {"kind": "motion", "on": "x_max", "component": "z", "peak": 1.0, "duration": 4e-5},
        },
        "dynamics": DYNAMICS | {"damping": {"stiffness_coefficient": 1e-8, "mass_coefficient": 100.0}},
    },
}


class Killed(Exception):
    """Exception in place of a kill."""


@pytest.mark.parametrize("name", SCENES)
def test_broken_run_continues_to_the_same_bits(tmp_path, monkeypatch, name):
    histories = []
    for folder in ("whole", "broken"):
        (tmp_path / folder).mkdir()
        request = structure_input(tmp_path / folder, **{"dynamics": DYNAMICS} | SCENES[name])
        if folder == "broken":
            request = request.model_copy(update={"checkpoints": tmp_path / "checkpoints"})
            with monkeypatch.context() as patch:
                patch.setattr(time_loop, "run_window", run_some_windows(11))
                with pytest.raises(Killed):
                    run_structure(MPI.COMM_SELF, request)
        run_structure(MPI.COMM_SELF, request)
        with np.load(request.output / "history.npz") as arrays:
            histories.append(dict(arrays))
    whole, broken = histories
    assert len(whole["time"]) == 21
    assert np.abs(whole["internal"]).max() > 0
    if name == "plastic":
        assert whole["plastic"][-1] > 0
    assert whole.keys() == broken.keys()
    for key, values in whole.items():
        assert np.array_equal(values, broken[key]), key
    for path in sorted((tmp_path / "whole/out").glob("*.vtu")):
        assert path.read_bytes() == (tmp_path / "broken/out" / path.name).read_bytes(), path.name


def run_some_windows(count: int):
    """Return a replacement of ``run_window`` that stops after ``count`` windows."""
    left = iter(range(count))
    real = time_loop.run_window

    def run_window(participants, stopwatch) -> None:
        if next(left, None) is None:
            raise Killed
        real(participants, stopwatch)

    return run_window
