"""Structures as cases: units in named tables and lists, refused with key, value, range and nearest name; forecasts."""

import tomllib
from pathlib import Path

import jsonschema
import pytest

from reflowshock.workflow.case.fields import display_values
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.template import case_text, templates
from reflowshock.workflow.store.keys import compare, stage_inputs
from reflowshock.workflow.structure.forecast import forecast_structure
from reflowshock.workflow.structure.report import meshed_part
from tests.support.case_schema import validate

BOARD = Path(__file__).resolve().parents[2] / "pipeline" / "structure.toml"
POKE = "kind='point_force',at=['1 mm','-2 mm','0 mm'],direction=[0,0,-1]"
FINITE = ["dynamics.solver=explicit", "dynamics.kinematics=finite"]
SECOND_LAYER = "structure.layers.cover.material=coper"
BAD_VALUES = {
    "unknown key of a load": ("loads.drop.pekk=3 G", ["loads.drop.pekk", "unknown key", "mean loads.drop.peak?"]),
    "wrong dimension": ("loads.drop.peak=3 mm", ["loads.drop.peak", "is a length; expected an acceleration", "> 0 G"]),
    "unknown kind": ("loads.drop.kind=inputg", ["loads.drop.kind", "input_g, gravity, pressure, motion", "input_g?"]),
    "no kind": ("loads.push.peak=3 MPa", ["loads.push.kind: is missing", "one of input_g"]),
    "no table": ("loads.drop=3", ["loads.drop = 3: must be a table"]),
    "no tables": ("loads=3", ["loads = 3: must be a table"]),
    "out of range": ("structure.layers.board.thickness=-1 mm", ["layers.board.thickness", '"-1 mm"', "> 0 mm"]),
    "incomplete layer": ("structure.layers.top.material=copper", ["structure.layers.top.thickness: is missing"]),
    "unknown material": (SECOND_LAYER, ["layers.cover.material", '"coper"', "FR4", "did you mean copper?"]),
    "list too short": ('structure.holes.spacing=["1 mm"]', ["structure.holes.spacing", "list of 2 items", "in mm"]),
    "list too long": ('watch.centre.at=["1 mm","1 mm","1 mm","1 mm"]', ["watch.centre.at", "list of 3 items"]),
    "item without unit": ('structure.holes.spacing=["24 mm","3"]', ["structure.holes.spacing", 'such as "3 mm"']),
    "item out of range": ("structure.cells=[0,3]", ["structure.cells = [0, 3]", ">= 1 and <= 2000"]),
    "item out of range in an optional list": (
        "structure.layers.board.in_plane=[0,3]",
        ["structure.layers.board.in_plane = [0, 3]", ">= 1 and <= 2000"],
    ),
    "item unknown": ('structure.symmetry=["z"]', ["structure.symmetry", "any of x, y"]),
    "unknown name": ("structure.element=hexahedra", ["structure.element", "did you mean hexahedron?"]),
    "unknown condition": ("loads.drop.service_condition=X", ["service_condition", "one of A, B, C"]),
    "facet set": ("supports.holes.on=mounting_hole", ["supports.holes.on", "did you mean mounting_holes?"]),
    "point outside": ('watch.centre.at=["1 m","0 m","0 m"]', ["watch.centre.at", "outside the meshed body"]),
    "holes outside": ('structure.holes.spacing=["29 mm","14 mm"]', ["holes.spacing", '"29 mm"', "4 mm to 27 mm"]),
    "force without unit": (f"loads.poke={{{POKE},peak=3}}", ["loads.poke.peak", 'such as "3 N"']),
    "force without course": (f"loads.poke={{{POKE}}}", ["loads.poke: is given by nothing", "peak, or table"]),
    "force without place": ("loads.poke={kind='point_force',peak='1 N'}", ["loads.poke.at: is missing"]),
    "force outside": (f"loads.poke={{{POKE},peak='1 N',duration='1 ms'}}", ["loads.poke.at", "outside the meshed"]),
    "support that holds nothing": ("supports.edge.on=x_min", ["supports.edge.hold", "any of x, y, z, or a bedding"]),
    "springs on a fixed face": (
        "supports.holes.bedding.x=1e12 N/m^3",
        ["supports.holes.bedding.x", "is held by supports.holes.hold"],
    ),
    "bedding of another dimension": ("supports.holes.bedding.x=3 N/m", ["bedding.x", "expected a stiffness per area"]),
    "negative bedding": ("supports.holes.bedding.x=-3 N/m^3", ["bedding.x", ">= 0"]),
    "mass outside": (
        "masses.lid={mass='1 g',at=['20 mm','0 mm','0 mm']}",
        ["masses.lid.at", "outside the meshed body"],
    ),
    "mass in a hole": ("masses.lid={mass='1 g',at=['12 mm','7 mm','0 mm']}", ["masses.lid.at", "mounting hole"]),
    "no mass": ("masses.lid={mass='0 g',at=['0 mm','0 mm','0 mm']}", ["masses.lid.mass", "> 0 g"]),
    "footprint outside": (
        "masses.lid={mass='1 g',at=['12 mm','0 mm','0 mm'],footprint=['8 mm','2 mm']}",
        ["masses.lid.footprint", "outside the meshed body"],
    ),
    "footprint across a plane of symmetry": (
        "masses.lid={mass='1 g',at=['0 mm','1 mm','0 mm'],footprint=['8 mm','4 mm']}",
        ["masses.lid.footprint", "crosses the plane of symmetry y = 0"],
    ),
    "footprint of no length": (
        "masses.lid={mass='1 g',at=['0 mm','0 mm','0 mm'],footprint=['0 mm','4 mm']}",
        ["masses.lid.footprint", "> 0 mm"],
    ),
    "accelerometer without direction": ("watch.centre.direction=[0,0,0]", ["watch.centre.direction", "no length"]),
    "filter without corner": ("dynamics.filter.kind=butterworth", ["dynamics.filter.corner", "is missing"]),
    "samples too far apart": ("dynamics.filter.channel_class=1e5", ["history_samples = 50", ">= 167"]),
    "unknown solver": ("dynamics.solver=implict", ["dynamics.solver", "did you mean implicit?"]),
    "too many ranks": ("dynamics.ranks=4096", ["dynamics.ranks", "4096 MPI ranks", "--oversubscribe"]),
    "other case": ("structure.layers.cover.material=fr4", ["did you mean FR4?"]),
    "no support": ("supports={}", ["loads.drop.method", "needs a support that moves with the table"]),
    "too many steps": ("dynamics.duration=1e300 s", ["dynamics.duration", "would take more than 1e+10 explicit steps"]),
    "damped too much": (
        "dynamics.damping={stiffness_ratio=0.9,frequency='1e-6 Hz'}",
        ["dynamics.duration", "would take more than 1e+10 explicit steps of"],
    ),
    "beyond all numbers": ("structure.layers.board.thickness=1e-200 mm", ["structure", "out of range"]),
    "value in a material": ("materials.cover.density=3 mm", ["materials.cover.density", "is a length"]),
    "layer named as a face": (
        "structure.layers.z_max={material='FR4',thickness='1 mm'}",
        ["structure.layers.z_max", "is not a valid name of a layer"],
    ),
}


