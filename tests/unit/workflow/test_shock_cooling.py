"""Coolings of several modes: the first one's figures count, the checks of none are lost."""

import json

from reflowshock.workflow.board_drop.shock_cooling import with_cooling
from reflowshock.workflow.case.run import Findings
from reflowshock.workflow.pipeline.reader import read_case
from tests.support.workflow_command import SMALL_CASE

COOLED = ["thermal.effects.residual_stress=on", "thermal.effects.flexible=off", "shock.numerics.plasticity=on"]


def test_checks_of_all_coolings_are_reported(tmp_path):
    for number, name in enumerate(("identical_residual_two_scale", "residual", "residual_two_scale")):
        (tmp_path / name).mkdir()
        result = {"metrics": {"cooling_iterations": number}, "health": {"cooling_force_residual": {"ok": number != 1}}}
        (tmp_path / name / "result.json").write_text(json.dumps(result))
    found = with_cooling(Findings({"peak": 1}, {"energy": {"ok": True}}), read_case(SMALL_CASE, COOLED), tmp_path)
    assert found.metrics == {"peak": 1, "cooling_iterations": 2}
    assert {name for name, check in found.health.items() if not check["ok"]} == {"residual_cooling_force_residual"}
    assert len(found.health) == 4 and found.effects["residual_stress"]["on"]
