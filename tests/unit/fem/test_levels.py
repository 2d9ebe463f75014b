"""Step levels against dense matrix functions and exact properties of the equations."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.division.chebyshev import Substeps
from reflowshock.fem.division.choose_levels import StepLimits, choose_levels, governing_steps
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.elements.one_point import ONE_POINT
from reflowshock.fem.errors import LevelError
from reflowshock.fem.forces.energy import Energy
from reflowshock.fem.forces.force import linear_terms
from reflowshock.fem.loads.load import PrescribedVelocity
from reflowshock.fem.loads.pulse import HalfSine
from reflowshock.fem.mesh.tie import Tie, net_load
from reflowshock.fem.model.step_levels import Levels, SubsteppedElements, check_elastic, levels_of
from reflowshock.materials.library import FR4, SAC405
from reflowshock.materials.roles import ELASTIC
from tests.support.fem_bodies import dense_stiffness
from tests.support.fem_levels import Levelled, dense_effective_stiffness, joint_on_board, levelled


@pytest.fixture(scope="module", params=[(12,), (7, 3), (4, 3, 3)], ids=str)
def model(request) -> Levelled:
    """Return a joint on a board with elements on each step level."""
    made = levelled(joint_on_board(), ELASTIC, request.param)
    assert np.bincount(made.level).min() > 0
    return made


@pytest.mark.parametrize("count", [1, 2, 3, 8, 40])
@pytest.mark.parametrize("level", [1, 2, 3])
def test_weights_are_positive_and_add_up_to_one(count, level):
    steps = Substeps.of(count, level)
    assert steps.weight.sum() == pytest.approx(1.0, abs=1e-13)
    assert steps.weight.min() > 0.0
    assert 0.6 < steps.reach <= 1.0


def test_force_is_that_of_the_dense_matrix_function(model):
    expected = dense_effective_stiffness(model)
    assert np.abs(dense_stiffness(model.body) - expected).max() <= 1e-12 * np.abs(expected).max()


def test_effective_stiffness_is_symmetric(model):
    matrix = dense_stiffness(model.body)
    assert np.abs(matrix - matrix.T).max() <= 1e-13 * np.abs(matrix).max()


def total_force(model: Levelled, displacement: np.ndarray) -> np.ndarray:
    """Return the force of all terms with slave forces moved to masters, shape (n, 3)."""
    moved, force = displacement.copy(), np.zeros_like(displacement)
    model.body.tie.spread(moved)
    for term in model.body.terms:
        term.add(moved, force)
    model.body.tie.gather(force)
    return force


def test_rigid_motion_gives_no_force_and_any_motion_no_resultant(model):
    points = model.body.local.points
    rigid = np.array([3e-6, -2e-6, 1e-6]) + np.cross([1e-3, 2e-3, -1e-3], points)
    some = 1e-6 * np.sin(np.arange(points.size)).reshape(-1, 3)
    force, scale = total_force(model, some), np.abs(total_force(model, some)).sum()
    assert np.abs(total_force(model, rigid)).max() <= 1e-10 * scale
    assert np.abs(net_load(points, force)[:3]).max() <= 1e-12 * scale
    assert np.abs(net_load(points, force)[3:]).max() <= 1e-12 * scale * np.abs(points).max()


def test_a_load_on_fine_nodes_bends_them_as_it_bends_the_plain_body(model):
    """K_eff u = f + carry(f) for K u = f: at rest, levels do not change the effect of a load."""
    body = model.body
    (levels,) = levels_of(body.terms)
    free = body.free.ravel()
    load = np.sin(np.arange(free.size)).reshape(-1, 3) * body.free
    carried = levels.carry(load, np.zeros(3))
    assert np.abs(carried).max() > 0.1 * np.abs(load).max()
    displacement = np.zeros_like(load)
    displacement[body.free] = np.linalg.solve(dense_stiffness(model.plain)[np.ix_(free, free)], load[body.free])
    residual = (total_force(model, displacement) + load + carried)[body.free]
    assert np.abs(residual).max() <= 1e-9 * np.abs(total_force(model, displacement)).max()
    scale = np.abs(carried).sum()
    assert np.abs(net_load(body.local.points, carried)).max() <= 1e-12 * scale


def test_only_supports_bear_a_falling_body(model):
    fall, body = np.array([1.0, -0.5, 0.3]), model.body
    carried = body.terms[-1].carry(np.zeros((len(body.mass), 3)), fall)
    assert np.abs(carried).max() > 0.0
    assert np.abs(net_load(body.local.points, carried)).max() <= 1e-12 * np.abs(carried).sum()
    loose = levelled(joint_on_board(held=False), ELASTIC, model.ratios).body
    assert np.all(loose.terms[-1].carry(np.zeros((len(loose.mass), 3)), fall) == 0.0)


def test_what_a_motion_prescribes_does_not_move_in_substeps():
    """Nodes fixed in the motion or in the body give the same force."""
    mesh, ratios = joint_on_board(), (7, 3)
    model, held = levelled(mesh, ELASTIC, ratios), levelled(mesh, ELASTIC, ratios)
    body = model.body
    top = np.flatnonzero(body.local.points[:, 2] == body.local.points[:, 2].max())
    held.body.free[top, 0] = False
    levels = SubsteppedElements.build(MPI.COMM_SELF, held.body, Levels(held.level, ratios, held.window))
    motion = ExplicitMotion(
        body, [PrescribedVelocity(top, 0, HalfSine(1.0, 1e-6))], model.window, np.empty(0, int), 0.0 * body.mass
    )
    motion.displacement[:] = 1e-6 * np.sin(np.arange(motion.displacement.size)).reshape(-1, 3)
    body.tie.spread(motion.displacement)
    force, expected = np.zeros((2, len(body.mass), 3))
    body.terms[-1].add(motion.displacement, force)
    levels.add(motion.displacement, expected)
    assert np.abs(force - expected).max() <= 1e-12 * np.abs(expected).max()


def test_one_substep_is_the_plain_force():
    model = levelled(joint_on_board(), ELASTIC, (12,))
    once = SubsteppedElements.build(MPI.COMM_SELF, model.body, Levels(model.level, (1,), model.window))
    body = replace(model.body, terms=[*model.body.terms[:-1], once])
    plain = dense_stiffness(model.plain)
    assert np.abs(dense_stiffness(body) - plain).max() <= 1e-13 * np.abs(plain).max()


def test_energy_is_that_of_the_effective_stiffness(model):
    displacement = 1e-6 * np.sin(np.arange(3 * len(model.body.mass))).reshape(-1, 3)
    model.body.tie.spread(displacement)
    held = sum((term.energy(displacement) for term in model.body.terms), Energy())
    work = -0.5 * np.vdot(displacement, total_force(model, displacement))
    assert held.strain == pytest.approx(work, rel=1e-12)


def test_hourglass_energy_is_reported_separately():
    model = levelled(joint_on_board(solder=4), ELASTIC, (5, 3))
    body = replace(model.plain, elements=replace(model.plain.elements, kind=ONE_POINT))
    displacement = 1e-6 * np.sin(np.arange(3 * len(body.mass))).reshape(-1, 3)
    body.tie.spread(displacement)
    elements = body.elements.subset(model.level > 0)
    exact = sum((term.energy(displacement) for term in linear_terms(elements)), Energy())
    terms = SubsteppedElements.build(MPI.COMM_SELF, body, Levels(model.level, model.ratios, 1e-6 * model.window))
    assert exact.hourglass > 0.01 * exact.strain
    assert terms.energy(displacement).strain == pytest.approx(exact.strain, rel=1e-9)
    assert terms.energy(displacement).hourglass == pytest.approx(exact.hourglass, rel=1e-9)


def test_levels_need_linear_elastic_elements():
    with pytest.raises(LevelError, match="1 materials yield"):
        check_elastic([SAC405, FR4], "small", (3,))
    with pytest.raises(LevelError, match="kinematics = finite"):
        check_elastic([FR4], "finite", (3,))
    check_elastic([FR4], "small", (3,))


CHAIN = np.column_stack([np.arange(12), np.arange(1, 13)]).astype(np.int32)


def test_levels_grow_by_the_elements_of_their_nodes():
    steps = np.array([1, 1, 1, 1, 0.2, 1, 1, 1, 1, 1, 1, 1.0])
    level, ratios = choose_levels(CHAIN, Tie.none(), StepLimits(steps, np.full(12, 1e6), 0.9, 0.9), 1)
    assert level.tolist() == [0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0]
    assert ratios == (6,)  # 5, and one for the reach of stabilised substeps


def test_masters_of_a_slave_share_its_level():
    cells = CHAIN.copy()
    cells[6:] += 1  # a second chain from node 7, tied to nodes 5 and 6 of the first
    tie = Tie(np.array([7], np.int32), np.array([[5, 6, 6, 6]], np.int32), np.full((1, 4), 0.25))
    steps = np.ones(12)
    steps[6] = 0.4
    assert governing_steps(cells, tie, steps).tolist() == [1, 1, 1, 1, 0.4, 0.4, 0.4, 0.4, 1, 1, 1, 1]
    steps[6], steps[4] = 1.0, 0.3
    assert governing_steps(cells, tie, steps).tolist() == [1, 1, 1, 0.3, 0.3, 0.3, 0.3, 1, 1, 1, 1, 1]


def test_more_levels_are_taken_where_they_pay():
    steps = np.concatenate([np.full(2, 0.05), np.full(20, 0.4), np.ones(40)])
    cells = np.column_stack([np.arange(62), np.arange(1, 63)]).astype(np.int32)
    dear, cheap = (StepLimits(steps, np.full(62, cost), 1.0, 1.0) for cost in (1e6, 1.0))
    assert choose_levels(cells, Tie.none(), dear, 1)[1] == (21,)
    level, ratios = choose_levels(cells, Tie.none(), dear, 3)
    assert ratios == (3, 8)
    assert np.bincount(level).tolist() == [39, 20, 3]
    assert choose_levels(cells, Tie.none(), cheap, 3)[1] == (21,)  # calls are more expensive than elements


def test_no_level_where_all_elements_take_the_window():
    level, ratios = choose_levels(CHAIN, Tie.none(), StepLimits(np.ones(12), np.ones(12), 0.9, 0.9), 3)
    assert not level.any()
    assert ratios == ()


def test_too_many_steps_are_refused():
    with pytest.raises(LevelError, match="allowed: 64 steps per level and 1 levels"):
        choose_levels(CHAIN, Tie.none(), StepLimits(np.geomspace(1e-3, 1.0, 12), np.ones(12), 0.9, 0.9), 1)


def test_damping_takes_more_substeps_and_has_a_limit():
    assert Substeps.of(8, 1, 0.02).reach < Substeps.of(8, 1).reach
    damped = StepLimits(np.ones(12), np.ones(12), 0.9, 0.9, stiffness=0.01)
    assert choose_levels(CHAIN, Tie.none(), damped, 1)[0].min() == 1  # the window is too large for damped elements
    with pytest.raises(LevelError, match=r"too large for local time steps; the limit is 0\.03"):
        Substeps.of(8, 1, 0.04)


def test_very_different_steps_are_divided_in_seconds():
    step_limits = StepLimits(np.geomspace(1e-4, 1.0, 12), np.full(12, 1e6), 0.9, 0.9)
    start = time.monotonic()
    level, ratios = choose_levels(CHAIN, Tie.none(), step_limits, 4)
    assert time.monotonic() - start < 5.0
    assert level.max() == len(ratios) >= 2
    assert 0.9 / math.prod(ratios) < 0.9e-4 * 1.01