@pytest.mark.parametrize(("setting", "words"), BAD_VALUES.values(), ids=BAD_VALUES.keys())
def test_bad_values_are_named(setting, words):
    with pytest.raises(CaseError) as caught:
        read_case(BOARD, [setting], force=True)
    text = "\n".join(caught.value.lines())
    assert [word for word in words if word not in text] == []


def test_a_step_above_the_critical_one_is_refused_where_it_is_known():
    case = BOARD.parents[2] / "cases" / "cantilever" / "case.toml"
    setting = "dynamics.numerics.explicit_step=1 ms"
    with pytest.raises(CaseError, match=r"explicit_step = \"1 ms\": exceeds the critical step.*allowed: <= .* ns"):
        read_case(case, [setting])
    for other in ("dynamics.solver=implicit", "dynamics.numerics.critical_step=power_iteration"):
        read_case(case, [setting, other])


def test_the_report_names_the_meshed_part():
    wholes = {"[]": "", '["y"]': "half", '["x", "y"]': "quarter", '["y", "y"]': "half"}
    for symmetry, part in wholes.items():
        assert meshed_part(read_case(BOARD, [f"structure.symmetry={symmetry}"])) == part


BAD_REFERENCES = {
    "no such point": ("bar_wave", "references.wave.transmitted=beyon", ["wave.transmitted", "did you mean beyond?"]),
    "wrong order": (
        "bar_wave",
        'references.wave.incident=["second","first"]',
        ["references.wave", "below 60 mm, upwards"],
    ),
    "no pressure": (
        "jedec_board",
        "references.x={kind='cantilever',load='drop',tip='centre'}",
        ["references.x.load", "is not a constant pressure"],
    ),
    "not sudden": (
        "cantilever",
        "loads.wind={kind='pressure',on='z_max',peak='1 Pa',duration='1 s'}",
        ["not a constant pr"],
    ),
    "no such load": ("cantilever", "references.tip.load=wnd", ["references.tip.load", "did you mean wind?"]),
    "too many layers": (
        "cantilever",
        "structure.layers.top={material='FR4',thickness='1 mm'}",
        ["references.tip.kind", "2 layers", "1 in structure.layers"],
    ),
    "no pulse": (
        "bar_wave",
        "references.x={kind='layered_bar',load='pull',incident=['first','second'],transmitted='beyond'}",
        ["references.x.load", "no such load"],
    ),
    "no such mode": ("jedec_board", "references.first_mode.mode=9", ["references.first_mode.mode = 9", "<= 6"]),
}


