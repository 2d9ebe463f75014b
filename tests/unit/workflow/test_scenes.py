"""Kinds of case: a drop, a joint; refused with place, key, value, range and nearest name where they cannot be."""

from pathlib import Path

import pytest

from reflowshock.workflow.case.fields import display_values
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.template import templates, write_new_case
from reflowshock.workflow.solder.case import DropCase, JointCase, check_joint
from reflowshock.workflow.solder.forecast import forecast_solder
from reflowshock.workflow.store.keys import stage_inputs
from tests.support.case_schema import validate
from tests.support.workflow_command import WHO_COMPUTES

CASES = Path(__file__).resolve().parents[3] / "cases"
DROP, BALL, JOINT, FREE = (
    CASES / name / "case.toml" for name in ("sessile_drop", "bga_ball", "solder_joint", "laplace_drop")
)
PAIR = CASES / "coalescence" / "case.toml"
SWING = CASES / "oscillating_drop" / "case.toml"
BAD_VALUES = {
    "tilt too large": (JOINT, "joint.tilt=35 deg", ["joint.tilt", '"35 deg"', "< 30 deg"]),
    "package that rolls off": (JOINT, 'joint.package.free=["shift", "turn"]', ["joint.package.free", "rolls off"]),
    "unknown direction": (JOINT, 'joint.package.free=["lfit"]', ["any of lift, shift, turn", "did you mean lift?"]),
    "no direction": (JOINT, "joint.package.free=[]", ["joint.package.free = []", "at least one item"]),
    "load too heavy": (JOINT, "joint.package.load=1 N", ["joint.package.load", '"1000 mN"', "< ", "0.12 mm, too low"]),
    "load of a length": (JOINT, "joint.package.load=1 mm", ["joint.package.load", "expected a force"]),
    "path to nowhere": (JOINT, "joint.path.steps=3", ["ends where it starts"]),
    "path into the pad": (JOINT, "joint.path.standoff=0.05 mm", ["joint.path.standoff", ">= 0.12 mm"]),
    "path past the pad": (JOINT, "joint.path.offset=0.5 mm", ["joint.path.offset", "< 0.48 mm"]),
    "drops that overlap": (PAIR, "drops.distance=0.5 mm", ["drops.distance", '"0.5 mm"', ">= 0.8832 mm", "overlap"]),
    "drops that never touch": (PAIR, "drops.distance=1.5 mm", ["drops.distance", "0.8832 mm to 0.9332 mm", "reach"]),
    "drops not meant to merge": (PAIR, "drops.merge=false", ["drops.distance", ">= 1.133 mm", "drops.merge = false"]),
    "no switch": (PAIR, "drops.merge=no", ["drops.merge", "true or false"]),
    "coarser than a drop": (PAIR, "drops.spacing=0.5 mm", ["drops.spacing", "<= 0.1575 mm", "too coarse"]),
    "gravity on free drops": (PAIR, "gravity=on", ['gravity = "on"', "no wall"]),
    "amplitude too large": (SWING, "oscillation.amplitude=0.5", ["oscillation.amplitude = 0.5", "<= 0.3"]),
    "fewer than two shells": (SWING, "oscillation.particles_per_radius=1", ["particles_per_radius = 1", ">= 2"]),
    "too viscous to swing": (SWING, "solder.viscosity=2 Pa*s", ["solder.viscosity", "< 0.9401 Pa*s", "not oscillate"]),
    "gravity of a swing": (SWING, "solder.gravity=1 m/s^2", ["solder.gravity", "unknown key"]),
    "angle of a full turn": (DROP, "drop.contact_angle=190 deg", ['"190 deg"', "out of range", "< 180 deg"]),
    "angle of zero": (DROP, "drop.contact_angle=0 deg", ["drop.contact_angle", "> 0 deg"]),
    "spacing larger than the drop": (FREE, "drop={volume='1 mm^3',spacing='5 mm'}", ["drop.spacing", "<= 0.25 mm"]),
    "no number": (DROP, "drop.contact_angle=nan", ["drop.contact_angle = nan", 'such as "1 deg"']),
    "name of a folder": (DROP, "case.name=../x", ["case.name", "is not a valid name", "letters, digits"]),
    "two resolutions": (DROP, "drop.spacing=0.1 mm", ["drop.spacing", '"0.1 mm"', "particles_per_edge = 11"]),
    "unknown set": (DROP, "solder.parameters=papre", ["one of physical, paper", "did you mean paper?"]),
    "unknown key": (DROP, "drop.angle=60 deg", ["drop.angle", "unknown key", "contact_angle"]),
    "unknown switch": (DROP, "gravity=of", ['gravity = "of"', "one of auto, on, off", "did you mean off?"]),
    "unknown scheme": (
        DROP,
        "solder.numerics.scheme=gripk",
        ["of auto, energy, ispg, gripc", "did you mean gripc?"],
    ),
    "explicit step": (DROP, "solder.numerics.scheme=gripc", ["solder.numerics.time_step_limit", '"100"', "<= 1"]),
    "basis without its scheme": (DROP, "solder.numerics.basis=linear", ['basis = "linear"', 'scheme = "gripc"']),
    "ispg without inertia": (DROP, "solder.numerics.scheme=ispg", ['scheme = "ispg"', "without inertia", "energy"]),
    "ispg of a joint at rest": (JOINT, "solder.numerics.scheme=ispg", ['scheme = "ispg"', "joints without inertia"]),
    "ispg of two drops at rest": (PAIR, "solder.numerics.scheme=ispg", ['scheme = "ispg"', "drops without inertia"]),
    "no surface tension": (JOINT, "solder.effects.surface_tension=off", ["effects.surface_tension", "to rest"]),
    "two kinds": (DROP, "package.rows=3", ["[package] and [drop]", "exactly one of [package], [drop], [joint], "]),
    "pad that repels": (BALL, "drop.contact_angle=150 deg", ["drop.contact_angle", "< 148 deg", "better"]),
    "pad too small": (BALL, "drop.pad_radius=0.01 mm", ["drop.pad_radius", '"0.01 mm"', "with a volume of", ">= 0.09"]),
    "even count cut in half": (
        DROP,
        "drop={volume='1 mm^3',contact_angle='60 deg',particles_per_edge=10,symmetry='half'}",
        ['drop.symmetry = "half"', "10 particles along an edge", "an odd number"],
    ),
    "volume without end": (JOINT, "joint.volume=1000 mm^3", ["joint.spacing", "does not fit", ">= "]),
    "gravity without a wall": (FREE, "gravity=on", ['gravity = "on"', "auto, off", "no wall"]),
    "pad without an angle": (FREE, "drop.pad_radius=0.01 mm", ["drop.pad_radius", "only with drop.contact_angle"]),
    "angle and hysteresis": (DROP, "drop.advancing_angle=90 deg", ["drop.advancing_angle", "or drop.contact_angle"]),
    "half a hysteresis": (FREE, "drop.receding_angle=30 deg", ["drop.receding_angle", '"30 deg"', "alone"]),
    "advancing angle out of range": (FREE, "drop.advancing_angle=181 deg", ['"181 deg"', "< 180 deg"]),
    "too coarse": (JOINT, "joint.spacing=0.3 mm", ["joint.spacing", '"0.3 mm"', "too coarse", "<= 0.1"]),
    "offset past the pad": (JOINT, "joint.offset=0.5 mm", ["joint.offset", "< 0.48 mm", "do not overlap"]),
}


