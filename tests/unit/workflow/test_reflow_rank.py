"""What ranks of a reflow hand each other: files of data, of which a broken or forged one is named and not executed."""

from pathlib import Path

import numpy as np
import pytest

from reflowshock.data_file import read_data, write_data
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.scenes.carried_joint import Carried
from reflowshock.particles.steps.shape import JointShape, Snapshot
from reflowshock.workflow.reflow import array, rank
from reflowshock.workflow.reflow import joints as reflow_pool
from reflowshock.workflow.reflow.pool import ReflowError
from reflowshock.workflow.reflow.rank import JOB, RESULT, JobResult, function_of, name_of, records_of
from reflowshock.workflow.reflow.ranks import Ranks
from tests.support import rank_work
from tests.support.forged_files import DAMAGES

SOLDER = Solder(volume=7.2e-11)
PLACE = JointGeometry(3.0e-4, 2.4e-4, 2.4e-4, (1e-5, 0.0), (0.0, -0.01))
SOURCE = array.Source("A1", 3, PLACE)
JOBS = {
    reflow_pool._solve: reflow_pool.JointReflow(PLACE, SOLDER, Path("checkpoints/A1")),
    array.carry: array.CarriedReflow(Path("checkpoints"), SOLDER, None, SOURCE),
    array.finish: array.CarriedReflow(Path("checkpoints"), SOLDER, SOURCE, SOURCE),
}


@pytest.mark.parametrize("work", JOBS)
def test_a_job_arrives_as_it_was_sent(tmp_path, work):
    path = tmp_path / f"A1{JOB}"
    write_data(path, {}, JOBS[work])
    assert function_of(name_of(work)) is work
    received = read_data(path, records_of(work))
    assert received == JOBS[work]
    assert repr(received) == repr(JOBS[work])  # a checkpoint belongs to what this says


def test_results_arrive_as_they_were_sent(tmp_path):
    points, triangles = np.random.default_rng(0).normal(size=(4, 3)), np.array([[0, 1, 2]], np.int32)
    shape = JointShape(
        points=points,
        velocity=np.zeros((4, 3)),
        pressure=np.ones(4),
        surface_points=points[:3],
        triangles=triangles,
        rings=(np.arange(3, dtype=np.int32), np.arange(2, dtype=np.int32)),
        history={"time": np.arange(2.0), "binding": np.array(["growth", "displacement"])},
        snapshots=[Snapshot(0.0, points, triangles)],
        metrics={"volume": (7.2e-11, "m^3"), "width_error": (float("nan"), "")},
        verdict="ok",
    )
    write_data(tmp_path / "shape", {}, JobResult((shape, True)))
    received, continued = read_data(tmp_path / "shape", records_of(reflow_pool._solve)).value
    assert continued is True
    assert (received.verdict, repr(received.metrics)) == (shape.verdict, repr(shape.metrics))
    np.testing.assert_array_equal(received.points, points)
    np.testing.assert_array_equal(received.history["binding"], shape.history["binding"])
    np.testing.assert_array_equal(received.rings[1], shape.rings[1])
    np.testing.assert_array_equal(received.snapshots[0].triangles, triangles)
    assert received.triangles.dtype == np.int32
    write_data(tmp_path / "carried", {}, JobResult(Carried(np.eye(6)[:2], 7)))
    carried = read_data(tmp_path / "carried", records_of(array.carry)).value
    assert carried.steps == 7
    np.testing.assert_array_equal(carried.wrenches, np.eye(6)[:2])


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_broken_or_forged_job_fails_and_is_not_executed(tmp_path, damage):
    path, marker = tmp_path / f"A1{JOB}", tmp_path / "marker"
    write_data(path, {}, JOBS[reflow_pool._solve])
    path.write_bytes(damage(path.read_bytes(), marker))
    assert rank.main(tmp_path, rank_work.solve) == 1
    result = read_data(path.with_suffix(RESULT), (JobResult,))
    assert result.value is None
    assert result.error.startswith(f"NotData: {path} ")
    assert not marker.exists()


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_broken_or_forged_result_names_its_joint(tmp_path, monkeypatch, damage):
    marker = tmp_path / "marker"

    def launch(*_) -> None:
        path = tmp_path / "jobs" / f"A1{RESULT}"
        write_data(path, {}, JobResult((None, True)))
        path.write_bytes(damage(path.read_bytes(), marker))

    monkeypatch.setattr("reflowshock.workflow.reflow.ranks.launch", launch)
    with pytest.raises(ReflowError, match=r"^joint A1: .*A1\.result (is|has) "):
        Ranks(1, True, tmp_path / "jobs").run(rank_work.solve, {"A1": JOBS[reflow_pool._solve]}, lambda _: None)
    assert not marker.exists()