@pytest.mark.parametrize(("name", "setting", "words"), BAD_REFERENCES.values(), ids=BAD_REFERENCES.keys())
def test_references_that_cannot_be(name, setting, words):
    with pytest.raises(CaseError) as caught:
        read_case(templates()[name], [setting])
    text = "\n".join(caught.value.lines())
    assert [word for word in words if word not in text] == []


def test_units_in_lists_and_named_tables():
    case = read_case(BOARD, ["loads.drop.peak=1200 G", "structure.layers.board.thickness=0.8 mm"])
    assert case.loads["drop"].peak == pytest.approx(1200 * 9.80665)
    assert case.structure.layers["board"].thickness == pytest.approx(8e-4)
    assert case.structure.holes.spacing == pytest.approx((24e-3, 14e-3))
    assert list(case.structure.layers) == ["board", "cover"]
    values = display_values(case)
    assert values["structure.holes.spacing"] == "[24 mm, 14 mm]"
    assert values["loads.drop.peak"] == "1200 G"


def test_a_new_case_is_equal_to_its_template(tmp_path):
    case = read_case(BOARD)
    path = tmp_path / "again.toml"
    path.write_text(case_text(case, "structure"))
    assert display_values(read_case(path)) == display_values(case)
    validate(path)


def test_the_schema_refuses_a_number_without_unit():
    table = tomllib.loads(BOARD.read_text())
    table["structure"]["holes"]["spacing"] = [24.0, 14.0]
    with pytest.raises(jsonschema.ValidationError):
        validate(table)


def test_a_stage_depends_on_what_it_reads():
    case = read_case(BOARD)
    louder, longer = read_case(BOARD, ["loads.drop.peak=900 G"]), read_case(BOARD, ["structure.length=31 mm"])
    geometry, shock = case.pipeline["geometry"], case.pipeline["shock"]
    assert stage_inputs(louder, geometry) == stage_inputs(case, geometry)
    changes = compare(stage_inputs(case, shock), stage_inputs(louder, shock))
    assert [change.key for change in changes] == ["loads.drop.peak"]
    assert stage_inputs(longer, geometry) != stage_inputs(case, geometry)


def test_what_a_table_of_a_load_holds_is_a_parameter(tmp_path):
    path = tmp_path / "case.toml"
    text = BOARD.read_text().replace('peak = "1000 G"\nduration = "0.1 ms"\n', 'table = "pulse.csv"\n')
    path.write_text(text)
    (tmp_path / "pulse.csv").write_text("time [ms], acceleration [G]\n0,0\n0.1,1000\n")
    before = stage_inputs(read_case(path), read_case(path).pipeline["shock"])
    assert before["loads.drop.table"] == str(tmp_path / "pulse.csv")
    (tmp_path / "pulse.csv").write_text("time [ms], acceleration [G]\n0,0\n0.1,100\n")
    after = stage_inputs(read_case(path), read_case(path).pipeline["shock"])
    assert [change.key for change in compare(before, after)] == ["loads.drop.table.sha256"]


