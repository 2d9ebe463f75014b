"""Errors of a drop from two runs on coarser meshes, after a run without them."""

import json

from tests.support.workflow_command import reflowshock, times

ESTIMATE = ("numerics.error.method=estimate",)


def test_companions_give_every_figure_an_error(run_folder):
    before = times(run_folder)
    result = reflowshock("run", run_folder, settings=ESTIMATE)
    assert result.returncode == 0, result.stdout + result.stderr
    assert all(times(run_folder)[name] == before[name] for name in before if name != "report")

    summary = json.loads((run_folder / "summary.json").read_text())
    errors = summary["errors"]
    assert {
        "peel_stress",
        "layer_von_mises",
        "section_axial_force",
        "peak_acceleration@edge",
        "peak_strain@corner",
    } <= set(errors)
    assert all(set(error) == {"discretisation", "order", "two_scale", "how"} for error in errors.values())
    assert 0.0 < errors["peel_stress"]["discretisation"] < 2.0 and errors["peel_stress"]["two_scale"] < 0.05
    assert set(summary["timings"]["wall"]) >= {"shock", "errors"}
    assert summary["metrics"]["companion_cost_share"]["value"] > 0.0
    assert (run_folder / "companions/size_1.5/shock/two_scale/history.npz").is_file()

    cleaned = reflowshock("clean", run_folder, "--unused", settings=ESTIMATE).stdout
    assert "removed 1 unused product from" in cleaned  # the report without errors; companions stay
    assert "nothing to do" in reflowshock("run", run_folder, settings=ESTIMATE).stdout
    assert "elements x 2" in reflowshock("status", run_folder, settings=ESTIMATE).stdout
