"""Tables, curves and the summary of the report from small made-up products."""

import json

import numpy as np
import pytest

from reflowshock.fem.problem.failure import Failure
from reflowshock.parameters import with_value
from reflowshock.workflow.package_report import joint_tables
from reflowshock.workflow.package_report.shock import ranking_mode
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.report import collect_summary, write_summary
from reflowshock.workflow.report import tables
from reflowshock.workflow.report.bodies import exaggeration
from reflowshock.workflow.report.curves import difference_curves, energy_curves, history_curves
from reflowshock.workflow.report.histories import late_peak
from reflowshock.workflow.solder import report as report_body
from reflowshock.workflow.store.keys import inputs_digest
from reflowshock.workflow.verdict.criterion import JudgedDrop
from reflowshock.workflow.verdict.verdict import verdict_of
from tests.support.products import record_of
from tests.support.workflow_command import SMALL_CASE

JOINT = {"standoff": 3.2e-4, "max_width": 5.5e-4}


@pytest.fixture
def history():
    """Return a synthetic history of a drop, name -> samples."""
    time = np.linspace(0.0, 1e-3, 101)
    wave = np.sin(np.pi * time / 1e-3)
    zero = np.zeros_like(time)
    return {
        "time": time,
        "joints": np.array(["A9", "A10"]),
        "base_acceleration": 9.80665 * 1500 * wave,
        "board_centre": np.outer(wave, [0, 0, 1e-3]),
        "die_centre": np.outer(wave, [0, 0, 1e-3]),
        "board_strain": 1e-3 * wave,
        "von_mises_board": np.outer(wave, [50e6, 100e6]),
        "von_mises_package": np.outer(wave, [60e6, 90e6]),
        "von_mises_max": np.outer(wave, [70e6, 150e6]),
        "peel_board": np.outer(wave, [5e6, 9e6]),
        "peel_package": np.outer(wave, [4e6, 8e6]),
        "section_board": np.einsum("k,jc->kjc", wave, [[1, 0, 0, 0, 3e-3, 4e-3], [2, 0, 0, 0, 0, 1e-3]]),
        "section_package": np.einsum("k,jc->kjc", wave, [[1, 0, 0, 0, 0, 0], [1.5, 0, 0, 0, 0, 0]]),
        "outer_fibre_board": np.outer(wave, [20e6, 30e6]),
        "outer_fibre_package": np.outer(wave, [4e6, 8e6]),
        "joint_layer": np.array(25e-6),
        "kinetic": 1e-3 * wave, "internal": 2e-3 * wave, "external": 3e-3 * wave, "interface": zero, "balance": zero,
    }  # fmt: skip


def test_joints_are_ranked_by_their_worse_pad(history):
    judged = verdict_of(JudgedDrop(read_case(SMALL_CASE), {}, history))["joints"]
    table = joint_tables.ranked_joints(history, [{"name": name, **JOINT} for name in ("A9", "A10")], judged)
    assert [row[0] for row in table["rows"]] == ["A10", "A9"]
    assert table["rows"][0][1:3] == ["NO LIMIT", "–"]
    assert table["rows"][0][3:10] == ["9.000", "100.0", "board", "0.500", "2", "1", "30.00"]
    assert table["rows"][1][7:9] == ["1", "5"]
    assert table["head"][4] == "von Mises, 25 µm layer at the pad [MPa]"
    assert (table["head"][-1], table["rows"][0][-1]) == ("largest element value [MPa] (mesh-dependent)", "150.0")


def test_a_dns_that_ended_early_ranks_no_joints(history):
    results = {"two_scale": {"coupling": {"fine_joints": ["A10"]}}, "dns": {}}
    early = {"time": history["time"][:10]}
    assert ranking_mode({"two_scale": history, "dns": history}, results) == "dns"
    assert ranking_mode({"two_scale": history, "dns": early}, results) == "two_scale"


def test_joints_tell_their_verdict_and_by_what(history):
    work = np.outer(history["time"], [1e8, 2e8])
    yielding = history | {"plastic_work_board": work, "plastic_work_package": 0.5 * work}
    joints = [{"name": name, **JOINT} for name in ("A9", "A10")]
    limits = {"peel_stress": {"limit": 8e6, "source": "us"}, "layer_plastic_work": {"limit": 3e5, "source": "us"}}
    case = with_value(read_case(SMALL_CASE), "shock.failure", Failure.model_validate(limits))
    verdicts = verdict_of(JudgedDrop(case, {}, yielding))["joints"]
    table = joint_tables.ranked_joints(yielding, joints, verdicts)
    assert table["head"][5] == "plastic work, 25 µm layer [kJ/m³]"
    assert [row[0] for row in table["rows"]] == ["A10", "A9"]
    assert [row[1:3] for row in table["rows"]] == [["FAIL", "0.889 by peel"], ["PASS", "1.6 by peel"]]
    assert [row[5] for row in table["rows"]] == ["200", "100"]


