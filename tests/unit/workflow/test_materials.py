"""Materials of a structure: user-defined and library materials; impossible ones are rejected by key."""

from pathlib import Path

import pytest

from reflowshock.workflow.case.fields import display_values
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case

STRUCTURE = Path(__file__).resolve().parents[2] / "pipeline" / "structure.toml"
LAMINATE = (
    'materials.cover={ kind = "general_orthotropic", density = "1850 kg/m^3", young_modulus_x = "20 GPa",'
    ' young_modulus_y = "20 GPa", young_modulus_z = "5 GPa", poisson_ratio_xy = 0.2, poisson_ratio_yz = 0.3,'
    ' poisson_ratio_xz = RATIO, shear_modulus_xy = "8 GPa", shear_modulus_yz = "2 GPa", shear_modulus_xz = "2 GPa" }'
)
BAD_VALUES = {
    "zero density": ("materials.cover.density=0 g/cm^3", ['density = "0 g/cm^3"', "out of range", "> 0 kg/m^3"]),
    "negative density": ("materials.cover.density=-1 g/cm^3", ["materials.cover.density", "> 0 kg/m^3"]),
    "no density": ('materials.cover={ kind = "isotropic" }', ["materials.cover.density", "is missing"]),
    "incompressible": ("materials.cover.poisson_ratio=0.5", ["poisson_ratio = 0.5", "> -1 and < 0.5"]),
    "not positive definite": (
        LAMINATE.replace("RATIO", "1.9"),
        ["materials.cover.poisson_ratio_xz = 1.9", "energy would not be positive", "> -1."],
    ),
    "molten": (
        'materials.cover.plasticity={ A = "20 MPa", melting_temperature = "20 degC" }',
        ['materials.cover.plasticity.melting_temperature = "20 degC"', "> 25 degC, the room_temperature"],
    ),
    "layer without a material": ("structure.layers.cover.material=SAC30", ["did you mean SAC305?"]),
}


@pytest.mark.parametrize(("setting", "words"), BAD_VALUES.values(), ids=BAD_VALUES.keys())
def test_bad_materials_are_named(setting, words):
    with pytest.raises(CaseError) as caught:
        read_case(STRUCTURE, [setting])
    assert [word for word in words if word not in str(caught.value)] == []


def test_a_layer_takes_nine_constants_or_a_solder_that_yields():
    settings = ["dynamics.solver=explicit", "structure.layers.board.material=SnPb"]
    case = read_case(STRUCTURE, [*settings, LAMINATE.replace("RATIO", "0.3")])
    materials = case.problem.layer_materials
    assert materials["cover"].young_modulus_z == pytest.approx(5e9)
    assert materials["board"].plasticity.melting_temperature == pytest.approx(456.15)


def test_constants_of_plasticity_are_shown_in_the_units_of_users():
    law = 'materials.cover.plasticity={ A = "20 MPa", C = 0.1, reference_rate = "0.001 s^-1" }'
    values = display_values(read_case(STRUCTURE, ["dynamics.solver=explicit", law]))
    assert values["materials.cover.plasticity.A"] == "20 MPa"
    assert values["materials.cover.plasticity.reference_rate"] == "0.001 s^-1"
    assert values["materials.cover.temperature"] == "25 degC"
