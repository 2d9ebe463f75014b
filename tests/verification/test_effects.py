"""Every registered effect: no cost when off, and a negligible change when on in a case that does not need it."""

import ast
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.grids import grid, mesh_of
from reflowshock.fem.coupling.one_way import OneWay
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.estimates.board_damping import BoardDampingEffect
from reflowshock.fem.estimates.drop_effects import (
    NEGLIGIBLE_STIFFENING,
    NEGLIGIBLE_WEIGHT,
    Failing,
    WeightEffect,
    called_for,
)
from reflowshock.fem.forces.force import force_terms
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.loads.pretension import Pretension
from reflowshock.fem.mesh.supports import held_components
from reflowshock.fem.model.steps import mass_factor
from reflowshock.fem.problem.failure import Failure
from reflowshock.fem.problem.shock import BoardDamping, JointCoupling
from reflowshock.fem.problem.thermal import Thermal
from reflowshock.fem.statics.plates import RigidPlates
from reflowshock.fem.statics.structure import ThermalStructure
from reflowshock.materials.library import FR4, SAC305, SILICON
from reflowshock.materials.plasticity import plastic_constants
from reflowshock.parameters import with_value
from reflowshock.particles.parameters.effect_gravity import NEGLIGIBLE_SHAPE_CHANGE
from reflowshock.particles.parameters.effects import LIQUID_EFFECTS, decide, decide_drop, drop_numbers
from reflowshock.particles.parameters.solder import SolderEffects
from reflowshock.workflow.board_drop.fine_joints import needs_coarse_joints
from reflowshock.workflow.case.case import CASES
from reflowshock.workflow.effects.registry import registry
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.reflow.between import open_structure
from reflowshock.workflow.reflow.forecast import load_steps
from reflowshock.workflow.verdict.criterion import JudgedDrop
from reflowshock.workflow.verdict.verdict import verdict_of
from tests.support import effect_switches as scene
from tests.support.drops import solve_drop
from tests.support.effect_switches import ELSEWHERE_OFF, ELSEWHERE_ON
from tests.support.fem_residual import cooled, layered
from tests.support.thermal_models import small_structure

ROOT = Path(__file__).parents[2]
G, STEPS = scene.G, 40
Check = Callable[..., None]
OFF: dict[str, Check] = {}
ON: dict[str, Check] = {}


def off(*names: str) -> Callable[[Check], Check]:
    """Return a decorator that registers a check of effects that are off."""
    return lambda check: [OFF.__setitem__(name, check) for name in names] and check


def on(*names: str) -> Callable[[Check], Check]:
    """Return a decorator that registers a check of effects that are on."""
    return lambda check: [ON.__setitem__(name, check) for name in names] and check


@pytest.mark.parametrize("name", registry())
def test_off_costs_nothing(name, tmp_path):
    covering_test = ELSEWHERE_OFF.get(name)
    exists(covering_test) if covering_test else OFF[name](registry()[name], tmp_path)


@pytest.mark.parametrize("name", registry())
def test_irrelevant_effect_changes_almost_nothing(name, tmp_path):
    covering_test = ELSEWHERE_ON.get(name) or own_test(name)
    exists(covering_test) if covering_test else ON[name](registry()[name], tmp_path)


@pytest.mark.parametrize("name", registry())
def test_object_is_at_its_registered_location(name):
    module, _, attribute = registry()[name].implementation.rpartition(".")
    assert hasattr(import_module(module), attribute)


def own_test(name: str) -> str | None:
    """Return the test of an irrelevant effect in a file of its own, or None without such a file."""
    path = f"tests/verification/test_effect_{name}.py"
    return f"{path}::test_irrelevant_effect_changes_almost_nothing" if (ROOT / path).exists() else None


def exists(test: str) -> None:
    """Assert that a test exists, given as file and name."""
    path, _, name = test.partition("::")
    defined = ast.walk(ast.parse((ROOT / path).read_text()))
    assert any(isinstance(item, ast.FunctionDef) and item.name == name for item in defined), test


def steps_of(motion) -> dict:
    """Return the calls of some steps of a compiled motion."""
    scene.step_of(motion)
    return scene.calls(lambda: [scene.step_of(motion) for _ in range(STEPS)])


# The reflow: an effect is an object in the lists of `Physics`.