def problems_of(path: Path, *settings: str) -> str:
    with pytest.raises(CaseError) as caught:
        read_case(path, settings)
    return "\n".join(caught.value.lines())


@pytest.mark.parametrize(("path", "setting", "words"), BAD_VALUES.values(), ids=BAD_VALUES.keys())
def test_bad_values_are_named(path, setting, words):
    text = problems_of(path, setting)
    assert [word for word in words if word not in text] == [], text


def test_a_neck_must_be_resolved_and_an_open_joint_is_left_to_the_flow():
    text = problems_of(JOINT, "joint.volume=0.024 mm^3", "joint.spacing=0.1 mm")
    assert "joint.spacing" in text and "neck" in text
    assert check_joint(read_case(JOINT, ["joint.volume=0.01 mm^3"])) == []


def test_a_spacing_larger_than_the_drop(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(DROP.read_text().replace("particles_per_edge = 11", 'spacing = "2 mm"'))
    text = problems_of(path)
    assert 'drop.spacing = "2 mm"' in text and "cube of 1 mm" in text and "<= 0.25 mm" in text


def test_a_receding_angle_above_the_advancing_one():
    text = problems_of(FREE, "drop.receding_angle=80 deg", "drop.advancing_angle=60 deg")
    assert 'drop.receding_angle = "80 deg"' in text and "< 60 deg" in text


def test_a_package_floats_or_is_moved():
    text = problems_of(JOINT, "joint.path.standoff=0.3 mm", "joint.package.load=1 mN")
    assert "joint.path" in text and "not both" in text


@pytest.mark.parametrize(
    ("setting", "key"),
    [
        ("solder.numerics={scheme='gripc',time_step_limit=0.5}", "solder.numerics.scheme"),
        ("solder.effects.inertia=on", "solder.effects.inertia"),
    ],
)
def test_a_path_goes_from_rest_to_rest_at_least_energy(setting, key):
    assert key in problems_of(JOINT, "joint.path.standoff=0.3 mm", setting)


SPEED = "joint.path={standoff='0.5 mm',speed='100 mm/s'}"
GALERKIN = "solder.numerics.scheme=ispg"


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ([SPEED], ['joint.path.speed = "100 mm/s"', "without inertia", 'inertia = "on"']),
        (
            [SPEED, "solder.effects.inertia=on", "solder.numerics.scheme=energy"],
            ["solder.numerics.scheme", "at a speed (100 mm/s)", "ispg"],
        ),
        (["joint.path.standoff=0.5 mm", GALERKIN, "solder.effects.inertia=on"], ["or joint.path.speed with"]),
        (["joint.path={speed='100 mm/s'}", GALERKIN, "solder.effects.inertia=on"], ["ends where it starts"]),
        (["joint.path={standoff='0.5 mm',speed='0 mm/s'}"], ["joint.path.speed", "> 0"]),
        (
            ["joint.path={standoff='0.5 mm',speed='100 mm/s',steps=4}", GALERKIN, "solder.effects.inertia=on"],
            ["joint.path.steps = 4", "without stops"],
        ),
        (
            ["joint.path={standoff='0.5 mm',speed='1000 mm/s'}", GALERKIN, "solder.effects.inertia=on"],
            ["joint.path.speed", "Weber number", "0.0025 mm/s to 482.3 mm/s"],
        ),
        (
            ["joint.path={standoff='0.5 mm',speed='0.001 mm/s'}", GALERKIN, "solder.effects.inertia=on"],
            ["joint.path.speed", "solder.process_time"],
        ),
        (
            ["joint.package.load=1 mN", GALERKIN, "solder.effects.inertia=on", "solder.wall=no-slip"],
            ["solder.numerics.scheme", "packages that float, on walls with friction"],
        ),
    ],
)
def test_a_package_at_a_speed_needs_inertia_and_the_scheme_ispg(settings, words):
    text = problems_of(JOINT, *settings)
    assert [word for word in words if word not in text] == [], text