def test_a_drop_may_stand_anywhere():
    corners = np.array([[1.0, 2.0, 3.0], [3.0, 6.0, 5.0]])
    assert report_body.vertical_axis(corners) == pytest.approx([2.0, 4.0, 0.0])


def test_a_peak_at_the_end_is_said(history):
    assert late_peak(history) == ""
    rising = {**history, "von_mises_board": np.outer(history["time"], [1e11, 2e11])}
    assert "The von Mises stress is still rising when the simulated time ends (1 ms)" in late_peak(rising)
    pulled = {**history, "peel_package": np.outer(history["time"], [1e11, 2e11])}
    assert late_peak(pulled).startswith("The peel stress is still rising")


@pytest.mark.parametrize(
    ("name", "metric", "text"),
    [
        ("peak_von_mises", {"value": 1.571e8, "unit": "Pa"}, "157.1 MPa"),
        ("decay_rate_error", {"value": 1.034, "unit": ""}, "103 %"),
        ("period", {"value": 4.669e-3, "unit": "s"}, "4.669 ms"),
        ("volume", {"value": 7.5e-10, "unit": "m^3"}, "0.75 mm³"),
        ("axial_force", {"value": 6.76, "unit": "N"}, "6.76 N"),
        ("axial_force", {"value": -2.365e-4, "unit": "N"}, "-0.2365 mN"),
        ("added_mass", {"value": 2.0e-5, "unit": "kg"}, "20 mg"),
        ("critical_joint", {"value": "A10", "unit": ""}, "A10"),
        ("joint_width_error_max", {"value": 6.354e-4, "unit": ""}, "0.0635 %"),
        ("peak_board_strain", {"value": 2.25e-3, "unit": ""}, "2250 µm/m"),
    ],
)
def test_quantities_read_as_an_engineer_writes_them(name, metric, text):
    assert tables.named_quantity({name: metric}, name) == text


def test_histories_of_both_modes_are_charts(history):
    both = {"two_scale": history, "dns": history}
    first, *others = history_curves(both, "A10")
    assert [line.name for line in first.series] == [
        "two-scale",
        "DNS",
        "input",
    ] and first.right == "input acceleration [G]"
    assert max(others[-1].series[0].y) == pytest.approx(100.0)  # MPa, of the worse pad
    assert [max(abs(chart.series[0].y)) for chart in difference_curves(both, "A10")] == [0.0, 0.0]
    assert difference_curves({"dns": history}, "A10") == []
    energies, balance = energy_curves(history)
    assert [line.name for line in energies.series] == ["external", "kinetic", "internal"]
    assert max(energies.series[0].y) == pytest.approx(3.0) and max(balance.series[0].y) == 0.0


def test_summary_merges_the_stages_that_have_run(tmp_path):
    case = read_case(SMALL_CASE)
    for stage, value in (("geometry", 25), ("shock", 1e8)):
        metrics = {stage: {"value": value, "unit": ""}}
        record_of(tmp_path / stage, seconds=1.5, metrics=metrics, effects={"gravity": stage})
    summary = collect_summary(tmp_path, case)
    assert summary["timings"]["wall"] == {"geometry": 1.5, "shock": 1.5}
    assert summary["timings"]["predicted"] == {"geometry": 2.0, "shock": 2.0}
    assert set(summary["metrics"]) == {"geometry", "shock"}
    assert summary["effects"] == {"gravity": "geometry", "gravity_in_the_shock": "shock"}
    write_summary(tmp_path, summary)
    assert json.loads((tmp_path / "summary.json").read_text()) == summary


def test_digest_changes_with_any_input():
    changed = read_case(SMALL_CASE, ["shock.peak_acceleration=1000 G"])
    assert inputs_digest(changed) != inputs_digest(read_case(SMALL_CASE))


def test_a_board_at_rest_is_drawn_as_it_is():
    assert exaggeration(0.1, 2e-3) == 5.0
    assert exaggeration(0.1, 0.0) == 1.0


def test_dollars_and_backslashes_are_no_formulas(tmp_path):
    from reflowshock.workflow.report.drawing import STYLE, pyplot

    with pyplot.rc_context(STYLE):
        figure, axis = pyplot.subplots()
        axis.set(title=r"$\frac{$", xlabel=r"50 $ a $x^$")
        axis.plot([0, 1], label=r"$\nothing$")
        axis.legend()
    figure.savefig(tmp_path / "picture.png")
    pyplot.close(figure)


def test_pages_take_no_text_for_code(tmp_path):
    from reflowshock.workflow.report.template import template_environment

    (tmp_path / "page.html.j2").write_text("<p>{{ text }}</p>{{ own | safe }}", encoding="utf-8")
    text = "<script>[/x] {{ 1 }} \x1b[31m\udce4"
    page = template_environment(tmp_path).get_template("page.html.j2").render(text=text, own="<b>")
    assert page == r"<p>&lt;script&gt;[/x] {{ 1 }} \x1b[31m\udce4</p><b>"
