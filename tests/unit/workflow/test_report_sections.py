"""Sections of the report on the full chain, from small made-up products."""

import json

import numpy as np
import pytest

from reflowshock.workflow.package_report import cost, shape_effect, shock, warpage
from reflowshock.workflow.package_report import interface as section
from reflowshock.workflow.package_report import joint_tables as mesh_tables
from reflowshock.workflow.package_report import shock as residual
from reflowshock.workflow.package_report.array import array_maps
from reflowshock.workflow.package_report.joint_records import joint_records
from reflowshock.workflow.package_report.joints import headline
from reflowshock.workflow.package_report.scenes import is_neighbour, role_of
from reflowshock.workflow.solder.report import history_curve, pull_chart
from tests.support.chain_products import BOW, MICRO, MILLI, bowed_structure, interface

NAMES = ["A3", "A4", "B3", "B4"]
X, Y = np.array([0.5, 1.5, 0.5, 1.5]) * MILLI, np.array([1.5, 1.5, 0.5, 0.5]) * MILLI
HALF = 2.5 * MILLI


@pytest.fixture(scope="module")
def structure():
    """Return the products of a bowed structure."""
    return bowed_structure(NAMES, X, Y, HALF)


def test_faces_are_the_underside_and_the_board_below_it(structure):
    package, board = warpage.faces(structure)
    assert package.warpage == pytest.approx(BOW["package"])
    assert board.warpage == pytest.approx(BOW["board"])
    assert package.at(np.array([HALF]), np.array([HALF])) == pytest.approx(BOW["package"])
    assert np.isnan(package.at(np.array([2 * HALF]), np.array([0.0]))).all()


def test_warpage_is_described_in_a_sentence_and_by_load_step(structure):
    gaps = (BOW["package"] - BOW["board"]) * (X**2 + Y**2) / (2 * HALF**2) / MICRO
    words = warpage.in_words(structure)
    assert "70.0 µm for the package underside and 12.0 µm for the board" in words
    assert f"{gaps.min():+.1f} to {gaps.max():+.1f} µm" in words and "(217 °C)" in words
    table = warpage.load_steps(structure)
    assert table["head"][:3] == ["load step", "temperature [°C]", "gap change, B3 [µm]"]  # no corner is moved
    assert table["rows"][-1][1:4] == ["217.0", f"{gaps.min():+.2f}", f"{gaps.max():+.2f}"]
    assert table["rows"][-1][-2:] == ["4", "6.00e-04"]


def test_warpage_is_drawn(structure):
    joints = [{"name": name, "x": x, "y": y} for name, x, y in zip(NAMES, X, Y, strict=True)]
    scene = warpage.warpage_scene(structure, joints)
    package, board, places = scene.groups
    assert package.displacement[0, :, 2].max() == pytest.approx(BOW["package"]) and scene.fields[0].unit == "µm"
    assert board.triangles > 0 and len(places.points) == len(NAMES) and scene.parts[-4:] == NAMES
    lifts, gaps = warpage.profiles(structure)
    assert max(lifts.series[0].y) == pytest.approx(BOW["package"] / MICRO, rel=1e-3)
    assert len(gaps.series) == 2


def test_neighbours_are_distinguished_from_the_package_by_their_parts():
    parts = [
        "solder@A1",
        "substrate",
        "substrate_column@A1",
        "die",
        "copper_board",
        "board_patch",
        "die_pmic",
        "solder_u2",
    ]
    assert [name for name in parts if is_neighbour(name)] == ["die_pmic", "solder_u2"]
    roles = ["solder", "substrate", "substrate", "die", "copper", "board", "other packages", "other packages"]
    assert [role_of(name) for name in parts] == roles


def test_no_structure_no_section(tmp_path):
    assert warpage.read_structure(tmp_path) is None


