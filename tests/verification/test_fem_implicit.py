"""Implicit time integration: order, amplification, energy, and the explicit solver in the limit."""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.cases.hard.trials.grids import grid, mesh_of
from reflowshock.fem.dynamics.implicit import ImplicitMotion
from reflowshock.fem.errors import AgreedError
from reflowshock.fem.loads.load import half_sine_drop
from reflowshock.fem.mesh.mesh import append
from reflowshock.fem.model.body import Body
from reflowshock.materials.roles import ELASTIC
from tests.support.fem_bodies import STEEL
from tests.support.fem_models import board_mesh, small_assembly

PEAK = 1e4


@pytest.fixture(scope="module")
def spring() -> tuple[Body, float]:
    """Return a mass-spring pair (one free layer of nodes between two fixed ones) and its angular frequency [1/s]."""
    points, cells = grid([0, 1e-3, 2e-3], [0, 1e-3], [0, 1e-3])
    ends = {"mounting_holes": lambda c: (c[:, 0] < 1e-9) | (c[:, 0] > 2e-3 - 1e-9)}
    body, critical = dns_body(mesh_of(points, cells, "board", ends), STEEL)
    motion = motion_of(body, critical)
    motion.displacement[body.free[:, 2], 2] = 1.0
    motion.update_force()
    middle = body.free[:, 2]
    return body, float(np.sqrt(-motion.force[middle, 2].sum() / body.mass[middle].sum()))


def implicit(body: Body, step: float, alpha: float = 0.0, loads=()) -> ImplicitMotion:
    """Return the implicit motion of a body at rest, with HHT parameter alpha."""
    return ImplicitMotion(MPI.COMM_SELF, body, loads, step, alpha)


def run(motion, steps: int):
    """Take a number of steps of a motion, in place, and return it."""
    for _ in range(steps):
        motion.advance()
        motion.update_force()
    return motion


def half_sine_response(omega: float, pulse: float, time: float) -> float:
    """Return the exact displacement [m] of a mass on a spring after a half sine of height ``PEAK``."""
    r = np.pi / (pulse * omega)
    return PEAK / omega**2 * r / (r**2 - 1) * (np.sin(omega * time) + np.sin(omega * (time - pulse)))


@pytest.mark.parametrize("alpha", [0.0, -0.1])
def test_order_in_time(spring, alpha):
    body, omega = spring
    period = 2 * np.pi / omega
    pulse, end = 0.8 * period, 1.6 * period
    middle = int(np.flatnonzero(body.free[:, 2])[0])
    errors = []
    for steps in (128, 256):
        motion = run(implicit(body, end / steps, alpha, [half_sine_drop(PEAK, pulse)]), steps)
        errors.append(abs(motion.displacement[middle, 2] - half_sine_response(omega, pulse, motion.time)))
    assert errors[0] < 5e-3 * PEAK / omega**2
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def amplification(alpha: float, phase: float) -> np.ndarray:
    """Return the amplification matrix of (u, h v, h^2 a) for a step h, phase = omega h (Hughes 1987, 9.3)."""
    beta, gamma, square = 0.25 * (1 - alpha) ** 2, 0.5 - alpha, phase**2
    predicted = np.array([[1, 1, 0.5 - beta], [0, 1, 1 - gamma]])
    new = -square * ((1 + alpha) * predicted[0] - alpha * np.array([1, 0, 0])) / (1 + (1 + alpha) * beta * square)
    return np.array([predicted[0] + beta * new, predicted[1] + gamma * new, new])


@pytest.mark.parametrize("alpha", [0.0, -0.1, -1 / 3])
@pytest.mark.parametrize("phase", [0.3, 3.0, 300.0])
def test_free_vibration_follows_the_amplification_matrix(spring, alpha, phase):
    body, omega = spring
    middle = int(np.flatnonzero(body.free[:, 2])[0])
    step = phase / omega
    motion = implicit(body, step, alpha)
    motion.displacement[body.free[:, 2], 2] = 1.0
    motion.restart()
    state, matrix = np.array([1.0, 0.0, -(phase**2)]), amplification(alpha, phase)
    for _ in range(10):
        run(motion, 1)
        state = matrix @ state
        scale = max(1.0, np.abs(state).max())
        assert motion.displacement[middle, 2] == pytest.approx(state[0], abs=1e-9 * scale)
        assert step * motion.velocity[middle, 2] == pytest.approx(state[1], abs=1e-9 * scale)
    radius = np.abs(np.linalg.eigvals(matrix)).max()
    assert radius <= 1 + 1e-12 if alpha == 0.0 else radius < 1.0


def total_energy(motion) -> float:
    """Return kinetic and internal energy of a motion [J]."""
    return motion.kinetic_energy() + motion.internal_energy().total


def test_equals_the_explicit_solver_in_the_limit_and_keeps_its_energy():
    """For a tied package under a short pulse the difference decreases with the square of the step."""
    body, critical = dns_body(append(small_assembly(1, size=1e-3)), materials=ELASTIC)
    load, steps = half_sine_drop(PEAK, 3e-6), int(np.ceil(4e-6 / (0.9 * critical)))
    end = steps * 0.9 * critical
    explicit = run(motion_of(body, end / (4 * steps), [load]), 4 * steps)
    errors = []
    for count in (steps // 32, steps // 16):
        motion = run(implicit(body, end / count, loads=[load]), count)
        errors.append(np.linalg.norm(motion.displacement - explicit.displacement))
        assert total_energy(motion) == pytest.approx(motion.external_work, rel=1e-9)
        motion.factor.free()
    assert errors[1] < 0.01 * np.linalg.norm(explicit.displacement)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.3)


def test_energy_of_a_board_balances_at_any_step():
    body, critical = dns_body(board_mesh(1e-3, layers=2))
    motion = run(implicit(body, 100 * critical, loads=[half_sine_drop(PEAK, 5e-5)]), 40)
    assert total_energy(motion) == pytest.approx(motion.external_work, rel=1e-9)
    damped = run(implicit(body, 100 * critical, -0.1, [half_sine_drop(PEAK, 5e-5)]), 40)
    assert total_energy(damped) < damped.external_work


@pytest.mark.parametrize(("step", "alpha", "message"), [(0.0, 0.0, "must be > 0"), (1e-6, 0.1, "allowed: -1/3 to 0")])
def test_numbers_out_of_range(spring, step, alpha, message):
    with pytest.raises(ValueError, match=message):
        implicit(spring[0], step, alpha)


def test_elements_that_are_not_linear_are_refused(spring):
    with pytest.raises(AgreedError, match="the implicit solver is linear and does not support object"):
        implicit(replace(spring[0], terms=[object()]), 1e-6)