def test_a_slow_package_is_predicted_to_take_longer():
    asked = [GALERKIN, "solder.effects.inertia=on"]
    slow, fast = (
        forecast_solder(read_case(JOINT, [f"joint.path={{standoff='0.5 mm',speed='{speed} mm/s'}}", *asked]))
        for speed in (1, 100)
    )
    assert slow.seconds["reflow"] > fast.seconds["reflow"] > forecast_solder(read_case(JOINT, asked)).seconds["reflow"]


@pytest.mark.parametrize("table", [SPEED, "joint.package.load=1 mN"])
def test_packages_move_by_the_scheme_ispg(table):
    assert check_joint(read_case(JOINT, [table, GALERKIN, "solder.effects.inertia=on"])) == []


def test_too_little_solder_pulls_its_package_down():
    text = problems_of(JOINT, "joint.package.load=1 mN", "joint.volume=0.005 mm^3")
    assert 'joint.volume = "0.005 mm^3"' in text and "more solder" in text


def test_a_tilted_pad_stays_above_the_lower_one():
    text = problems_of(JOINT, "joint.tilt=29 deg", "joint.pad_top=0.9 mm", "joint.volume=0.4 mm^3")
    assert "joint.tilt" in text and "< 20." in text


def test_tables_that_are_not_given_are_described(tmp_path):
    text = write_new_case("mine", "solder_joint", tmp_path).read_text()
    assert "# [joint.package]" in text and "# load = " in text and "# [joint.path]" in text


