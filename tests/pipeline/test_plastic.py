"""Plastic solder through the whole pipeline: both modes, energy balance, verdict, report."""

import json
import shutil

import numpy as np
import pytest

from tests.support.workflow_command import reflowshock

LIMIT = ('shock.failure.layer_plastic_work={ limit = "0.2 MJ/m^3", source = "some break" }',)
# The short pulse of the small case hardly bends the board: only an unrealistic peak makes the solder yield.
SETTINGS = (
    "shock.ranks.total=1",
    "shock.numerics.plasticity=on",
    "shock.peak_acceleration=300000 G",
    'shock.failure.peel_stress={ limit = "100 MPa", source = "none breaks" }',
    *LIMIT,
)


@pytest.fixture(scope="module")
def plastic_run(first_run, tmp_path_factory):
    """Return the run folder, its completed process, the summary and the histories of both modes."""
    folder = shutil.copytree(first_run[0], tmp_path_factory.mktemp("plastic") / "small")
    result = reflowshock("run", folder, settings=SETTINGS)
    histories = {mode: dict(np.load(folder / "shock" / mode / "history.npz")) for mode in ("two_scale", "dns")}
    return folder, result, json.loads((folder / "summary.json").read_text()), histories


def test_a_joint_that_breaks_is_the_verdict_of_a_healthy_run(plastic_run):
    folder, result, summary, _ = plastic_run
    assert result.returncode == 0, result.stderr
    assert all(check["ok"] for check in summary["health"].values())
    verdict = summary["verdict"]
    verdicts = [joint["verdict"] for joint in verdict["joints"].values()]
    assert verdict["design"] == "FAIL" and 1 <= verdicts.count("FAIL") < 4
    assert result.stdout.splitlines()[-1] == summary["answer"]
    assert f"{verdict['joint']}: plastic work " in summary["answer"] and ", FAIL; discretisation" in summary["answer"]
    page = (folder / "report.html").read_text()
    assert "some break" in page and "plastic work density, solder layer at this pad" in page
    assert "Largest plastic work density of the layer first" in page
    failed = [name for name, joint in verdict["joints"].items() if joint["verdict"] == "FAIL"]
    verdict_text = page[page.index(f"{len(failed)} of 4 joints in the model fail") :].split("</p>")[0]
    assert all(name in verdict_text for name in failed) and verdict["joint"] in failed


def test_a_verdict_ends_a_run_with_3_where_that_is_asked_for(plastic_run, tmp_path):
    folder = shutil.copytree(plastic_run[0], tmp_path / "small")
    stage_text = (folder / "shock/stage.json").read_text()
    assert reflowshock("run", folder, "--fail-on-verdict", settings=SETTINGS).returncode == 3
    held = (*SETTINGS[:-1], SETTINGS[-1].replace("0.2 MJ", "3000 MJ"))
    other = reflowshock("run", folder, "--fail-on-verdict", settings=held)
    assert other.returncode == 0 and ", PASS; " in other.stdout.splitlines()[-1]
    assert (folder / "shock/stage.json").read_text() == stage_text  # the verdict changes without a new computation
    assert reflowshock("run", folder, "--fail-on-verdict", "--until", "shock", settings=SETTINGS).returncode == 2


def test_effects_say_why_they_are_on(plastic_run):
    effects = plastic_run[2]["effects"]
    on = {name for name in ("plasticity", "strain_rate", "thermal_softening", "failure") if effects[name]["on"]}
    assert on == {"plasticity", "strain_rate", "failure"}
    assert effects["plasticity"]["why"].startswith("shock.numerics.plasticity = on; solder yields from 38 MPa on")


def test_energy_balances_and_both_modes_flow_alike(plastic_run):
    _, _, summary, histories = plastic_run
    assert summary["metrics"]["energy_balance_error"]["value"] < 2e-3
    assert summary["health"]["dns_energy_balance_error"]["value"] < 1e-5
    assert summary["metrics"]["critical_joint_stress_error"]["value"] < 0.05
    ours, exact = (np.stack([item["plastic_work_board"], item["plastic_work_package"]]) for item in histories.values())
    assert (np.diff(exact, axis=1) >= 0.0).all()
    assert np.abs(ours[:, -1] - exact[:, -1]).max() < 0.05 * exact[:, -1].max()
    for item in histories.values():
        assert item["plastic"][-1] > 0.0
        assert item["plastic_strain_max"].max() == pytest.approx(
            summary["metrics"]["peak_plastic_strain"]["value"], rel=0.05
        )


def test_stress_stays_on_the_yield_surface_of_its_rate(plastic_run):
    """No stress exceeds the yield stress at the largest plastic strain and 1e5 1/s."""
    history = plastic_run[3]["dns"]
    strain = history["plastic_strain_max"].max()
    assert history["von_mises_max"].max() < (38e6 + 275e6 * strain**0.71) * (1.0 + 0.0713 * np.log(1e8))