def test_stresses_of_both_modes_differ_by_their_factor():
    times = np.array([0.5e-3, 1.0e-3])
    reference, ours = interface(NAMES, X, Y, times), interface(NAMES, X, Y, times, 1.01)
    both = {"two_scale": ours, "dns": reference}
    assert section.comparable(both) == NAMES
    assert section.difference(ours, reference, NAMES, times[1]) == pytest.approx(0.01)
    assert section.areas(ours, "A3").sum() == pytest.approx((0.34 * MILLI) ** 2)
    table = section.table(both)
    assert [row[0] for row in table["rows"]] == ["0.5", "1"]
    assert table["rows"][1][1:3] == ["6.575", "A4"]
    assert table["rows"][1][-1] == "1 %"
    scene = section.interface_scene(both)
    assert scene.fields[0].high == pytest.approx(6.575, rel=1e-3) and scene.frames == ["0.5 ms", "1 ms"]
    assert [text for text, _ in scene.labels] == ["two-scale", "DNS"]
    assert scene.groups[1].points[:, 0].min() > scene.groups[0].points[:, 0].max()


def test_a_dns_that_ends_early_is_compared_as_far_as_it_goes():
    ours = interface(NAMES, X, Y, np.array([0.5e-3, 1.0e-3]))
    both = {"two_scale": ours, "dns": interface(NAMES, X, Y, np.array([0.5e-3]), 2.0)}
    rows = section.table(both)["rows"]
    assert rows[0][-1] == "75 %" and rows[1][-4:] == ["–", "–", "–", "–"]
    values = section.interface_scene(both).groups[1].values[section.STRESS]
    assert np.isfinite(values[0]).all() and np.isnan(values[1]).all()


def test_times_are_compared_by_time_and_not_by_place_in_the_file():
    reference = interface(NAMES, X, Y, np.array([0.5e-3, 0.50004e-3, 1.0e-3]))
    ours = interface(NAMES, X, Y, np.array([0.50002e-3, 1.00002e-3]))
    rows = section.table({"two_scale": ours, "dns": reference})["rows"]
    assert rows[2][1] == rows[2][4] == "6.510"  # both at 1 ms
    assert section.row_at(ours, 0.7e-3) is None


def test_joints_with_other_faces_are_not_compared():
    times = np.array([1.0e-3])
    reference, ours = interface(NAMES, X, Y, times), interface(NAMES, X, Y, times)
    ours["von_mises@A3"] = ours["von_mises@A3"][:, :9]
    assert section.comparable({"two_scale": ours, "dns": reference}) == ["A4", "B3", "B4"]
    assert section.comparable({"two_scale": ours}) == []
    assert len(section.table({"dns": reference})["head"]) == 4


def history_of(*peaks: float) -> dict[str, np.ndarray]:
    """Return a history whose joints have peaks of stress."""
    wave = np.sin(np.linspace(0.0, np.pi, 21))
    stress = np.outer(wave, peaks)
    return {"time": np.linspace(0.0, 1e-3, 21), "joints": np.array(NAMES), "peel_board": stress,
            "peel_package": 0.5 * stress}  # fmt: skip


def test_the_shape_effect_belongs_to_the_critical_joint():
    real, flat = history_of(40e6, 90e6, 50e6, 60e6), history_of(40e6, 75e6, 50e6, 80e6)
    joints = [{"name": name, "standoff": 0.3e-3} for name in NAMES]
    words = shape_effect.in_words(real, flat)
    assert "raise the peak peel stress of A4 by 20 %: 90 MPa instead of 75 MPa" in words
    assert "B4 would be critical" in words
    assert shape_effect.table(real, flat, joints)["rows"][0] == ["A4", "90.00", "75.00", "+20.00 %", "300.0"]
    pressed = shape_effect.in_words(real, history_of(0.0, 0.0, 0.0, 0.0))
    assert "raise the peak peel stress of A4: 90 MPa instead of 0 MPa" in pressed
    line, peaks = shape_effect.curves(real, flat)
    assert max(line.series[0].y) == pytest.approx(90.0)
    assert peaks.x.names == ["A4", "B4", "B3", "A3"] and peaks.series[1].y == pytest.approx([75.0, 80.0, 50.0, 40.0])


def record(name: str, **others) -> dict:
    """Return the record of a joint; ``others`` replace entries."""
    pad = {"name": name, "x": 0.0, "y": 0.0, "shape": "A4", "standoff": 3e-4, "max_width": 5e-4, "verdict": "ok"}
    return pad | others


