"""Errors agreed by all ranks, and the message with the restart point."""

import json

import pytest
from mpi4py import MPI

from reflowshock.fem.errors import AgreedError, EnergyError, RankError
from reflowshock.fem.run import time_loop
from reflowshock.fem.run.program import main
from tests.support.fem_structures import write_structure

NUMERICS = {"history_samples": 20, "field_samples": 2, "checkpoint_seconds": 1e-9}


@pytest.mark.parametrize("error", [AgreedError, EnergyError, RankError])
@pytest.mark.parametrize("begun", [True, False])
def test_error_of_all_ranks_names_the_latest_checkpoint(tmp_path, monkeypatch, capsys, error, begun):
    path = write_structure(tmp_path, dynamics={"duration": 2e-5, "numerics": NUMERICS})
    checkpoints = tmp_path / "checkpoints"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"checkpoints": str(checkpoints)}))
    left, run_window = iter(range(3 if begun else 0)), time_loop.run_window

    def some_windows(*participants) -> None:
        if next(left, None) is None:
            raise error("wrong")
        run_window(*participants)

    monkeypatch.setattr(time_loop, "run_window", some_windows)
    monkeypatch.setattr(time_loop.Checkpoints, "is_due", lambda self: begun)
    assert main(MPI.COMM_SELF, [str(path)]) == 1
    (folder,) = checkpoints.iterdir()
    where = f"last checkpoint: {folder} (window 3, time" if begun else "there is no checkpoint yet"
    assert capsys.readouterr().err.startswith(f"error: wrong; {where}")
    assert not list((tmp_path / "out").glob(".watchdog*"))
