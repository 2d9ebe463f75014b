"""Error against cost: table, plot and what of them stands in the README."""

import pytest
from matplotlib import pyplot

from workflow import work_precision

ROW = {
    "contact_angle": 60,
    "per_edge": 7,
    "scheme": "energy",
    "mode": "quasi-static",
    "basis": "linear",
    "end": "at rest",
}
ROW |= {"vary": "spacing", "time_step_limit": 100.0, "steps": 45, "seconds": 4.57}
GOOD = ROW | {"height_error": 6e-4, "max_width_error": -1e-3}
FAILED = ROW | {"vary": "scheme", "scheme": "gripc", "end": "StepCollapsed in step 46"}
RESULT = {"rows": [GOOD, FAILED], "orders": {"max_width_error": {"60 deg": 2.2}}}


def test_a_failed_run_is_a_row():
    rows = work_precision.table(RESULT)["rows"]
    assert rows[0] == [
        "60 deg, 7 per edge",
        "energy, quasi-static",
        "100 x",
        "0.06 %",
        "-0.1 %",
        "45",
        "4.6",
        "at rest",
    ]
    assert rows[1][1] == "gripc, quasi-static, linear"
    assert rows[1][3:] == ["", "", "45", "4.6", "StepCollapsed in step 46"]


def test_the_plot_has_a_line_for_the_spacing_and_a_cross_for_the_failure():
    drawing = work_precision.figure(RESULT)
    for axis, error in zip(drawing.axes, (0.06, 0.1), strict=True):
        spacing, failed = axis.get_lines()
        assert spacing.get_xydata()[0] == pytest.approx([4.57, error])
        assert failed.get_xdata() == [4.57]
        assert (axis.get_xscale(), axis.get_yscale()) == ("log", "log")
    pyplot.close(drawing)


def test_a_measurement_replaces_what_stood_in_the_readme(tmp_path, monkeypatch):
    readme = tmp_path / "README.md"
    readme.write_text(f"before\n{work_precision.BEGIN}\nold\n{work_precision.END}\nafter\n")
    for name, file in {"STORED": "w.json", "PICTURE": "w.png", "README": "README.md"}.items():
        monkeypatch.setattr(work_precision, name, tmp_path / file)
    work_precision.publish(RESULT)
    text = readme.read_text()
    assert text.startswith("before\n") and text.endswith("\nafter\n") and "old" not in text
    assert "| 60 deg, 7 per edge | energy" in text and "2.20 in width at 60 deg" in text
    assert work_precision.stored() == RESULT
    assert (tmp_path / "w.png").stat().st_size > 1000


def test_what_is_stored_can_be_shown():
    stored = work_precision.stored()
    shown = work_precision.markdown(stored)
    assert shown in work_precision.README.read_text()
    assert {row["scheme"] for row in stored["rows"]} == {"energy", "gripc"}
