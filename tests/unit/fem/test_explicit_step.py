"""A user-defined step: accepted below the critical step, rejected above it with both values."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.dynamics.energy_balance import EnergyBalance
from reflowshock.fem.errors import StepError
from reflowshock.fem.run.structure import run_structure
from reflowshock.fem.run.time_loop import GUARD
from reflowshock.fem.setup.structure_models import build_structure
from tests.support.fem_structures import structure_input


def steps_of(directory, **numerics):
    """Return the steps of the clamped strip with changed numerics."""
    request = structure_input(directory, dynamics={"duration": 8e-5, "numerics": {"history_samples": 40} | numerics})
    return build_structure(MPI.COMM_SELF, request, [])[1]


def test_given_step_is_taken_or_refused(tmp_path):
    critical = steps_of(tmp_path).smallest
    taken = steps_of(tmp_path, explicit_step=0.5 * critical)
    assert 0.4 * critical < taken.plan.step <= 0.5 * critical
    with pytest.raises(StepError, match=r"explicit_step = .* is above the critical step .* \(element\)"):
        steps_of(tmp_path, explicit_step=1.003 * critical)
    larger = steps_of(tmp_path, critical_step="power_iteration")
    assert larger.smallest > 1.003 * critical
    steps_of(tmp_path, critical_step="power_iteration", explicit_step=1.003 * critical)
    with pytest.raises(StepError, match=r"explicit_step = .* \(power_iteration\)"):
        steps_of(tmp_path, critical_step="power_iteration", explicit_step=1.01 * larger.smallest)


def test_energies_are_looked_at_between_samples_that_are_far_apart(tmp_path, monkeypatch):
    numerics = {"history_samples": 2, "field_samples": 2}
    request = structure_input(tmp_path, dynamics={"duration": 8e-5, "numerics": numerics})
    steps, looked = build_structure(MPI.COMM_SELF, request, [])[1].plan, []
    judge = EnergyBalance.judge
    monkeypatch.setattr(
        EnergyBalance, "judge", lambda self, sums, time: (looked.append(time), judge(self, sums, time))[1]
    )
    run_structure(MPI.COMM_SELF, request)
    with np.load(request.output / "history.npz") as arrays:
        assert len(arrays["time"]) == 3
    assert steps.windows * steps.substeps > 1000
    assert max(np.diff(looked)) / steps.step <= GUARD + 0.5
