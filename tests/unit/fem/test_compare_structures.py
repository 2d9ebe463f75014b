"""Comparison of histories of two solvers at common times."""

import numpy as np
import pytest

from reflowshock.fem.output.compare_structures import solver_differences


def history(samples: int, scale: float = 1.0, names: tuple[str, ...] = ("tip",), end: float = 1.0) -> dict:
    """Return an oscillation of amplitude ``scale`` at the first point and a thousandth of it at others."""
    time = np.linspace(0.0, end, samples + 1)
    result = {"time": time, "watch": np.array(names)}
    for k, name in enumerate(names):
        wave = (scale if k == 0 else 1e-3) * np.sin(7.0 * time)[:, None]
        result |= {f"displacement@{name}": wave * np.ones(3), f"strain@{name}": wave * np.ones(6)}
    return result


def test_differences_are_relative_to_the_second():
    differences = solver_differences(history(100, 1.02), history(100))
    assert differences["displacement_difference@tip"] == pytest.approx(0.02)
    assert differences["strain_difference"] == pytest.approx(0.02)


def test_other_sample_times_are_interpolated():
    differences = solver_differences(history(100, 1.02), history(73))
    assert differences["displacement_difference"] == pytest.approx(0.02, rel=1e-3)


def test_point_that_hardly_moves_counts_for_little():
    ours, reference = history(50, names=("tip", "root")), history(50, names=("tip", "root"))
    ours["displacement@root"] = 2.0 * ours["displacement@root"]
    differences = solver_differences(ours, reference)
    assert differences["displacement_difference@root"] == pytest.approx(1.0)
    assert differences["displacement_difference"] == pytest.approx(1e-3, rel=1e-3)


@pytest.mark.parametrize("other", [{"names": ("root",)}, {"end": 1.1}])
def test_what_does_not_belong_together_is_refused(other):
    with pytest.raises(ValueError, match="cannot be compared"):
        solver_differences(history(10), history(10, **other))
