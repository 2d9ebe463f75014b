"""Histories of two solvers are compared at common times."""

from pathlib import Path

import numpy as np
import pytest

from fem.compare_structures import compare_structures


def write(path: Path, samples: int, scale: float = 1.0, name: str = "tip", end: float = 1.0) -> Path:
    time = np.linspace(0.0, end, samples + 1)
    wave = scale * np.sin(7.0 * time)[:, None]
    arrays = {f"displacement@{name}": wave * np.ones(3), f"strain@{name}": wave * np.ones(6)}
    np.savez(path, time=time, watch=np.array([name]), **arrays)
    return path


def test_errors_are_relative_to_the_second(tmp_path):
    errors = compare_structures(write(tmp_path / "a.npz", 100, 1.02), write(tmp_path / "b.npz", 100))
    assert errors == {"displacement_error@tip": pytest.approx(0.02), "strain_error@tip": pytest.approx(0.02)}


def test_other_sample_times_are_interpolated(tmp_path):
    errors = compare_structures(write(tmp_path / "a.npz", 100, 1.02), write(tmp_path / "b.npz", 73))
    assert errors["displacement_error@tip"] == pytest.approx(0.02, rel=1e-3)


@pytest.mark.parametrize("other", [{"name": "root"}, {"end": 1.1}])
def test_what_does_not_belong_together_is_refused(tmp_path, other):
    with pytest.raises(ValueError, match="cannot be compared"):
        compare_structures(write(tmp_path / "a.npz", 10), write(tmp_path / "b.npz", 10, **other))