def test_a_file_of_no_kind_names_the_nearest(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text('[case]\nname = "x"\n[dorp]\nvolume = "1 mm^3"\n')
    text = problems_of(path)
    assert text.startswith(str(path)) and "exactly one of [package], [drop], [joint], " in text
    assert "did you mean [drop]?" in text


@pytest.mark.parametrize("name", templates())
def test_every_case_is_a_template(name, tmp_path):
    """A new case is equal to its template, passes the schema, and each of its parameters belongs to a stage."""
    case = read_case(write_new_case("mine", name, tmp_path), oversubscribe=True)
    template = read_case(templates()[name], ["case.name=mine"], oversubscribe=True)
    assert display_values(case) == display_values(template)
    validate(tmp_path / "mine.toml")
    used = {key for stage in case.pipeline.stages for key in stage_inputs(case, stage)}
    used -= {f"{key}.sha256" for key in case.files}  # what its files hold
    assert used == {key for key, _ in _leaves(case.model_dump())} - WHO_COMPUTES


def _leaves(table: dict, prefix: str = ""):
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def test_the_table_says_the_kind():
    kinds = [type(read_case(path, oversubscribe=True)) for path in (CASES / "bga_drop/case.toml", DROP, JOINT)]
    assert kinds == [BoardDropCase, DropCase, JointCase]


def test_parameter_sets_by_name():
    """PHYSICS 1: the paper prints 10 times the surface tension and 100 times the viscosity; one value still counts."""
    physical, paper = read_case(DROP).molten, read_case(DROP, ["solder.parameters=paper"]).molten
    assert (physical.surface_tension, physical.viscosity, physical.density) == (0.4985, 2.27e-3, 8930.0)
    assert (paper.surface_tension, paper.viscosity, paper.density) == (4.985, 0.227, 8930.0)
    mixed = read_case(DROP, ["solder.parameters=paper", "solder.viscosity=1 Pa*s"]).molten
    assert (mixed.surface_tension, mixed.viscosity) == (4.985, 1.0)


def test_the_spacing_of_a_drop():
    assert read_case(DROP).molten.numerics.spacing == pytest.approx(1e-4)
    assert read_case(DROP, ["drop.particles_per_edge=21"]).drop.count == 21


def test_gravity_is_a_switch_of_the_case():
    assert read_case(DROP).molten.effects.gravity == "off"
    assert read_case(DROP, ["gravity=auto"]).molten.effects.gravity == "auto"


def test_the_scheme_is_ours_unless_the_seeds_is_asked_for():
    assert read_case(DROP).molten.numerics.scheme == "energy"
    asked = ["solder.numerics.scheme=gripc", "solder.numerics.time_step_limit=0.5"]
    assert read_case(DROP, asked).molten.numerics.scheme == "gripc"


ISPG = ("drop.particles_per_edge=11",)
HELD = "volume='1 mm^3',receding_angle='60 deg',advancing_angle='90 deg'"


@pytest.mark.parametrize(
    ("setting", "place"),
    [
        ("drop={volume='1 mm^3',contact_angle='5 deg',pad_radius='2 mm'}", "contact angles outside 30 deg to 148 deg"),
        ("drop.contact_angle=155 deg", "contact angles outside 15 deg to 148 deg"),
        ("drop={volume='1 mm^3',particles_per_edge=13}", "13 particles along an edge of a free drop (for 7 to 11"),
        ("drop={volume='1 mm^3',symmetry='half'}", "parts of free drops"),
        ("drop.particles_per_edge=17", "17 particles along an edge (for 5 to 15 it is)"),
        ("drop={volume='1 mm^3',contact_angle='14 deg',particles_per_edge=5}", "contact angles outside 15 deg to 148"),
        ("drop={volume='1 mm^3',contact_angle='20 deg',particles_per_edge=9}", "edge below 30 deg (for 5 to 7 it is)"),
        ("drop={volume='1 mm^3',contact_angle='20 deg',symmetry='half'}", "contact angles outside 30 deg to 148 deg"),
        ("drop={volume='1 mm^3',contact_angle='45 deg',section='plane'}", "contact angles outside 60 deg to 148 deg"),
        (
            "drop={volume='1 mm^3',receding_angle='20 deg',advancing_angle='60 deg',particles_per_edge=7}",
            "contact angles",
        ),
        (f"drop={{{HELD}}}", "11 particles along an edge (for 6 to 9"),
    ],
)
def test_the_scheme_ispg_is_refused_where_it_is_not_verified(setting, place):
    asked = ["solder.numerics.scheme=ispg", "solder.effects.inertia=on", *ISPG]
    assert read_case(DROP, asked).molten.numerics.scheme == "ispg"
    assert place in problems_of(DROP, *asked, setting)


@pytest.mark.parametrize("wall", [("wall=no-slip",), ("wall=slip", "slip_length=0.05 mm")])
def test_the_scheme_ispg_takes_walls_with_friction(wall):
    asked = ["solder.numerics.scheme=ispg", "solder.effects.inertia=on", *ISPG, *(f"solder.{key}" for key in wall)]
    assert read_case(DROP, asked).molten.wall == wall[0].split("=")[1]
    for setting in ("drop.particles_per_edge=5", "drop.particles_per_edge=13"):
        assert "on a wall with friction (for 6 to 12 it is)" in problems_of(DROP, *asked, setting)
    assert "on a pad with friction (for 7 to 9 it is)" in problems_of(BALL, *asked)
    read_case(BALL, [*asked, "drop.particles_per_edge=7"])


IMPACT = ("drop.speed=4.7 m/s", "solder.wall=no-slip", "solder.parameters=paper", "drop.particles_per_edge=7")


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("drop.speed=6 m/s", "Weber number 80, Reynolds number 293 is not verified; allowed: <= 4.743 m/s"),
        ("solder.viscosity=0.1 Pa*s", "Reynolds number 521 is not verified; allowed: <= 2.708 m/s"),
        ("solder.wall=free-slip", "an impact is not verified with a wall that is slid on freely"),
        ("drop.pad_radius=0.4 mm", "an impact is not verified with a pad"),
        ("drop.symmetry=half", "an impact is not verified with planes of symmetry"),
        ("drop.particles_per_edge=6", "for 6 particles along an edge; allowed: 7 to 9 along an edge"),
        ("solder.numerics.scheme=energy", "needs the scheme ispg; or a case with [droplet]"),
    ],
)
def test_a_drop_that_strikes_a_wall_is_refused_where_that_is_not_verified(setting, message):
    asked = ["solder.numerics.scheme=ispg", "solder.effects.inertia=on", *IMPACT]
    assert read_case(DROP, asked).drop.speed == 4.7
    assert message in problems_of(DROP, *asked, setting)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("solder.numerics.scheme=energy", 'needs the scheme "ispg"; allowed: ispg'),
        ("drop.section=oblique", "one of none, axisymmetric, plane"),
        ("drop.pad_radius=0.4 mm", "not of a pad; allowed: none"),
        ("drop={volume='1 mm^3',section='axisymmetric'}", "not of a free drop; allowed: none"),
        ("drop.symmetry=half", "not of half of one; allowed: none"),
        ("drop.particles_per_edge=45", "45 particles along an edge (for 8 to 21 it is)"),
        ("drop.particles_per_edge=7", "7 particles along an edge (for 8 to 21 it is)"),
        ("solder.effects.inertia=off", "drops without inertia"),
        ("solder.wall=no-slip", "not of one that rubs on it; allowed: none"),
        ("drop.speed=4.7 m/s", "an impact is not verified with a section"),
        (f"drop={{{HELD},section='axisymmetric'}}", "hysteresis in section"),
    ],
)
@pytest.mark.parametrize(("section", "particles"), [("axisymmetric", 77), ("plane", 121)])
def test_a_drop_is_refused_in_section_where_that_is_not_verified(section, particles, setting, message):
    asked = [f"drop.section={section}", "solder.numerics.scheme=ispg", "solder.effects.inertia=on"]
    assert read_case(DROP, asked).drop.particles == particles
    assert message in problems_of(DROP, *asked, setting.replace("axisymmetric", section))


