"""Temperatures in a case file, thermal expansion of materials, and messages for impossible values."""

import tomllib

import pytest

from reflowshock.materials.library import FR4, LIBRARY
from reflowshock.workflow.case.fields import display_values
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.template import case_text
from reflowshock.workflow.reflow.forecast import load_steps
from tests.support.workflow_command import SMALL_CASE

PAPER = ['thermal.peak="200 degC"', 'thermal.melting="25 degC"', 'thermal.solidification="200 degC"']
MOVED = ['thermal.package="moved"', 'thermal.corner_displacement="-0.1 mm"']
GLASS = 'materials.board={ kind = "isotropic", density = "2 g/cm^3", young_modulus = "70 GPa", poisson_ratio = 0.2 }'


def read(*settings: str):
    """Return the shortened case without warpage, with settings."""
    return read_case(SMALL_CASE, ['warpage.corner="0 mm"', *settings], oversubscribe=True)


def test_without_the_table_nothing_warms_up():
    assert read_case(SMALL_CASE, oversubscribe=True).thermal is None


def test_a_new_case_shows_the_table_as_it_would_be_written():
    text = case_text(read_case(SMALL_CASE, oversubscribe=True), "small").split("# [thermal]")[1].split("\n[case]")[0]
    lines = [
        line[2:] for line in text.splitlines() if line.startswith(("# [", "# ")) and ("[" in line or " = " in line)
    ]
    written = tomllib.loads("\n".join(["[thermal]", *(line for line in lines if "= ..." not in line)]))
    assert written["thermal"]["peak"] == "245 degC"
    assert written["thermal"]["effects"] == {"flexible": "auto", "solder_force": "auto", "residual_stress": "off"}


def test_joints_that_overflow_where_the_package_is_lowest_are_not_for_ispg():
    """Moved 0.17 mm down both lines are on the mask, as drawn neither is; with 0.02 mm neither."""
    moved = [*PAPER, MOVED[0], "solder.effects.inertia=on"]
    near, far = ([*moved, f'thermal.corner_displacement="{way} mm"'] for way in (-0.02, -0.17))
    assert read(*near).solder.numerics.scheme == "ispg"
    with pytest.raises(CaseError, match=r"overflow both pads.*gap of 0\.14 mm"):
        read(*far, "solder.numerics.scheme=ispg")
    with pytest.raises(CaseError, match="load steps are at rest"):
        read(*far)


def test_the_package_is_lowest_in_a_load_step():
    for way in ("-0.1 mm", "0.1 mm"):
        thermal = read("thermal.steps=3", MOVED[0], f'thermal.corner_displacement="{way}"').thermal
        assert thermal.lowest_corner == min(step.corner for step in load_steps(thermal))


def test_the_papers_course_of_temperatures():
    case = read(*PAPER, *MOVED)
    thermal, values = case.thermal, display_values(case)
    assert thermal.melting == thermal.reference == pytest.approx(298.15)
    assert [thermal.corner(t) for t in (298.15, 385.65, 473.15)] == pytest.approx([0.0, -0.5e-4, -1e-4])
    assert (values["thermal.peak"], values["thermal.corner_displacement"]) == ("200 degC", "-0.1 mm")
    assert values["materials.board.thermal_expansion_out_of_plane"] == "84 ppm/K"


def test_a_material_expands_as_it_says():
    assert read(
        "thermal.steps=2", GLASS.replace(" }", ', thermal_expansion = "9 ppm/degC" }')
    ).materials.board.expansion
    assert read(GLASS).materials.board.unknown_expansion == ("thermal_expansion",)
    assert FR4.expansion == (16e-6, 16e-6, 84e-6)
    assert not any(material.unknown_expansion for material in LIBRARY.values())


def test_with_inertia_joints_flow_by_ispg_in_a_process_that_leaves_them_time():
    solder = read("thermal.steps=1", "solder.effects.inertia=on").solder
    assert (solder.numerics.scheme, solder.effects.inertia) == ("ispg", "on")
    assert read("thermal.steps=1").solder.numerics.scheme == "energy"


FAULTS = {
    "cools": (['thermal.peak="5 degC"'], ['thermal.peak = "5 degC"', ">= 25 degC, the reference"]),
    "melts above the peak": (PAPER[:1], ["thermal.melting", ">= 25 degC, the reference and <= 200 degC, the peak"]),
    "freezes above the peak": (
        ['thermal.solidification="250 degC"'],
        ['thermal.solidification = "250 degC"', "<= 245 degC, the peak"],
    ),
    "liquid in the end": (['thermal.final="0.5 kK"'], ["thermal.final", "<= 217 degC, the solidification"]),
    "no temperature": (['thermal.peak="3 mm"'], ["is a length; expected a temperature"]),
    "floats and is moved": (MOVED[1:], ["thermal.corner_displacement", "cannot be combined with package = floating"]),
    "moved nowhere": (MOVED[:1], ["thermal.corner_displacement: is missing"]),
    "name": (["thermal.corner_displacment=1"], ["did you mean thermal.corner_displacement?"]),
    "crushed": (
        [*PAPER, MOVED[0], 'thermal.corner_displacement="-0.25 mm"'],
        ['thermal.corner_displacement = "-0.25 mm"', "leaves 0.06 mm of the 0.31 mm gap", "> -0.2376 mm"],
    ),
    "ispg": (["thermal.steps=1", "solder.numerics.scheme=ispg"], ['scheme = "ispg"', "joints without inertia"]),
    "tetrahedra": (
        ["thermal.steps=1", "solder.numerics.scheme=energy", "solder.effects.inertia=on"],
        ["solder.effects.inertia", "load steps are at rest", "with the scheme ispg"],
    ),
    "too fast": (
        ["thermal.steps=1", "solder.effects.inertia=on", "solder.process_time=10 ms"],
        ["solder.process_time", "load steps are at rest", "the motion matters", "a slower process"],
    ),
    "switch": (["thermal.effects.flexible=yes"], ["one of auto, on, off"]),
    "steps": (["thermal.steps=0"], [">= 1 and <= 200"]),
    "warped twice": (
        ["thermal.steps=1", 'warpage.corner="0.08 mm"'],
        ["warpage.corner", "which computes the warpage", "thermal.effects.flexible = off"],
    ),
    "no expansion": (["thermal.steps=1", GLASS], ["materials.board.thermal_expansion: is missing", "16 ppm/K"]),
    "no expansion coefficient": (
        [GLASS.replace(" }", ', thermal_expansion = "9 K" }')],
        ["materials.board.thermal_expansion", "expected a thermal expansion, e.g. in ppm/K"],
    ),
}


@pytest.mark.parametrize(("settings", "words"), FAULTS.values(), ids=FAULTS.keys())
def test_impossible_courses_are_refused_by_key(settings, words):
    with pytest.raises(CaseError) as caught:
        read(*settings)
    assert [word for word in words if word not in str(caught.value)] == []
