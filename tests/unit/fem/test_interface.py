"""Pictures of the upper joint interface, and a DNS that ends before the shock."""

import json
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.grids import COPPER, GAP
from reflowshock.fem.estimates.estimate import WindowPlan, shorten_plan
from reflowshock.fem.output.compare import compare_histories
from reflowshock.fem.output.joint_interface import picture_windows
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.problem.shock import Shock
from reflowshock.fem.problem.shock_checks import problems
from reflowshock.fem.run import time_loop
from reflowshock.fem.run.package import run_package
from reflowshock.materials.roles import ELASTIC
from tests.support.fem_models import SITES, write_small_assembly

TIMES = 4e-6, 1e-5
NUMERICS = {"kinematics": "small", "mass_scaled": ["copper"], "history_samples": 20, "field_samples": 2}
SHOCK = {
    "peak_acceleration": 14709.975,
    "pulse_duration": 5e-4,
    "duration": 1e-5,
    "picture_times": TIMES,
    "ranks": {"total": 1},
}


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> Path:
    """Return a folder with the meshes of the small package."""
    directory = tmp_path_factory.mktemp("interface")
    write_small_assembly(directory)
    return directory


def results(files: Path, name: str, mode: str, numerics: dict | None = None, **changes) -> Path:
    """Run a mode with changed numerics; return the folder of its results."""
    output = files / name
    output.mkdir(exist_ok=True)
    shock = SHOCK | {"numerics": NUMERICS | (numerics or {})}
    meshes = (files / "assembly.msh", files / "joints.msh")
    request = RunInput(mode=mode, meshes=meshes, materials=ELASTIC, shock=shock, output=output, **changes)
    run_package(MPI.COMM_SELF, request)
    return output


def arrays(path: Path) -> dict[str, np.ndarray]:
    """Return the arrays of an NPZ file by name."""
    with np.load(path) as archive:
        return dict(archive)


@pytest.fixture(scope="module")
def two_scale(files) -> Path:
    """Return the folder with the results of a run with two scales."""
    return results(files, "two_scale", "two_scale")


def test_pictures_are_the_history_at_their_times(two_scale):
    """Pictures show element means: none exceeds the history maximum, and their mean is near the package layer."""
    pictures, history = arrays(two_scale / "interface.npz"), arrays(two_scale / "history.npz")
    assert pictures["times"] == pytest.approx(TIMES)
    for k, name in enumerate(history["joints"]):
        for time, values in zip(TIMES, pictures[f"von_mises@{name}"], strict=True):
            sample = int(np.argmin(np.abs(history["time"] - time)))
            assert 0.0 < values.max() <= history["von_mises_max"][sample, k] * (1.0 + 1e-12)
            assert values.mean() == pytest.approx(history["von_mises_package"][sample, k], rel=0.2)


def test_facets_lie_at_the_package(two_scale):
    pictures = arrays(two_scale / "interface.npz")
    for name, (x, y) in SITES.items():
        points, quads = pictures[f"points@{name}"], pictures[f"quads@{name}"]
        assert points.shape == (16, 3)
        assert np.allclose(points[:, 2], COPPER + GAP)
        assert np.allclose(points.mean(axis=0)[:2], (x, y))
        corners = points[quads]
        area = 0.5 * np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1)
        assert area.sum() == pytest.approx(0.4e-3**2)


@pytest.mark.parametrize("solver", ["explicit", pytest.param("implicit", marks=pytest.mark.long)])
def test_dns_that_ends_early_is_the_beginning_of_the_whole(files, two_scale, solver):
    whole = results(files, f"{solver}", "dns", {"dns_solver": solver})
    part = results(files, f"{solver}_part", "dns", {"dns_solver": solver, "dns_duration": 4.6e-6})
    first, second = arrays(whole / "history.npz"), arrays(part / "history.npz")
    assert second["time"][-1] == pytest.approx(5e-6)  # the next sample
    assert np.array_equal(first["von_mises_board"][: len(second["time"])], second["von_mises_board"])
    assert arrays(part / "interface.npz")["times"] == pytest.approx(TIMES[:1])
    comparisons = [compare_histories(two_scale / "history.npz", dns / "history.npz") for dns in (whole, part)]
    assert comparisons[0]["critical_joint"] == comparisons[1]["critical_joint"]
    assert 0.0 < comparisons[1]["critical_joint_stress_error"] < 1.0
    assert comparisons[1]["compared_duration"] == pytest.approx(5e-6)
    assert "compared_duration" not in comparisons[0]
    result = json.loads((part / "result.json").read_text())
    assert 5e7 < result["metrics"]["peak_memory"]["value"] < 5e9
    model = result["model"]
    assert model["window"] * model["windows"] == pytest.approx(5e-6)
    with pytest.raises(ValueError, match="different sample times"):
        compare_histories(part / "history.npz", two_scale / "history.npz")


class Killed(Exception):
    """Exception in place of a kill."""


def test_broken_run_has_the_same_pictures(files, two_scale, monkeypatch):
    real, left = time_loop.run_window, iter(range(80))

    def run_window(participants, stopwatch) -> None:
        if next(left, None) is None:
            raise Killed
        real(participants, stopwatch)

    changes = {"checkpoints": files / "checkpoints", "numerics": {"checkpoint_seconds": 1e-9}}
    with monkeypatch.context() as patch:
        patch.setattr(time_loop, "run_window", run_window)
        with pytest.raises(Killed):
            results(files, "broken", "two_scale", **changes)
    broken = arrays(results(files, "broken", "two_scale", **changes) / "interface.npz")
    assert json.loads((files / "broken/result.json").read_text())["continued_from"] > 0
    for name, values in arrays(two_scale / "interface.npz").items():
        assert np.array_equal(values, broken[name]), name


def test_windows_of_pictures_are_the_nearest():
    plan = WindowPlan(window=1e-7, substeps=3, windows=100, stride=10)
    assert picture_windows((0.0, 4.04e-7, 1e-5, 2e-5), plan) == {0, 4, 100}


def test_shortened_plans_end_at_samples():
    plan = WindowPlan(window=1e-7, substeps=3, windows=100, stride=10)
    assert [shorten_plan(plan, time).windows for time in (1e-9, 1e-6, 1.01e-6, 1e-5, 1.0)] == [10, 10, 20, 100, 100]


def test_times_after_the_end_are_refused():
    beyond = Shock(**SHOCK | {"picture_times": (1e-6, 2e-5), "numerics": {"dns_duration": 1.1e-5}})
    assert [item.key for item in problems(beyond)] == ["shock.numerics.dns_duration", "shock.picture_times"]
    assert not problems(Shock(**SHOCK))