@off(*(effect.name for effect in LIQUID_EFFECTS))
def _(effect, _folder):
    """A step makes the same calls as with lists without the object and enters none of its code."""
    module, _, kind = effect.implementation.rpartition(".")
    # Wetting pins vertices by all other forces, so their lists cannot be compared.
    is_force = not effect.of_motion and effect.name != "wall_adhesion"
    others = scene.RESTING | ({"wall_adhesion": False} if is_force else {})
    acting, taken, left_out = (scene.flow_with(others | {effect.name: on}) for on in (True, False, False))
    taken.physics = scene.without(acting.physics, getattr(import_module(module), kind))
    for acts in (True, False):
        scene.flow_with(others | {effect.name: acts}).step()  # compile before counting
    counts = [scene.calls(flow.step) for flow in (taken, left_out, acting)]
    assert counts[0] == counts[1]
    assert not scene.enters(counts[1], effect.implementation)
    assert scene.enters(counts[2], effect.implementation)


@on("gravity")
def _(_effect, _folder):
    light = scene.SOLDER.model_copy(update={"gravity": 0.25})
    decision = decide_drop(light, is_free=False)["gravity"]
    assert not decision["on"]
    switched = light.model_copy(update={"effects": SolderEffects(gravity="on")})
    heights = [solve_drop(solder, 6)[1].history(1.0)["height"][-1] for solder in (light, switched)]
    assert 0.0 < 1.0 - heights[1] / heights[0] < NEGLIGIBLE_SHAPE_CHANGE


THICK = {"pad_contact_angle": 0.5 * np.pi, "viscosity": 0.5, "gravity": 0.0}


@cache
def thick_heights(process_time: float) -> list[float]:
    """Return the heights of a thick drop at rest, without inertia and viscosity and with both."""
    thick = scene.SOLDER.model_copy(update=THICK | {"process_time": process_time})
    both = thick.model_copy(update={"effects": SolderEffects(inertia="on", viscosity="on")})
    return [solve_drop(solder, 5)[1].history(1.0)["height"][-1] for solder in (thick, both)]


@on("inertia", "viscosity")
def _(effect, _folder):
    """In a quasi-static process a drop of 90 degrees changes less than by resolution."""
    thick = scene.SOLDER.model_copy(update=THICK)
    numbers = drop_numbers(thick)
    slowest = max(numbers.capillary_time, numbers.viscous_time)
    long = thick.model_copy(update={"process_time": 21.0 * slowest})
    assert not decide(numbers, long)[effect.name]["on"]
    heights = thick_heights(process_time=long.process_time)
    exact = (1.5 * thick.volume / np.pi) ** (1.0 / 3.0)
    assert abs(heights[1] - heights[0]) < 0.2 * min(abs(height - exact) for height in heights)


@on("surface_tension", "wall_adhesion")
def _(effect, _folder):
    """Where the Bond number requires neither effect, gravity is more than ten times stronger."""
    heavy = scene.SOLDER.model_copy(update={"gravity": 6.0e3})
    assert not decide_drop(heavy, is_free=False)[effect.name]["on"]
    flow = scene.flow_with(scene.RESTING, solder=heavy)
    pushes = {type(force).__name__: np.linalg.norm(force.force(flow.body)) for force in flow.physics.forces}
    kind = effect.implementation.rpartition(".")[2]
    assert pushes[kind] < 0.1 * pushes["Gravity"]


# Temperatures of the reflow.


@off("thermal")
def _(effect, _folder):
    """Without a temperature rise there is one load step, flat at the reference."""
    flat = Thermal.model_validate(dict.fromkeys(("reference", "peak", "melting", "solidification", "final"), 298.15))
    assert {step.temperature for step in load_steps(flat)} == {298.15}
    assert effect.threshold is None


@on("thermal")
def _(_effect, folder):
    structure = ThermalStructure.build(MPI.COMM_SELF, small_structure(folder, gravity=0.0))
    state = structure.solve(Thermal().reference, 0.0, np.zeros((4, 2, 6)), np.zeros(len(structure.rigid_modes.names)))
    assert np.abs(state.displacement).max() < 1e-15


@off("flexible")
def _(effect, folder):
    """With rigid plates no structure is built or evaluated."""
    assembly = small_structure(folder)
    rigid = RigidPlates(assembly)
    called = scene.calls(lambda: rigid.solve(473.15, 0.0, np.zeros((4, 2, 6)), np.zeros(1)))
    assert not scene.enters(called, effect.implementation)
    assert open_structure.__module__ == "reflowshock.workflow.reflow.between"


