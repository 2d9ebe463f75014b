"""Rayleigh damping: kernels and load against NumPy, and steps without array allocation."""

import tracemalloc

import numpy as np
import pytest

from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.kernels.motion import STRIP, add_damping, power
from reflowshock.fem.loads.damping import RayleighDamping
from reflowshock.fem.loads.load import BodyAcceleration
from reflowshock.fem.loads.pulse import Constant
from tests.support.fem_bodies import STEEL, dense_stiffness

GRAVITY = np.array([0.3, -2.0, 9.81])
COEFFICIENTS = 0.7, 0.05  # c [1/s], dt/2 [s]
FRAME = np.array([GRAVITY, [0.0, 0.2, -1.0]])  # body acceleration, and velocity of the table


def random_nodes(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return velocities, mobilities (some zero) and two forces of random nodes."""
    random = np.random.default_rng(count)
    mobility = random.uniform(1, 2, (count, 3)) * (random.uniform(size=(count, 3)) < 0.7)
    return random.uniform(-1, 1, (count, 3)), mobility, random.uniform(-1, 1, (2, count, 3))


def drag_of(velocity, mobility, gravity, coefficients, force) -> np.ndarray:
    """Return -c m (v + dt/2 a) (n, 3) [N] by plain NumPy."""
    rate, half = coefficients
    free = mobility > 0.0
    mass = np.divide(1.0, mobility, out=np.zeros_like(mobility), where=free)
    return -rate * mass * (velocity + half * (force * mobility + np.where(free, gravity, 0.0)))


@pytest.mark.parametrize("count", [1, 2, STRIP // 3, STRIP // 3 + 1, STRIP + 5])
def test_force_on_all_nodes(count):
    velocity, mobility, forces = random_nodes(count)
    others = forces[0] + forces[1]
    drag = drag_of(velocity - FRAME[1], mobility, GRAVITY, COEFFICIENTS, others)
    expected = forces[0] + drag, others + drag
    add_damping(velocity, mobility, FRAME, COEFFICIENTS, (forces[0], forces[1]))
    assert np.allclose(forces, expected, rtol=1e-14, atol=1e-15)


def test_a_node_is_damped_alike_wherever_it_stands():
    """Copies of a node on several ranks stay bitwise equal, as in ``test_motion_kernels``."""
    velocity, mobility, forces = random_nodes(40)
    whole = forces.copy()
    add_damping(velocity, mobility, FRAME, COEFFICIENTS, (whole[0], whole[1]))
    for first in range(40):
        part = forces[:, first:].copy()
        add_damping(velocity[first:].copy(), mobility[first:].copy(), FRAME, COEFFICIENTS, (part[0], part[1]))
        assert np.array_equal(part, whole[:, first:])


def moving_bar(
    coefficients: tuple[float, float], owned: slice = slice(None), elements: int = 5
) -> tuple[RayleighDamping, ExplicitMotion]:
    """Return damping and motion of a randomly moving bar with weight, on a rank that owns some nodes."""
    points, cells = grid(np.linspace(0, elements * 1e-3, elements + 1), [0, 1e-3], [0, 1e-3, 2e-3])
    body, critical = dns_body(mesh_of(points, cells, "board", {"symmetry_x": on(0, 0.0)}), STEEL)
    counted = np.zeros_like(body.shared.owned)
    counted[owned] = True
    body.shared.owned[:] = counted
    damping = RayleighDamping.build(body, *coefficients)
    motion = motion_of(body, 0.5 * critical, [damping, BodyAcceleration(GRAVITY, Constant(1e6))])
    free = motion.mobility > 0.0
    motion.velocity[:] = np.where(free, np.random.default_rng(3).uniform(-1, 1, free.shape), 0.0)
    motion.update_force()
    return damping, motion


@pytest.mark.parametrize("owned", [slice(None), slice(4, None), slice(0, None, 2), slice(5, 5)])
@pytest.mark.parametrize("coefficients", [(2e5, 0.0), (0.0, 1e-8), (2e5, 1e-8)])
def test_load_is_the_formula(coefficients, owned):
    alpha, beta = coefficients
    damping, motion = moving_bar(coefficients, owned)
    elastic = -beta * (dense_stiffness(motion.body) @ motion.velocity.ravel()).reshape(-1, 3)
    motion.force[:] = np.random.default_rng(4).uniform(-1, 1, motion.force.shape)
    others = motion.force + elastic
    rate = alpha / (1.0 + 0.5 * alpha * motion.step), 0.5 * motion.step
    drag = drag_of(motion.velocity, motion.mobility, motion.gravity, rate, others)
    damping.work = 0.0
    damping.add(motion)
    damping.collect(motion)
    size = np.abs(elastic + drag).max()
    assert np.allclose(damping.force, elastic + drag, rtol=0.0, atol=1e-12 * size)
    assert np.allclose(motion.force, others + drag, rtol=0.0, atol=1e-12 * (1.0 + size))
    power_of_nodes = np.sum(damping.force * motion.velocity, axis=1)
    counted = motion.body.shared.owned
    work = 0.5 * motion.step * power_of_nodes[counted].sum()
    assert damping.work == pytest.approx(work, rel=1e-12, abs=1e-14 * motion.step * np.abs(power_of_nodes).sum())


def test_a_node_that_is_held_later_is_not_dragged():
    damping, motion = moving_bar((2e5, 0.0))
    motion.hold(np.array([7]), 1)
    damping.add(motion)
    assert damping.force[7, 1] == 0.0
    assert damping.force[7, [0, 2]].all()


def test_power_of_no_node_is_zero():
    values = np.ones((3, 3))
    assert power(np.empty((0, 2), np.int64), values, values) == 0.0


@pytest.mark.parametrize("coefficients", [(2e5, 0.0), (2e5, 1e-8)])
def test_a_step_makes_no_arrays(coefficients):
    """Kernels allocate one row of boxes or a strip of nodes, independent of the model size."""
    damping, motion = moving_bar(coefficients, elements=8000)
    damping.add(motion)
    damping.collect(motion)
    tracemalloc.start()
    try:
        damping.add(motion)
        damping.collect(motion)
        assert tracemalloc.get_traced_memory()[1] < len(motion.force)  # less than a byte per node
    finally:
        tracemalloc.stop()