def test_the_worst_mesh_of_equal_joints_is_reported():
    joints = [
        record("A4", method="swept", volume_error=1e-4, minimum_scaled_jacobian=0.7, shape_deviation=1e-6),
        record("A3", method="swept", volume_error=-2e-3, minimum_scaled_jacobian=0.5, shape_deviation=3e-6),
        record("B4", shape="B4", standoff=4e-4, method="free-form", volume_error=0.0, minimum_scaled_jacobian=0.25),
    ]
    table = mesh_tables.meshes(joints)
    assert table["head"] == ["joints", "method", "volume error", "largest deviation [µm]", "min. scaled Jacobian"]
    assert table["rows"] == [
        ["A4 A3", "swept", "-0.2 %", "3.000", "0.50"],
        ["B4", "free-form", "< 0.0001 %", "–", "0.25"],
    ]
    assert mesh_tables.meshes([record("A4")]) is None
    assert [item["value"] for item in headline(joints)] == ["300–400 µm", "3 / 2"]


def test_records_are_complete_for_what_has_run(tmp_path):
    (tmp_path / "reflow").mkdir()
    pads = [{"name": name, "x": 0.0, "y": 0.0, "tilt": [3e-3, 4e-3]} for name in ("A4", "B4")]
    metrics = {"standoff": {"value": 3e-4, "unit": "m"}}
    (tmp_path / "reflow/pads.json").write_text(json.dumps(pads))
    joint = {"shape": "A4", "verdict": "ok", "metrics": metrics}
    (tmp_path / "reflow/joints.json").write_text(json.dumps({"A4": joint, "B4": joint}))
    by_ct = {"standoff": 2e-4, "contact_angle_board": 2.0, "contact_angle_package": 2.5, "given": "b4.stl"}
    (tmp_path / "surface").mkdir()
    (tmp_path / "surface/surfaces.json").write_text(json.dumps({"A4": {"standoff": 1.0}, "B4": by_ct}))
    reflowed, imported = joint_records(tmp_path)
    assert (reflowed["standoff"], reflowed["verdict"], reflowed["tilted"]) == (3e-4, "ok", pytest.approx(5e-3))
    assert (imported["standoff"], imported["verdict"], imported["shape"]) == (2e-4, "given", "B4")
    assert imported["angles"] == "114.6 / 143.2"


def test_maps_show_what_the_joints_have():
    joints = [record(name, x=x, y=y, tilted=1e-3) for name, x, y in zip(NAMES, X, Y, strict=True)]
    joints[1]["verdict"] = "open"
    standoff, _, tilt = array_maps(joints)
    assert (standoff.label, tilt.label, tilt.size) == ("standoff [µm]", "tilt of the package pad [mrad]", (2.0, 2.0))
    assert [(cell["x"], cell["y"], cell["ok"]) for cell in tilt.cells] == [
        (0.5, 0.5, True), (1.5, 0.5, False), (0.5, 1.5, True), (1.5, 1.5, True),
    ]  # fmt: skip
    assert tilt.cells[0]["full"] == "1 mrad" and tilt.cells[0]["text"] == "1.00"


def test_small_kinematics_are_reported_where_they_matter():
    metrics = {
        "peak_neglected_strain": {"value": 8e-3, "unit": ""},
        "peak_board_strain": {"value": 2.2e-3, "unit": ""},
        "deflection_over_thickness": {"value": 7.6, "unit": ""},
    }
    note = shock.kinematics_note(metrics, "small")
    assert "7.6 times its thickness" in note and "up to 8000 µm/m" in note and '= "auto"' in note
    assert shock.kinematics_note(metrics, "finite") == ""
    assert shock.kinematics_note({"peak_neglected_strain": {"value": 1e-6, "unit": ""}}, "small") == ""


