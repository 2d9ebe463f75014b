"""Joints whose surfaces are given are not reflowed between rigid plates: their records tell these surfaces."""

import json

import meshio
import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM
from reflowshock.cases.hard.trials.surfaces import barrel
from reflowshock.meshing.board.pads import pad_table, write_pads
from reflowshock.meshing.board.parameters import Warpage
from reflowshock.workflow.board_drop.forecast import forecast_package
from reflowshock.workflow.case.run import Run
from reflowshock.workflow.package import findings
from reflowshock.workflow.package_report import joint_tables
from reflowshock.workflow.package_report.joint_records import joint_records
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.reflow.stage import reflow
from reflowshock.workflow.store.keys import stage_inputs
from tests.support.workflow_command import SMALL_CASE

NAMES = ("A3", "A4", "B3", "B4")


@pytest.fixture
def run(tmp_path) -> Run:
    """A case of which all joints are given, one of them wider."""
    for name in NAMES:
        shape = barrel(0.35 * MM, (0.1 if name == "A4" else 0.06) * MM)
        meshio.write(tmp_path / f"{name}.stl", meshio.Mesh(shape.points / MM, [("triangle", shape.triangles)]))
    settings = [f'package.surfaces.{name}="{tmp_path / name}.stl"' for name in NAMES]
    case = read_case(SMALL_CASE, ["warpage.corner=0 mm", "package.standoff=0.35 mm", *settings], oversubscribe=True)
    for name in ("geometry", "reflow"):
        (tmp_path / name).mkdir()
    write_pads(tmp_path / "geometry/pads.json", pad_table(case.package, case.board, Warpage()))
    return Run(tmp_path, case, 1)


def test_nothing_is_reflowed_and_records_tell_what_was_given(run):
    result = reflow(run, run.folder / "reflow")
    records = json.loads((run.folder / "reflow/joints.json").read_text())
    assert list(records) == list(NAMES)
    assert {record["verdict"] for record in records.values()} == {"given"}
    metrics = records["A4"]["metrics"]
    assert metrics["max_width"] == {"value": pytest.approx(0.68 * MM, rel=0.02), "unit": "m"}
    assert metrics["standoff"]["value"] == pytest.approx(0.35 * MM)
    assert metrics["contact_radius_board"]["value"] == pytest.approx(0.24 * MM, rel=0.005)
    steep = 90.0 + np.degrees(np.arctan(0.4 / 0.35))
    assert metrics["contact_angle_board"] == {"value": pytest.approx(steep, abs=0.5), "unit": "deg"}
    assert result.metrics["distinct_shapes"]["value"] == 0
    assert result.metrics["joint_width_max"]["value"] == metrics["max_width"]["value"]
    assert all(check["ok"] for check in result.health.values())
    assert joint_records(run.folder)[1]["angles"].startswith(f"{metrics['contact_angle_board']['value']:.1f} / ")
    assert {row[1] for row in joint_tables.verdicts(run.folder)["rows"]} == {"given"}


def test_other_joints_are_judged_with_them():
    values = {"max_width": 5e-4, "width_error": 1e-3, "volume_drift": 2e-12}
    flowed = {"shape": "A1", "metrics": {name: {"value": value} for name, value in values.items()}}
    imported = {"given": "a2.stl", "verdict": "given", "metrics": {"max_width": {"value": 6e-4}}}
    result = findings.of_reflow({"A1": flowed | {"verdict": "overflow"}, "A2": imported}, {})
    assert result.health["joints_not_ok"]["value"] == 1
    assert result.health["joint_volume_drift_max"]["value"] == 2e-12
    assert findings.of_reflow({"A1": flowed | {"verdict": "ok"}, "A2": imported}, {}).health["joints_not_ok"]["ok"]


def test_plan_foresees_only_those_that_are_reflowed(run):
    assert (forecast_package(run.case).joints, forecast_package(run.case).distinct) == (4, 0)
    package = run.case.package.model_copy(update={"surfaces": {"A4": run.case.package.surfaces["A4"]}})
    assert forecast_package(run.case.model_copy(update={"package": package})).distinct == 1


def test_the_reflow_depends_on_what_surfaces_hold(run):
    before = stage_inputs(run.case, run.case.pipeline["reflow"])
    with (run.folder / "A4.stl").open("ab") as file:
        file.write(b" ")
    assert stage_inputs(run.case, run.case.pipeline["reflow"]) != before
