"""Shock of the shortened case with the stress of cooling: products, metrics, differences, bad input."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from reflowshock.workflow.board_drop.shock_cooling import with_initial_stress
from reflowshock.workflow.board_drop.stages import shock
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.run import Findings, Run
from reflowshock.workflow.pipeline.reader import read_case
from tests.support.workflow_command import SMALL_CASE

COOLED = (
    "shock.pulse_duration=0.01 ms",
    "shock.duration=0.012 ms",
    "shock.ranks.total=1",
    "thermal.effects.residual_stress=on",
    "thermal.effects.flexible=off",
    "shock.numerics.plasticity=on",
)


def shock_of(run_folder: Path, *settings: str) -> tuple[Path, Findings]:
    """Run the shock alone on existing joint meshes."""
    case = read_case(SMALL_CASE, [*COOLED, *settings])
    folder = run_folder / "shock"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder, shock(Run(run_folder, case, 2), folder)


def test_both_modes_begin_with_one_cooling(run_folder):
    folder, findings = shock_of(run_folder)
    assert all(check["ok"] for check in findings.health.values())
    assert {"cooling_force_residual", "cooling_unbalanced_force"} <= findings.health.keys()
    assert findings.effects["residual_stress"]["on"]
    assert "192 K" in findings.effects["residual_stress"]["why"]
    value = {name: metric["value"] for name, metric in findings.metrics.items()}
    assert value["residual_stress_critical_joint"] > 20e6
    assert value["room_temperature_warpage"] != value["solidified_warpage"]
    assert value["cooling_iterations"] > 3
    assert (folder / "residual/residual.vtu").exists()
    assert not (folder / "residual_two_scale").exists()
    joints = json.loads((folder / "residual/result.json").read_text())["joints"]
    for mode in ("two_scale", "dns"):
        with np.load(folder / mode / "history.npz") as history:
            assert history["von_mises_board"][0] == pytest.approx(joints["von_mises_board"], rel=1e-6)
            assert history["plastic_strain_max"][0] == pytest.approx(joints["plastic_strain_max"], rel=1e-9)
    assert findings.metrics["critical_joint_stress_error"]["value"] < 0.05
    continues_from_the_same_cooling(run_folder)


def continues_from_the_same_cooling(run_folder: Path) -> None:
    """Check that a stage killed during its shock reuses the stored cooling, to the same bits."""
    cooling_file = run_folder / ".shock.checkpoints/residual/cooling.npz"
    written, request = cooling_file.stat().st_mtime_ns, json.loads((run_folder / "shock/dns/input.json").read_text())
    again = run_folder / "again"
    again.mkdir()
    request = with_initial_stress(Run(run_folder, read_case(SMALL_CASE, COOLED), 2), again, request)
    assert Path(request["cooling"]).read_bytes() == cooling_file.read_bytes()
    assert cooling_file.stat().st_mtime_ns == written


@pytest.mark.parametrize(
    "setting, key",
    [
        ("shock.coupling.direction=one_way", "shock.coupling.direction"),
        ("shock.numerics.dns_solver=implicit", "shock.numerics.dns_solver"),
    ],
)
def test_what_cannot_begin_so_is_refused(setting, key):
    with pytest.raises(CaseError) as caught:
        read_case(SMALL_CASE, [*COOLED, setting])
    assert any(problem.key.startswith(key) for problem in caught.value.problems)
