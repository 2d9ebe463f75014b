"""The shipped example of a user material, shortened, moves equally on one rank and on two."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.fem_program import run_warm

EXAMPLE = Path(__file__).resolve().parents[2] / "cases/own_material/own_material.py"


def own_material(path: Path, ranks: int) -> dict[str, np.ndarray]:
    """Return the histories of the first 0.05 ms of the example."""
    done = run_warm([str(EXAMPLE), str(path), "0.05"], ranks)
    assert "viscoelastic" in done.stdout
    with np.load(path) as arrays:
        return dict(arrays)


@pytest.mark.long
def test_two_ranks_equal_one(tmp_path):
    expected, actual = (own_material(tmp_path / f"{ranks}.npz", ranks) for ranks in (1, 2))
    assert len(expected["time"]) > 10
    for name, values in expected.items():
        scale = np.abs(expected[name if name in ("time", "part") else "given"]).max()
        assert np.abs(values).max() > 0.0
        assert np.abs(actual[name] - values).max() <= 1e-9 * scale, name