def test_costs_are_listed_with_the_published_ones():
    model = {"window": 80e-9, "step": 10e-9, "substeps": 8, "windows": 100, "ranks": 2}
    dns = {"model": model | {"mode": "dns", "elements": {"dns": 1000}}, "timings": {"windows": 200.0}, "metrics": {}}
    ours = {
        "model": model | {"mode": "two_scale", "elements": {"macro": 900, "meso": 200}},
        "timings": {"windows": 50.0},
        "metrics": {},
        "coupling": {"levels": [{"step": 80e-9}, {"step": 10e-9}], "placement": {"chosen": "shared by 2"}},
    }
    table = cost.table({"two_scale": ours, "dns": dns}, {"two_scale_dns_core_ratio": {"value": 0.25, "unit": ""}})
    rows = {row[0]: row[1:] for row in table["rows"]}
    assert rows["core time / DNS"] == ["1", "0.250", "1.0", "0.285"]
    assert rows["wall time of windows"][:2] == ["3.3 min", "50.0 s"]
    assert rows["hexahedra"][1] == "900 macro + 200 meso"
    assert rows["time step"] == ["10 ns", "80 ns, 10 ns", "–", "–"]
    assert rows["steps"][:2] == ["800", "100, 800"]
    assert "memory" not in rows
    assert cost.table({"two_scale": ours}, {}) is None


def test_residual_stress_is_ranked_by_the_worse_pad():
    joints = {"joints": ["A3", "A4"], "von_mises_board": [20e6, 10e6], "von_mises_package": [15e6, 30e6],
              "von_mises_max": [40e6, 50e6], "plastic_strain_max": [1e-3, 2e-3]}  # fmt: skip
    table = residual.table(joints)
    assert table["rows"] == [["A4", "10.00", "30.00", "50.00", "0.2 %"], ["A3", "20.00", "15.00", "40.00", "0.1 %"]]
    assert len(residual.table({key: joints[key] for key in list(joints)[:4]})["head"]) == 4
    metrics = {
        "solidified_warpage": {"value": 8e-5, "unit": "m"},
        "room_temperature_warpage": {"value": 2e-5, "unit": "m"},
        "residual_stress_joint": {"value": "A4", "unit": ""},
        "residual_stress_largest": {"value": 30e6, "unit": "Pa"},
    }
    assert "from 80.00 µm to 20.00 µm and leaves 30 MPa at the pads of A4" in residual.in_words(metrics)


@pytest.mark.parametrize(("standoff", "axis"), [([0.3e-3, 0.4e-3], "standoff [mm]"), ([0.3e-3, 0.3e-3], "time [ms]")])
def test_the_force_of_a_moved_package_is_drawn_over_what_changes(standoff, axis):
    """Over the standoff of a pull, over time of a push aside, which has no exact force."""
    varies = standoff[0] != standoff[1]
    exact = [2e-3 if varies else np.nan] * 2
    columns = {"time": [0.0, 1e-3], "standoff": standoff, "pull": [2e-3, 3e-3], "pull_exact": exact}
    chart = pull_chart({name: np.array(column) for name, column in columns.items()})
    assert chart.x.label == axis
    assert [line.name for line in chart.series] == ["particles", "Young-Laplace"][: 1 + varies]


@pytest.mark.parametrize(("moves", "label", "last"), [(True, "time [ms]", 3.0), (False, "step", 2.0)])
def test_a_history_is_drawn_over_time_where_that_means_something(moves, label, last):
    names = ("time", "height", "width", "energy", "capillary_number", "time_step")
    history = {name: np.array([1.0, 3.0]) * MILLI for name in names} | {"step": np.array([1.0, 2.0])}
    charts = history_curve(history, moves)
    assert [chart.x.label for chart in charts] == 4 * [label]
    assert all(series.x[-1] == pytest.approx(last) for chart in charts for series in chart.series)


def test_joints_that_flowed_with_inertia_show_what_took_their_energy():
    relaxed = {"name": "A3", "shape": "A3", "standoff": 3e-4, "axial_force": -1e-5}
    assert "smoothing loss" not in mesh_tables.shapes([relaxed])["head"]
    table = mesh_tables.shapes([relaxed | {"smoothing_loss": 0.02, "viscous_loss": 3e-5, "energy_imbalance": -1e-9}])
    row = dict(zip(table["head"], table["rows"][0], strict=True))
    assert row["upward force on the package [mN]"] == "-0.010"
    assert (row["smoothing loss"], row["viscous loss"]) == ("2 %", "0.003 %")
