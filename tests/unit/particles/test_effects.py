import subprocess
import sys

import pytest

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.effects import decide_drop, decide_effects, dimensionless_numbers
from reflowshock.particles.parameters.solder import Solder, SolderEffects

JOINT = JointGeometry(0.31e-3, 0.24e-3, 0.24e-3)
BALL = Solder(volume=0.0724e-9)


def test_numbers_of_the_default_joint():
    numbers = dimensionless_numbers(JOINT, BALL)
    assert numbers.bond == pytest.approx(0.0148, rel=0.01)
    assert numbers.ohnesorge == pytest.approx(2.06e-3, rel=0.01)
    assert numbers.viscous_time == pytest.approx(0.0585, rel=0.01)


def test_a_long_process_is_quasi_static():
    decided = decide_effects(JOINT, BALL)
    assert not decided["inertia"]["on"]
    assert not decided["viscosity"]["on"]
    assert "quasi-static" in decided["inertia"]["why"]
    assert decided["surface_tension"]["on"]
    assert decided["wall_adhesion"]["on"]


def test_a_short_process_has_inertia_and_viscosity():
    decided = decide_effects(JOINT, Solder(volume=BALL.volume, process_time=0.1))
    assert decided["inertia"]["on"]
    assert decided["viscosity"]["on"]


def test_gravity_depends_on_the_bond_number():
    assert decide_effects(JOINT, BALL)["gravity"]["on"]
    assert not decide_effects(JOINT, Solder(volume=BALL.volume, gravity=1.6))["gravity"]["on"]


def test_surface_tension_has_no_rival_without_gravity():
    puddle = {"volume": 2e-5}
    assert not decide_drop(Solder(**puddle), is_free=False)["surface_tension"]["on"]
    weightless = Solder(**puddle, effects=SolderEffects(gravity="off"))
    for decided in (decide_drop(weightless, is_free=False), decide_drop(Solder(**puddle), is_free=True)):
        assert decided["surface_tension"]["on"]


@pytest.mark.parametrize("switch", ["on", "off"])
def test_the_user_decides_if_he_wants_to(switch):
    solder = Solder(volume=BALL.volume, effects=SolderEffects(gravity=switch, inertia=switch))
    decided = decide_effects(JOINT, solder)
    assert decided["gravity"]["on"] == decided["inertia"]["on"] == (switch == "on")
    assert "by the user" in decided["gravity"]["why"]


@pytest.mark.parametrize(
    "module",
    ["parameters.effects", "parameters.checks", "parameters.estimate", "core.geometry", "parameters.solder"],
)
def test_planning_loads_neither_numba_nor_petsc(module):
    code = f"import sys, reflowshock.particles.{module}; assert not {{'numba', 'petsc4py'}} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
