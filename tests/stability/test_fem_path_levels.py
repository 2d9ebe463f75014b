"""Step levels of path-dependent elements: stability, momentum to round-off, plastic flow as with uniform steps."""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import SOLDER
from reflowshock.cases.hard.trials.pairs import SCHEMES, Pair
from reflowshock.fem.division import path_levels
from reflowshock.fem.division.path_levels import opaque_ratio
from reflowshock.fem.division.tables import prepare
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.mesh.tie import net_load
from reflowshock.fem.model.assembly import ForceOptions, make_body, make_rank_elements
from reflowshock.fem.parallel.checkpoint_state import values
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.roles import Materials
from tests.stability.test_fem_window_grid import GROWTH
from tests.support.fem_levels import joint_on_board
from tests.support.fem_tangent import flowing_pair

NESTED = {
    "thin": Pair(12, 3.0, 2, height=3, thinnest=0.2),
    "high": Pair(6, 1.0, 2, height=6, thinnest=0.1),
    "stiff": Pair(3, 10.0, 2, height=6, thinnest=0.1, columns=4),
}
LAYERS = 2  # layers of elements that permit the larger step
PACE = 4
FRACTION = 0.9


@pytest.mark.parametrize("name", NESTED)
def test_window_with_levels_does_not_grow(name):
    pair, held = NESTED[name], SCHEMES["held_velocity, levels auto"]
    assert len(pair.divided(held).division.ratios) > 1
    assert pair.coupled(held).spectral_radius() <= 1.0 + GROWTH


@pytest.mark.parametrize("name", NESTED)
def test_window_with_levels_is_stable_after_rotation_and_plastic_flow(name):
    coupled = flowing_pair(NESTED[name], SCHEMES["held_velocity, levels auto"])
    assert len(coupled.meso.motion.body.schedule) > 1
    assert coupled.spectral_radius() <= 1.0 + GROWTH


def test_one_layer_is_as_stable_as_two_at_their_critical_step():
    just = 0.5 * np.pi / FRACTION
    assert np.arccosh(opaque_ratio(FRACTION) * just) == pytest.approx(2.0 * np.arccosh(just), rel=1e-12)


@pytest.mark.parametrize("ratio, grows", [(None, False), (0.0, True)], ids=["as divided", "one layer of any elements"])
def test_one_layer_at_its_critical_step_has_a_resonance(monkeypatch, ratio, grows):
    pair, held = Pair(3, 1.0, 8 / 3, height=6, thinnest=0.25), SCHEMES["held_velocity, levels auto"]
    if ratio is not None:
        monkeypatch.setattr(path_levels, "opaque_ratio", lambda _: ratio)
    growth = pair.coupled(held, 0.95).spectral_radius() - 1.0
    assert growth > 1e-5 if grows else growth <= GROWTH


def free_joint(pace: int) -> ExplicitMotion:
    """Return the motion of a free joint on a piece of board, with larger steps for elements that permit them."""
    mesh = joint_on_board(held=False)
    item = prepare(mesh, "dns")["dns"]
    materials = Materials(solder=SOLDER)
    rank_elements = make_rank_elements(distribute(MPI.COMM_SELF, item.mesh), item.tables, materials, "one_point")
    step = FRACTION * rank_elements.steps.min()
    steps = np.empty(len(rank_elements.steps))
    steps[rank_elements.local.cell_numbers] = rank_elements.steps
    fine = FRACTION * steps < pace * step
    for _ in range(LAYERS):
        nodes = np.zeros(len(item.mesh.points), dtype=bool)
        nodes[item.mesh.cells[fine]] = True
        nodes[item.tables.tie.master[nodes[item.tables.tie.slave]]] = True
        fine = nodes[item.mesh.cells].any(axis=1)
    tables = replace(item.tables, every=np.where(fine, 1, pace).astype(np.int32))
    response = ForceOptions("corotational", step)
    body = make_body(MPI.COMM_SELF, rank_elements, tables, np.ones(len(rank_elements.steps)), response)
    return ExplicitMotion(body, [], step, np.empty(0, np.int32), np.zeros(len(body.mass)))


def thrown(pace: int, speed: float) -> ExplicitMotion:
    """Return the motion with a velocity that rotates and strains the body."""
    motion = free_joint(pace)
    points = motion.body.local.points
    centred = points - points.mean(axis=0)
    motion.velocity[:] = speed * np.column_stack([3 * centred[:, 2], centred[:, 0], -2 * centred[:, 0]]) / 1e-3
    return motion


def momentum(motion: ExplicitMotion) -> np.ndarray:
    """Return linear and angular momentum about the origin in the current configuration, shape (6,)."""
    position = motion.body.local.points + motion.displacement
    return net_load(position, motion.body.mass[:, None] * motion.present_velocity())


def test_free_plastic_joint_keeps_momentum_and_energy_and_matches_uniform_steps():
    ends, steps = {}, 1000
    for pace in (1, PACE):
        motion = thrown(pace, 30.0)
        start, first = momentum(motion), motion.kinetic_energy()
        motion.take_steps(steps)
        held = motion.internal_energy()
        assert np.abs(momentum(motion) - start)[:3].max() <= 1e-12 * np.abs(start).max() + 1e-15
        assert motion.kinetic_energy() + held.total == pytest.approx(first, rel=1e-4)
        ends[pace] = held.plastic / first
    assert ends[1] > 5e-3
    assert ends[PACE] == pytest.approx(ends[1], rel=0.01)


def test_restart_is_bitwise_identical():
    first, second = thrown(PACE, 3.0), free_joint(PACE)
    for _ in range(5):
        first.take_steps(PACE)
    second.restore(values(first.state()))
    for motion in (first, second):
        motion.take_steps(3 * PACE)
    assert np.array_equal(first.displacement, second.displacement)
    assert np.array_equal(first.velocity, second.velocity)