@off("solder_force")
def _(_effect, folder):
    """Wrenches that bend nothing cost as much as no wrenches."""
    counts = []
    for switch, force in (("off", 1e-3), ("on", 0.0)):
        structure = ThermalStructure.build(MPI.COMM_SELF, small_structure(folder, effects={"solder_force": switch}))
        wrenches, rigid = np.full((4, 2, 6), force), np.zeros(len(structure.rigid_modes.names))
        called = scene.calls(lambda s=structure, w=wrenches, r=rigid: s.solve(473.15, 0.0, w, r))
        counts.append({key: count for key, count in called.items() if key[0].startswith("fem")})
    assert counts[0] == counts[1]


@off("residual_stress")
def _(_effect, _folder):
    body, step = scene.strip()
    assert not [term for term in body.terms if isinstance(term, Pretension)]
    called = steps_of(scene.motion_of(body, step))
    assert not [key for key in called if key[0].startswith("reflowshock.fem.statics")]


@on("residual_stress")
def _(_effect, _folder):
    mesh = layered(np.linspace(0, 1e-3, 3), np.linspace(0, 7e-4, 3), {"board": [1e-4], "die": [2e-4]})
    hot, same = (cooled(mesh, {"board": FR4, "die": SILICON}, change) for change in (-192.0, -1e-9))
    assert np.abs(same.stress).max() < 1e-10 * np.abs(hot.stress).max()


# Materials.


def terms(material, kinematics="small") -> list:
    """Return the force terms of a strip of a material."""
    elements = scene.strip()[0].elements
    return force_terms(elements, [material], kinematics, 1e-8)


@off("plasticity", "strain_rate", "thermal_softening")
def _(_effect, _folder):
    """Elastic solder is computed by the terms of elastic elements, without history arrays."""
    elastic = terms(SAC305.elastic)
    assert not any(isinstance(term, NonlinearElements) or term.history for term in elastic)
    assert [type(term) for term in elastic] == [type(term) for term in terms(FR4)]
    assert any(term.history for term in terms(SAC305))


@on("plasticity")
def _(_effect, _folder):
    """Far below the yield stress the force equals the force of elastic elements to round-off."""
    body = scene.strip()[0]
    small = 1e-7 * np.random.default_rng(0).normal(size=body.local.points.shape)
    forces = []
    for material in (SAC305, SAC305.elastic):
        forces.append(np.zeros_like(small))
        body = scene.strip(material=material)[0]
        for term in body.terms:
            term.add(small * 1e-3, forces[-1])
    assert forces[0] == pytest.approx(forces[1], rel=1e-9, abs=1e-9 * np.abs(forces[1]).max())


@on("strain_rate")
def _(_effect, _folder):
    """Plastic flow below the reference rate is independent of the rate for any C."""
    law = SAC305.plasticity.model_copy(update={"reference_rate": 1e12})
    laws = [law, law.model_copy(update={"C": 0.0})]
    forces = []
    for item in laws:
        plastic_term = terms(SAC305.model_copy(update={"plasticity": item}))[0]
        stretch = 2e-3 * scene.strip()[0].local.points[:, :1] * [1.0, 0.0, 0.0]
        forces.append(np.zeros_like(stretch))
        plastic_term.add(stretch, forces[-1])
    assert np.array_equal(*forces)


@on("thermal_softening")
def _(_effect, _folder):
    cold = SAC305.model_copy(update={"temperature": SAC305.plasticity.room_temperature})
    law = SAC305.plasticity.model_copy(update={"m": 0.1})
    assert np.array_equal(plastic_constants(cold), plastic_constants(cold.model_copy(update={"plasticity": law})))


# The shock.


@off("gravity_in_the_shock", "damping", "large_mass")
def _(effect, _folder):
    """A plain drop has only the pulse as a load, and a step makes the same calls as with this list given explicitly."""
    body, step = scene.strip()
    plain = scene.loads_of(body, scene.shock())
    switched = {
        "gravity_in_the_shock": {"gravity": "on"},
        "damping": {"damping": BoardDamping(mass_coefficient=1.0)},
        "large_mass": {"method": "large_mass"},
    }[effect.name]
    acting = scene.loads_of(body, scene.shock(**switched))
    by_hand = [scene.BodyAcceleration(scene.DOWN, scene.HalfSine(1500 * G, 5e-4))]
    counts = [steps_of(scene.motion_of(body, step, loads)) for loads in (plain, by_hand, acting)]
    assert [type(load) for load in plain] == [type(load) for load in by_hand]
    assert counts[0] == counts[1] != counts[2]