def test_an_unreadable_table_is_refused(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(BOARD.read_text().replace('peak = "1000 G"\nduration = "0.1 ms"\n', 'table = "pulse.csv"\n'))
    with pytest.raises(CaseError, match=r"loads\.drop\.table = .*does not exist"):
        read_case(path)


def test_a_force_is_in_the_schema_the_template_and_the_plan(tmp_path):
    (tmp_path / "force.csv").write_text("time [ms], force [mN]\n0,0\n0.1,1000\n")
    (tmp_path / "case.toml").write_text(BOARD.read_text())
    poke = POKE.replace("-2 mm", "2 mm")
    settings = [f"loads.poke={{{poke},peak='2 kN',duration='0.1 ms'}}", f"loads.push={{{poke},table='force.csv'}}"]
    case = read_case(tmp_path / "case.toml", settings)
    assert case.loads["poke"].peak == 2000.0
    assert forecast_structure(case).effects["point_force"] == {"on": True, "why": "loads.poke, loads.push"}
    again = tmp_path / "again.toml"
    again.write_text(case_text(case, "structure"))
    assert 'kind = "point_force"' in again.read_text()
    assert display_values(read_case(again)) == display_values(case)
    validate(again)
    with pytest.raises(CaseError, match="is not plausible"):
        read_case(tmp_path / "case.toml", [f"loads.poke={{{poke},peak='1e4 kN',duration='0.1 ms'}}"])
    (tmp_path / "force.csv").write_text("time [ms], force [G]\n0,0\n0.1,1\n")
    with pytest.raises(CaseError, match="needs its unit in brackets, one of N, mN, kN"):
        read_case(tmp_path / "case.toml", settings)


@pytest.mark.parametrize(
    ("setting", "step"),
    [
        ("structure.element=hexahedron", 1.0),
        ("structure.element=tetrahedron", 0.7),
        ("structure.formulation=one_point", 1.0),
    ],
)
def test_sizes_and_steps_are_foreseen(setting, step):
    outlook, plain = forecast_structure(read_case(BOARD, [setting])), forecast_structure(read_case(BOARD))
    share = 6 if "tetra" in setting else 1
    assert outlook.layers["board"].elements == share * plain.layers["board"].elements
    assert outlook.steps["explicit"] == pytest.approx(step * plain.steps["explicit"], rel=0.15)


def test_either_solver_has_a_cost():
    outlook = forecast_structure(read_case(BOARD, ["dynamics.solver=explicit"]))
    both = forecast_structure(read_case(BOARD))
    assert outlook.seconds["shock"] < both.seconds["shock"]
    assert outlook.solvers.only_explicit == ()
    assert forecast_structure(read_case(BOARD, FINITE)).solvers.only_explicit[0].startswith("finite rotations")


def test_effects_have_reasons():
    effects = forecast_structure(
        read_case(BOARD, ["dynamics.solver=explicit", 'dynamics.numerics.mass_scaled=["cover"]'])
    ).effects
    assert effects["input_g"] == {"on": True, "why": "loads.drop"}
    assert not effects["finite_rotation"]["on"]
    assert effects["mass_scaling"]["why"].startswith("dynamics.numerics.mass_scaled = ['cover']")


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        (
            "loads.push.duration=10 ns",
            r'loads.push.duration = "10 ns": is shorter than one coupling window .* no dynamics.coup',
        ),
        ("dynamics.duration=12 us", r'dynamics.duration = "12 µs": the run ends before the waves of references.wave'),
    ],
)
def test_two_models_of_a_bar_need_time(setting, words):
    with pytest.raises(CaseError, match=words):
        read_case(templates()["two_scale_bar"], [setting])


def test_a_window_of_layers_that_are_all_scaled_is_the_step():
    case = read_case(templates()["two_scale_bar"], ['dynamics.numerics.mass_scaled=["lower","upper"]'])
    assert forecast_structure(case).coupled.substeps == 1
