"""Joints that are bridged or open: reported in records, checks and the report."""

import json
from types import SimpleNamespace

import pytest

from reflowshock.workflow.package import findings
from reflowshock.workflow.package_report import joint_tables
from reflowshock.workflow.reflow.joints import ReflowError, mark_bridges, refuse_joints_without_mesh
from reflowshock.workflow.solder.stages import judge_drop, judge_joint, judge_oscillation

PADS = [SimpleNamespace(name=f"A{k}", x=k * 1e-3, y=2.5e-3) for k in (1, 2, 3, 4)]


def joint(width, verdict="ok"):
    """Return the record of a joint with a width [m] and a verdict."""
    values = {"max_width": width, "standoff": 3e-4, "width_error": 1e-3, "volume_drift": 0.0}
    return {"shape": "A1", "verdict": verdict, "metrics": {k: {"value": v, "unit": ""} for k, v in values.items()}}


@pytest.fixture
def records():
    """Return the records of joints of which two touch and one is open."""
    joints = {"A1": joint(0.8e-3), "A2": joint(1.01e-3, "overflow"), "A3": joint(1.02e-3, "overflow")}
    joints["A4"] = joint(0.4e-3, "open")
    joints["A4"]["metrics"]["width_error"]["value"] = float("nan")
    mark_bridges(joints, PADS, mirrored=True)
    return joints


def test_joints_that_touch_are_bridged_and_name_each_other(records):
    assert [record["verdict"] for record in records.values()] == ["ok", "bridged", "bridged", "open"]
    assert [record.get("touches") for record in records.values()] == [None, ["A3"], ["A2"], None]


def test_health_counts_them(records):
    health = findings.of_reflow(records, {}).health
    counts = {name: check["value"] for name, check in health.items() if name.startswith("joints_")}
    assert counts == {"joints_bridged": 2, "joints_open": 1, "joints_not_ok": 3}
    assert not any(health[name]["ok"] for name in counts)
    assert health["joint_width_error_max"]["ok"]


def test_joints_with_an_account_of_their_energy_are_judged_by_it(records):
    assert "joint_particles_lost" not in findings.of_reflow(records, {}).health
    moved = {"energy_imbalance": -1e-3, "particles_lost": 0.0, "at_rest": 1.0, "time_at_rest": 2e-3, "steps": 80.0}
    moved |= {"viscous_loss": 1e-5, "smoothing_loss": 0.01}
    for record in records.values():
        record["metrics"] |= {name: {"value": value, "unit": ""} for name, value in moved.items()}
    records["A4"]["metrics"] |= {"at_rest": {"value": 0.0}, "time_at_rest": {"value": float("nan")}}
    result = findings.of_reflow(records, {})
    assert result.health["joint_energy_imbalance_max"]["ok"] and result.health["joint_particles_lost"]["ok"]
    assert (result.metrics["joints_at_rest"]["value"], result.metrics["joint_time_at_rest_max"]["value"]) == (3, 2e-3)
    assert result.metrics["joint_smoothing_loss_max"]["value"] == 0.01
    assert result.health["joints_in_motion"]["value"] == 1 and not result.health["joints_in_motion"]["ok"]
    records["A1"]["metrics"] |= {"energy_imbalance": {"value": -0.03}, "particles_lost": {"value": 1.0}}
    result = findings.of_reflow(records, {})
    assert not result.health["joint_energy_imbalance_max"]["ok"] and not result.health["joint_particles_lost"]["ok"]


def test_joints_that_were_carried_have_no_time_to_rest_and_no_losses(records):
    moved = {"energy_imbalance": 1e-3, "particles_lost": 0.0, "at_rest": 1.0, "steps": 80.0}
    for record in records.values():
        record["metrics"] |= {name: {"value": value, "unit": ""} for name, value in moved.items()}
    result = findings.of_reflow(records, {})
    assert result.health["joint_energy_imbalance_max"]["ok"] and result.metrics["joint_steps_max"]["value"] == 80
    assert [name for name in result.metrics if "loss" in name or "time" in name] == []


def test_the_decay_of_a_swing_is_judged_to_ten_per_cent_whatever_the_scheme():
    metrics = {"volume_drift": (0.0, ""), "period_error": (5e-3, ""), "decay_rate_error": (0.101, "")}
    health = judge_oscillation(metrics, {}).health
    assert health["decay_rate_error"] == {"value": 0.101, "limit": 0.1, "ok": False}
    assert health["period_error"]["ok"]
    assert judge_oscillation(metrics | {"decay_rate_error": (-0.099, "")}, {}).health["decay_rate_error"]["ok"]


def test_widths_are_judged_to_one_per_cent_and_counted(records):
    """A joint that leans has no reference, and is not counted as one that keeps to it."""
    assert findings.of_reflow(records, {}).metrics["joints_compared_in_width"]["value"] == 3
    records["A1"]["metrics"]["width_error"]["value"] = 0.011
    assert not findings.of_reflow(records, {}).health["joint_width_error_max"]["ok"]
    records["A1"]["metrics"]["width_reference_error"] = {"value": 3e-3, "unit": ""}
    result = findings.of_reflow(records, {})
    assert result.metrics["joints_compared_in_width"]["value"] == 2 and result.health["joint_width_error_max"]["ok"]


def test_a_failed_joint_names_its_error():
    assert judge_joint({}, "overflow", {}).health["joint_overflow"] == {
        "value": 1,
        "limit": 0,
        "ok": False,
    }
    assert judge_joint({}, "ok", {}).health["joints_not_ok"]["ok"]


def test_a_drop_that_still_moves_is_not_judged_by_the_shape_at_rest():
    metrics = {"volume_drift": (0.0, ""), "height_error": (0.5, ""), "at_rest": (0.0, "")}
    assert set(judge_drop(metrics, "ok", {}).health) == {"volume_drift"}
    assert set(judge_drop(metrics | {"at_rest": (1.0, "")}, "ok", {}).health) == {
        "volume_drift",
        "height_error",
    }


def test_they_have_no_mesh(records):
    with pytest.raises(ReflowError, match="A2, A3 bridged"):
        refuse_joints_without_mesh(records)
    with pytest.raises(ReflowError, match="A4 open"):
        refuse_joints_without_mesh({name: records[name] for name in ("A1", "A4")})
    refuse_joints_without_mesh({"A1": records["A1"]})


def test_the_report_lists_them_first(records, tmp_path):
    (tmp_path / "reflow").mkdir()
    (tmp_path / "reflow/joints.json").write_text(json.dumps(records))
    rows = joint_tables.verdicts(tmp_path)["rows"]
    assert [row[0] for row in rows] == ["A2", "A3", "A4", "A1"]
    assert rows[0][1:3] == ["bridged", "A3"]