@on("gravity_in_the_shock")
def _(_effect, _folder):
    body, step = scene.strip()
    left_out = WeightEffect.by_peak("auto", 1500 * G, G)
    assert not left_out["on"] and left_out["influence"] < NEGLIGIBLE_WEIGHT
    both = [scene.moved(body, step, scene.loads_of(body, scene.shock(gravity=g)), 3e-4)[1] for g in ("off", "on")]
    assert 0.0 < both[1] / both[0] - 1.0 < 1.2 * left_out["influence"]


@on("damping")
def _(_effect, _folder):
    body, step = scene.strip()
    duration, rate = 3e-4, 1.0
    damped = scene.shock(damping=BoardDamping(mass_coefficient=rate))
    drop = SimpleNamespace(shock=damped, duration=duration, frequency=1.5e4 / (2 * np.pi))
    predicted = BoardDampingEffect().decide(drop)["influence"]
    both = [scene.moved(body, step, scene.loads_of(body, item), duration)[1] for item in (scene.shock(), damped)]
    assert abs(both[1] / both[0] - 1.0) < predicted < 1e-3


@off("finite_rotation")
def _(_effect, _folder):
    body, _ = scene.strip()
    assert not any(isinstance(term, NonlinearElements) or term.history for term in body.terms)
    called = steps_of(scene.motion_of(body, 1e-9))
    assert not [key for key in called if "nonlinear" in key[0]]


@on("finite_rotation")
def _(_effect, _folder):
    """The ends are clamped; deflections are the limit of small kinematics and one thickness."""
    changes = {}
    for peak in (30.0 * G, 3000.0 * G):
        drop = scene.shock(peak_acceleration=peak)
        deflections = []
        for kinematics in ("small", "finite"):
            body, step = scene.strip(kinematics)
            deflections.append(scene.moved(body, step, scene.loads_of(body, drop), 4e-4)[1])
        kinematics, _ = called_for(deflections[0] / scene.THICKNESS, cooled=True)
        changes[kinematics] = abs(deflections[1] / deflections[0] - 1.0)
    assert changes["small"] < NEGLIGIBLE_STIFFENING < changes["finite"]


@off("one_way")
def _(_effect, _folder):
    for name in ("held_velocity", "local_steps", "impulse", "gravouil_combescure"):
        assert not isinstance(scheme_of(name), OneWay)
    assert isinstance(scheme_of("held_velocity", "one_way"), OneWay)


@off("coarse_joints")
def _(_effect, _folder):
    assert not needs_coarse_joints(JointCoupling())
    assert needs_coarse_joints(JointCoupling(fine_joints="critical"))


@off("mass_scaling")
def _(_effect, _folder):
    rank_elements = SimpleNamespace(roles=np.array(["copper", "solder"]), steps=np.array([1e-9, 4e-9]))
    assert np.array_equal(mass_factor(rank_elements, (), 4e-9), [1.0, 1.0])
    assert np.array_equal(mass_factor(rank_elements, ("copper",), 4e-9), [16.0, 1.0])


@on("mass_scaling")
def _(_effect, _folder):
    """A thousandth of added mass lowers the frequency of a free vibration by half of that."""
    body, step = scene.strip()
    heavier = replace(body, mass=1.001 * body.mass)
    both = [scene.moved(item, step, scene.loads_of(item, scene.shock()), 3e-4)[1] for item in (body, heavier)]
    assert abs(both[1] / both[0] - 1.0) < 2e-3


@off("symmetry")
def _(_effect, _folder):
    mesh = mesh_of(*grid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0]), "board", {})
    assert not held_components(mesh).any()


@off("failure")
def _(_effect, _folder):
    assert not Failing.by_limits(Failure.model_validate({"board_deflection": {"apply": "off"}}))["on"]


@on("failure")
def _(_effect, _folder):
    """The verdict does not change the history."""
    rng = np.random.default_rng(0)
    arrays = {name: rng.random((5, 2)) for name in ("peel_board", "peel_package")} | {"joints": np.array(["A1", "B1"])}
    arrays |= {"time": np.arange(5.0), "board_centre": np.zeros((5, 3))}
    before = {name: value.copy() for name, value in arrays.items()}
    limit = {"peel_stress": {"limit": 1e9, "source": "none breaks"}}
    case = read_case(CASES / "jedec_bga/case.toml", oversubscribe=True)
    case = with_value(case, "shock.failure", Failure.model_validate(limit))
    assert verdict_of(JudgedDrop(case, {}, arrays))["design"] == "PASS"
    assert all(np.array_equal(arrays[name], before[name]) for name in arrays)