def test_the_scheme_ispg_takes_planes_of_symmetry():
    """Tetrahedra do not."""
    asked = ["solder.effects.inertia=on", *ISPG, "drop.symmetry=half"]
    assert "or the scheme ispg" in problems_of(DROP, *asked, "solder.numerics.scheme=energy")
    assert read_case(DROP, asked).molten.numerics.scheme == "ispg"


@pytest.mark.parametrize(
    ("case", "setting", "scheme", "why"),
    [
        (DROP, "solder.effects.inertia=on", "ispg", "costs less than tetrahedra"),
        (DROP, "solder.effects.inertia=off", "energy", "without inertia"),
        (DROP, "drop.section=axisymmetric", "ispg", "no other scheme"),
        (DROP, "drop.section=plane", "ispg", "no other scheme"),
        (DROP, "drop.particles_per_edge=21", "energy", "(for 5 to 15 it is)"),
        (PAIR, "drops.spacing=0.07 mm", "energy", "(up to 2000 it is)"),
        (JOINT, "solder.wall=no-slip", "ispg", "costs less"),
        (DROP, "solder.numerics.scheme=energy", "energy", ""),
    ],
)
def test_with_inertia_the_scheme_that_costs_less_is_taken_where_it_is_verified(case, setting, scheme, why):
    case = read_case(case, ["solder.effects.inertia=on", setting])
    assert case.molten.numerics.scheme == scheme
    assert why in case.decided[1]


