"""Step levels in motion: exact solutions, momentum, and equal motion of a model split at a level."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import motion_of
from reflowshock.cases.hard.trials.coupled import Coupled, Models, rank_elements_of
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.division.division import Division
from reflowshock.fem.division.tables import join_meshes, model_inputs
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.mesh.tie import net_load
from reflowshock.fem.model.step_levels import Levels, SubsteppedElements
from reflowshock.materials.roles import ELASTIC
from tests.support.fem_bodies import dense_stiffness
from tests.support.fem_levels import Levelled, joint_on_board, levelled

MESH = joint_on_board(solder=4)


def released(model: Levelled, displacement: np.ndarray, step: float) -> ExplicitMotion:
    """Return the motion of a body released at rest from a displacement, shape (n, 3)."""
    motion = motion_of(model.body, step)
    motion.displacement[:] = displacement
    motion.update_force()
    motion.velocity[:] = -0.5 * step * motion.acceleration()
    return motion


def at_step(model: Levelled, step: float) -> Levelled:
    """Return a model with the same levels and another window."""
    levels = SubsteppedElements.build(MPI.COMM_SELF, model.body, Levels(model.level, model.ratios, step))
    return replace(model, body=replace(model.body, terms=[*model.body.terms[:-1], levels]), window=step)


@pytest.mark.parametrize("ratios", [(14,), (5, 3), (2, 3, 3)], ids=str)
def test_displacement_is_of_second_order_in_the_window(ratios):
    model = levelled(MESH, ELASTIC, ratios)
    body = model.plain
    free = body.free.ravel()
    stiffness = dense_stiffness(body)[np.ix_(free, free)]
    squares, modes = scipy.linalg.eigh(stiffness, np.diag(np.repeat(body.mass, 3)[free]))
    frequency = np.sqrt(squares[:6])
    shape, period = modes[:, :6] @ np.ones(6), 2.0 * np.pi / frequency[3]
    steps = int(period / model.window) + 1
    errors = []
    for count in (steps, 2 * steps, 4 * steps):
        start = np.zeros((len(body.mass), 3))
        start[body.free] = shape
        body.tie.spread(start)
        moving = released(at_step(model, period / count), start, period / count)
        for _ in range(count):
            moving.advance()
            moving.update_force()
        exact = modes[:, :6] @ np.cos(frequency * period)
        errors.append(np.linalg.norm(moving.displacement[body.free] - exact) / np.linalg.norm(exact))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders.min() > 1.9, errors


def test_momentum_of_a_free_body_stays():
    model = levelled(joint_on_board(solder=4, held=False), ELASTIC, (5, 3))
    body, points = model.body, model.body.local.points
    start = 1e-6 * np.sin(3e3 * points @ np.array([[1.0, 2.0, 0.5], [-1.0, 0.7, 1.0], [0.3, 1.0, -2.0]]))
    body.tie.spread(start)
    motion = released(model, start, model.window)
    motion.velocity += np.array([1.0, -0.5, 0.3]) + np.cross([200.0, -100.0, 50.0], points)

    def momentum() -> np.ndarray:
        return net_load(points, body.mass[:, None] * motion.velocity)

    before = momentum()
    for _ in range(500):
        motion.advance()
        motion.update_force()
    assert np.abs(momentum()[:3] - before[:3]).max() <= 1e-10 * np.abs(before[:3]).max()
    assert np.abs(momentum()[3:] - before[3:]).max() <= 1e-10 * np.abs(before[3:]).max()


@pytest.mark.parametrize("ratios", [(14,), (5, 3)], ids=str)
def test_models_split_at_a_level_move_as_one(ratios):
    """The meso model has the elements of all levels below the window; the first-level ring is its interface."""
    whole = levelled(MESH, ELASTIC, ratios)
    level = np.empty_like(whole.level)
    level[whole.body.local.cell_numbers] = whole.level
    plan = WindowPlan(whole.window, int(np.prod(ratios)), 200, 1)
    division = Division("local_steps", level == 0, level > 0, level, ratios, plan)
    inputs = model_inputs(join_meshes(MESH), division)
    models = Models({role: rank_elements_of(item, ELASTIC) for role, item in inputs.items()}, division)
    pair = Coupled(models.bodies(), plan, scheme_of("local_steps"))
    alone = motion_of(whole.body, whole.window)
    for motion in (alone, pair.macro.motion, pair.meso.motion):
        motion.launch(np.array([1.0, 0.5, -0.3]))
    for _ in range(200):
        alone.advance()
        alone.update_force()
        pair.run()
    displacements = {}
    for motion in (pair.macro.motion, pair.meso.motion):
        displacements |= dict(zip(map(tuple, motion.body.local.points), motion.displacement, strict=True))
    exact = alone.displacement
    same = np.array([displacements[tuple(point)] for point in whole.body.local.points])
    assert np.abs(same - exact).max() <= 1e-10 * np.abs(exact).max()
