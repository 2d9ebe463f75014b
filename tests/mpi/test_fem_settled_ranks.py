"""A shock of automatic duration ends at the same window when it is continued, on any number of ranks."""

import json
from pathlib import Path

import numpy as np

from reflowshock.fem.output.settled import is_settled
from tests.support.fem_models import write_small_assembly
from tests.support.fem_program import run_programs

LONGEST = 1.2e-4
NUMERICS = {"kinematics": "small", "mass_scaled": ["copper"], "history_samples": 60, "field_samples": 3}
NUMERICS |= {"checkpoint_seconds": 0.02}


def pulse(time: float) -> float:
    """Return an upward acceleration [m/s^2] for 10 us and a downward one for 20 us, so that the board soon returns."""
    return 1e5 * np.sin(np.pi * time / 1e-5) if time < 1e-5 else -6e4 * np.sin(np.pi * (time - 1e-5) / 2e-5)


def written(meshes: list[Path], name: str, ranks: int) -> Path:
    """Return the input of a run that ends when it has settled and continues from existing checkpoints."""
    folder = meshes[0].parent
    table, shock = folder / "pulse.csv", {"duration": LONGEST, "numerics": NUMERICS, "ranks": {"total": ranks}}
    rows = (f"{time:.9g},{pulse(time):.9g}" for time in np.linspace(0.0, 3e-5, 61))
    table.write_text("\n".join(["time [s],acceleration [m/s^2]", *rows]))
    request = {
        "mode": "dns", "meshes": [str(path) for path in meshes], "settles": True, "output": str(folder / name),
        "shock": shock | {"table": str(table)}, "checkpoints": str(folder / "kept"),
    }  # fmt: skip
    path = folder / f"{name}.json"
    path.write_text(json.dumps(request))
    return path


def outcome(output: Path) -> tuple[dict[str, np.ndarray], dict]:
    """Return history and result of a run."""
    with np.load(output / "history.npz") as arrays:
        return dict(arrays), json.loads((output / "result.json").read_text())


def test_it_ends_at_the_same_window_after_a_restart_and_on_two_ranks(tmp_path):
    meshes = write_small_assembly(tmp_path)
    runs = {"one": 1, "again": 1, "two": 2}
    run_programs([(ranks, written(meshes, name, ranks)) for name, ranks in runs.items()])
    history, result = outcome(tmp_path / "one")
    end = history["time"][-1]
    assert end < 0.9 * LONGEST and result["metrics"]["simulated_time"]["value"] == end
    assert np.isclose(result["model"]["window"] * result["model"]["windows"], end)
    assert is_settled(history)
    rows = history["time"].shape
    before = {name: values[:-1] for name, values in history.items() if values.shape[:1] == rows}
    assert not is_settled(before)
    for name in ("again", "two"):
        continued, other = outcome(tmp_path / name)
        assert other["continued_from"] > 0
        assert other["model"]["windows"] == result["model"]["windows"]
        scale = np.abs(history["von_mises_board"]).max()
        assert np.abs(continued["von_mises_board"] - history["von_mises_board"]).max() <= 1e-8 * scale
