"""Section "Two scales" of the report, and the metrics of the coupling."""

import json

import numpy as np
import pytest

from reflowshock.workflow.package.findings import fine_joints_of, ideal_ratio, of_shock
from reflowshock.workflow.report import two_scales as section

MODEL = {"window": 80e-9, "step": 10e-9, "substeps": 8, "ranks": 2, "elements": {"dns": 1000}}
COUPLING = {
    "scheme": "local_steps",
    "why": "all is linear",
    "direction": "two_way",
    "fine_joints": ["A4", "B4"],
    "levels": [
        {"step": 80e-9, "elements": 600, "cost_share": 0.2},
        {"step": 20e-9, "elements": 300, "cost_share": 0.3},
        {"step": 10e-9, "elements": 100, "cost_share": 0.5},
    ],
    "meso_share": 0.4,
    "self_check": {"rigid": 2e-16, "macro_mass": 1e-3},
    "placement": {
        "chosen": "shared by 2",
        "alternatives": {"shared by 2": 3e-4, "macro on rank 0, meso on rank 1": 4e-4},
        "window_seconds": 3.3e-4,
        "busy_share": 0.93,
        "busy_shares": [0.95, 0.92],
        "coupling_overhead": 0.02,
    },
}


def rows_of(table: dict) -> dict[str, str]:
    """Return the rows of a table as first cell -> second cell."""
    return {row[0]: row[1] for row in table["rows"]}


def test_the_section_has_scheme_joints_and_checks():
    rows = rows_of(section.two_scales(COUPLING, MODEL, "the most stressed"))
    assert rows["scheme"].startswith("local time steps")
    assert rows["reason"] == "all is linear"
    assert rows["fine joints"] == "A4 B4"
    assert rows["selection of fine joints"] == "the most stressed"
    assert rows["meso share f of the elements"] == "40 %"
    assert rows["rigid motion through tie and interface, error"] == "2.00e-16"
    assert rows["mass of the macro model"] == "1000 mg"


def test_a_structure_reports_its_fine_layers_and_its_direction():
    rows = rows_of(section.two_scales({"fine_layers": ["solder", "copper"], "direction": "two_way"}, MODEL))
    assert rows["fine layers"] == "solder copper"
    assert rows["direction"] == "two-way"


def test_what_a_run_does_not_tell_is_left_out():
    rows = rows_of(section.two_scales({}, MODEL))
    assert set(rows) == {"window", "step ratio m"}
    assert section.levels({}) is None
    assert section.placement({}) is None


def test_levels_begin_with_the_window():
    assert section.levels(COUPLING)["rows"] == [
        ["0", "80 ns", "600", "20 %"],
        ["1", "20 ns", "300", "30 %"],
        ["2", "10 ns", "100", "50 %"],
    ]


def test_predictions_are_listed_with_measurements():
    rows = rows_of(section.placement(COUPLING))
    assert rows["window, predicted, shared by 2 (chosen)"] == "300 µs"
    assert rows["window, predicted, macro on rank 0, meso on rank 1"] == "400 µs"
    assert rows["window, measured"] == "330 µs"
    assert rows["rank 1, computing"] == "92 %"
    assert rows["coupling, share of a window"] == "2 %"


@pytest.mark.parametrize(
    ("seconds", "winner"), [(10.0, "implicit steps are cheaper"), (100.0, "two scales are cheaper")]
)
def test_the_cheaper_of_two_scales_and_implicit_steps_is_named(seconds, winner):
    run = {"timings": {"windows": 20.0}, "model": MODEL}
    assert winner in section.oracle(seconds, [run])
    assert "took 80." in section.oracle(seconds, [run, run])


def test_the_ideal_ratio_counts_element_updates():
    dns = {"step": 10e-9, "elements": {"dns": 1000}}
    assert ideal_ratio({}, dns) is None
    assert ideal_ratio(COUPLING, dns) == pytest.approx((600 / 8 + 300 / 2 + 100) / 1000)
    model = {"levels": [{"step": 15.0, "elements": 75}, {"step": 1.0, "elements": 25}]}
    assert ideal_ratio(model, {"step": 1.0, "elements": {"dns": 100}}) == pytest.approx(0.25 + 0.75 / 15)


def test_coupling_and_comparison_become_metrics(tmp_path):
    window = {name: {"value": 1.0, "unit": "s"} for name in ("window_seconds", "window_core_seconds")}
    bent = {"peak_board_displacement": {"value": 3e-3, "unit": "m"}}
    result = {"metrics": window | bent, "health": {}, "effects": {}, "model": MODEL}
    for mode, factor in (("two_scale", 0.9), ("dns", 1.0)):
        (tmp_path / mode).mkdir()
        wave = factor * np.sin(np.linspace(0.0, 1.0, 5))
        stress = wave[:, None] * [1.0, 2.0, 3.0]
        np.savez(
            tmp_path / mode / "history.npz", time=np.arange(5.0), joints=np.array(["A3", "A4", "B3"]), die_centre=wave,
            board_centre=wave, board_strain=wave, von_mises_board=stress, von_mises_package=stress,
            peel_board=stress, peel_package=stress,
        )  # fmt: skip
    found = of_shock({"two_scale": result | {"coupling": COUPLING}, "dns": result}, tmp_path, 1e-3)
    metrics = {name: metric["value"] for name, metric in found.metrics.items()}
    assert metrics["deflection_over_thickness"] == pytest.approx(3.0)
    assert metrics["meso_share"] == 0.4
    assert metrics["busy_share"] == 0.93
    assert metrics["coupling_overhead"] == 0.02
    assert metrics["two_scale_dns_time_ratio"] == metrics["two_scale_dns_core_ratio"] == 1.0
    assert metrics["critical_joint"] == "B3"
    assert metrics["worst_joint_stress_error"] == pytest.approx(0.1)
    assert not found.health["critical_joint_coarse"]["ok"]
    json.dumps(found.metrics)


def test_a_run_with_all_joints_fine_has_no_coarse_ones():
    assert fine_joints_of({"coupling": {"fine_joints": "all"}}) is None
    assert fine_joints_of({"coupling": {"fine_joints": ["A3"]}}) == ["A3"]