@pytest.mark.parametrize("setting", ["joint.tilt=3 deg", "solder.wall=no-slip"])
def test_the_scheme_ispg_takes_joints_with_tilted_plates_and_walls_with_friction(setting):
    read_case(JOINT, ["solder.numerics.scheme=ispg", "solder.effects.inertia=on", setting])


@pytest.mark.parametrize(
    ("setting", "place"),
    [
        ("solder.wall=no-slip", "walls that hold the liquid"),
        ("drops.contact_angle=20 deg", "contact angles outside 30 deg to 148 deg"),
        ("drops.spacing=0.07 mm", "particles (up to 2000 it is)"),
    ],
)
def test_the_scheme_ispg_is_refused_for_two_drops_that_it_is_not_verified_for(setting, place):
    asked = ["solder.numerics.scheme=ispg", "solder.effects.inertia=on"]
    assert read_case(PAIR, asked).molten.numerics.scheme == "ispg"
    assert place in problems_of(PAIR, *asked, setting)


@pytest.mark.parametrize("setting", ["drop.contact_angle=30 deg", "drop.pad_radius=0.3 mm"])
def test_the_scheme_ispg_takes_few_particles_that_become_a_film_or_rest_on_a_pad(setting):
    asked = ["solder.numerics.scheme=ispg", "solder.effects.inertia=on", "drop.particles_per_edge=5"]
    case = BALL if "pad" in setting else DROP
    assert read_case(case, [*asked, setting]).molten.numerics.scheme == "ispg"


def test_the_scheme_ispg_is_refused_for_finer_particles_on_a_pad():
    asked = ["solder.numerics.scheme=ispg", "solder.effects.inertia=on", "drop.pad_radius=0.3 mm"]
    assert "on a pad (up to 11 it is)" in problems_of(BALL, *asked, "drop.particles_per_edge=12")


def test_motion_that_matters_costs_all_steps_allowed():
    calm = forecast_solder(read_case(DROP, ["solder.effects.inertia=off"]))
    asked = ["solder.effects.inertia=on", "solder.numerics.scheme=energy"]
    moving = forecast_solder(read_case(DROP, asked))
    longer = forecast_solder(read_case(DROP, [*asked, "solder.numerics.max_steps=10000"]))
    assert (calm.scheme, moving.scheme) == ("energy", "inertia")
    assert 5.0 * calm.seconds["reflow"] < moving.seconds["reflow"] < 0.2 * longer.seconds["reflow"]
