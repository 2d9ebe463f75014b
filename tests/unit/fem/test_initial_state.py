"""A shock with initial stress from cooling: equilibrium at rest and superposition in linear models."""

from dataclasses import replace

import numpy as np
import pytest

from reflowshock.cases.hard.trials.bodies import motion_of
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.energy_balance import EnergyBalance
from reflowshock.fem.loads.damping import RayleighDamping
from reflowshock.fem.loads.pretension import Pretension
from reflowshock.fem.model.assembly import ForceOptions
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.stress_recovery import StressRecovery
from reflowshock.fem.parallel import checkpoint_state
from reflowshock.fem.run.cooling import choose_pins, rigid_motions
from reflowshock.materials.library import FR4, SAC405, SILICON
from tests.support.fem_residual import Cooled, cooled, layered

CHANGE = -192.0
MATERIALS = {"board": FR4, "solder": SAC405, "die": SILICON}
LAYERS = {"board": [1.5e-4, 1.5e-4], "solder": [1e-4, 1e-4], "die": [2e-4]}


def package(formulation: str = "one_point", kinematics: str = "small", materials: dict | None = None) -> Cooled:
    """Return a distorted package of layers after cooling."""
    mesh = layered(np.linspace(0, 1e-3, 4), np.linspace(0, 7e-4, 3), LAYERS, distorted=0.15)
    return cooled(mesh, materials or MATERIALS, CHANGE, formulation, ForceOptions(kinematics, 1e-9))


def force_at_rest(body: Body) -> np.ndarray:
    """Return the force of a body at rest on free components, shape (n, 3) [N]."""
    force = np.zeros((len(body.mass), 3))
    for term in body.terms:
        term.add(np.zeros_like(force), force)
    return np.where(body.free, force, 0.0)


@pytest.mark.parametrize("formulation", ["one_point", "incompatible_modes"])
@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_nothing_moves_without_a_shock(formulation, kinematics):
    result = package(formulation, kinematics)
    body = result.body
    assert np.abs(force_at_rest(body)).max() < 1e-9 * np.abs(result.thrust).max()
    motion = motion_of(body, 0.5 * result.critical)
    unbalanced = np.abs(result.thrust / body.mass[:, None]).max()
    for _ in range(100):
        motion.advance()
        motion.update_force()
        assert np.abs(motion.acceleration()).max() < 1e-9 * unbalanced
    assert StressRecovery(body, np.arange(len(body.elements.cells))).plastic_strain().max() > 1e-3


def launched(body: Body, step: float) -> ExplicitMotion:
    """Return a damped motion of a body with an initial velocity."""
    motion = motion_of(body, step, [RayleighDamping.build(body, 0.0, 0.01 * step)])
    motion.launch(np.array([0.0, 0.1, 1.0]))
    return motion


def test_stresses_add_where_all_is_linear():
    """With or without pretension as a force, motion and stress are equal; the energy has a reference."""
    result = package(materials=MATERIALS | {"solder": SAC405.elastic})
    step, chosen = 0.5 * result.critical, np.arange(len(result.plain.elements.cells))
    assert isinstance(result.body.terms[-1], Pretension)
    bodies = result.body, replace(result.plain, initial_stress=result.body.initial_stress), result.plain
    motions = [launched(body, step) for body in bodies]
    for _ in range(60):
        for motion in motions:
            motion.advance()
            motion.update_force()
    with_force, added, without = motions
    size = np.abs(without.displacement).max()
    assert np.abs(with_force.displacement - without.displacement).max() < 1e-9 * size
    assert (added.displacement == without.displacement).all()
    stresses = [StressRecovery(motion.body, chosen).stress(motion.displacement) for motion in motions]
    assert stresses[0] == pytest.approx(stresses[1], abs=1e-6 * np.abs(stresses[1]).max())
    assert stresses[1] - stresses[2] == pytest.approx(result.stress, abs=1e-9 * np.abs(result.stress).max())
    stored = result.body.terms[-1].stored
    assert stored > 1e-6
    assert with_force.internal_energy().total - stored == pytest.approx(
        without.internal_energy().total, abs=1e-9 * stored
    )


def test_energy_at_the_beginning_is_a_reference():
    balance = EnergyBalance(limit=0.1, trivial=0.0)
    sums = np.zeros(24)
    sums[1] = 5.0
    assert balance.judge(sums, 0.0)["balance"] == 0.0
    assert balance.largest == 0.0
    sums[1], sums[0] = 4.0, 1.0
    assert balance.judge(sums, 1.0)["balance"] == 0.0
    assert balance.largest == 1.0


def test_state_continues_from_a_checkpoint():
    first, second = package(), package()
    motions = [launched(item.body, 0.5 * item.critical) for item in (first, second)]
    for _ in range(5):
        motions[0].advance()
        motions[0].update_force()
    motions[1].restore(checkpoint_state.values(motions[0].state()))
    for motion in motions:
        motion.advance()
        motion.update_force()
    assert (motions[0].displacement == motions[1].displacement).all()
    assert (motions[0].force == motions[1].force).all()


def test_pins_hold_what_is_left():
    points = np.random.default_rng(1).normal(size=(40, 3))
    held = np.zeros((40, 3), dtype=bool)
    usable = np.arange(40) > 3
    for planes in range(4):
        if planes:
            held[np.arange(4 * planes, 4 * planes + 5), planes - 1] = True
        nodes, components = choose_pins(points, held, usable)
        assert usable[nodes].all()
        assert not held[nodes, components].any()
        everything = held.copy()
        everything[nodes, components] = True
        values = np.linalg.svd(rigid_motions(points)[everything], compute_uv=False)
        assert values[-1] > 0.05
        rank = np.linalg.matrix_rank(rigid_motions(points)[held]) if planes else 0
        assert len(nodes) == 6 - rank
