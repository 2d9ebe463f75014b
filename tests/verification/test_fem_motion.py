"""Waves, orders and the shock response against exact solutions."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.loads.load import half_sine_drop
from reflowshock.fem.mesh.mesh import MeshData
from tests.support.fem_bodies import STEEL
from tests.support.fem_models import bar

SPEED = np.sqrt(STEEL.young_modulus / STEEL.density)  # bar wave speed; nu = 0
LENGTH = 0.1


def bar_mode_period(elements: int, fraction: float) -> float:
    """Return the period of the first free-free mode of a bar over the exact 2 L / c."""
    body, critical = dns_body(bar(LENGTH, elements, 2e-3), STEEL)
    x = body.local.points[:, 0]
    mode = np.cos(np.pi * x / LENGTH)
    exact = 2 * LENGTH / SPEED
    step = exact / np.ceil(exact / (fraction * critical))
    motion = motion_of(body, step)
    motion.displacement[:, 0] = 1e-6 * mode
    motion.update_force()
    acceleration = motion.force / body.mass[:, None]
    motion.velocity[:] = -0.5 * step * acceleration
    weights = mode * body.mass
    amplitude = [weights @ motion.displacement[:, 0]]
    while len(amplitude) < 3 * exact / step:
        motion.advance()
        motion.update_force()
        amplitude.append(weights @ motion.displacement[:, 0])
    # u_{n+1} + u_{n-1} = 2 cos(omega dt) u_n holds for a mode at every step.
    values = np.array(amplitude)
    cosine = (values[1:-1] @ (values[2:] + values[:-2])) / (2 * values[1:-1] @ values[1:-1])
    return 2 * np.pi * step / np.arccos(cosine) / exact


def test_bar_wave_speed():
    assert bar_mode_period(24, 0.9) == pytest.approx(1.0, abs=0.005)


def test_order_in_space():
    errors = [abs(bar_mode_period(count, 0.05) - 1.0) for count in (8, 16)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.15)


def test_order_in_time():
    exact = bar_mode_period(8, 0.01)
    errors = [abs(bar_mode_period(8, fraction) - exact) for fraction in (0.8, 0.4)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.15)


def test_velocity_step_travels_at_the_wave_speed_and_keeps_its_height():
    """For a bar that hits a wall at v the stress behind the front is rho c v, and contact ends after 2 L / c."""
    elements, speed = 100, 1.0
    body, critical = dns_body(bar_with_wall(elements), STEEL)
    motion = motion_of(body, 0.9 * critical)
    motion.velocity[body.free[:, 0], 0] = -speed
    wall = ~body.free[:, 0]
    impulse, time = 0.0, 0.5 * LENGTH / SPEED
    while motion.time < time:
        motion.advance()
        motion.update_force()
        impulse -= motion.step * motion.force[wall, 0].sum()
    area = 4e-6
    assert abs(impulse) / motion.time == pytest.approx(STEEL.density * SPEED * speed * area, rel=0.01)


def bar_with_wall(elements: int) -> MeshData:
    """Return the mesh of a bar whose end x = 0 is a plane of symmetry."""
    points, cells = grid(np.linspace(0, LENGTH, elements + 1), [0, 2e-3], [0, 2e-3])
    return mesh_of(points, cells, "board", {"symmetry_x": on(0, 0.0)})


def test_half_sine_shock_response():
    """A spring-mass pair after a half sine has z omega^2 / A = 4 f tau cos(pi f tau) / (1 - 4 f^2 tau^2).

    The pair is a plate of two clamped elements: one free layer of nodes between two fixed layers.
    """
    points, cells = grid([0, 1e-3, 2e-3], [0, 1e-3], [0, 1e-3])
    ends = {"mounting_holes": lambda c: (c[:, 0] < 1e-9) | (c[:, 0] > 2e-3 - 1e-9)}
    body, critical = dns_body(mesh_of(points, cells, "board", ends), STEEL)
    middle = body.free[:, 2]
    unit = motion_of(body, critical)
    unit.displacement[middle, 2] = 1.0
    unit.update_force()
    omega = float(np.sqrt(-unit.force[middle, 2].sum() / body.mass[middle].sum()))
    frequency, peak = omega / (2 * np.pi), 1e4
    for ratio in (0.2, 0.8, 1.2):
        pulse = ratio / frequency
        motion = motion_of(body, 0.02 * critical, [half_sine_drop(peak, pulse)])
        residual = []
        while motion.time < pulse + 1.5 / frequency:
            motion.advance()
            motion.update_force()
            if motion.time > pulse:
                residual.append(abs(motion.displacement[middle, 2].mean()))
        exact = abs(4 * ratio * np.cos(np.pi * ratio) / (1 - 4 * ratio**2))
        assert max(residual) * omega**2 / peak == pytest.approx(exact, rel=2e-3)
