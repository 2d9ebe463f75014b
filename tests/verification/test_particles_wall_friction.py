"""Walls without slip and with Navier slip: exact torsion flow of a liquid cylinder between two plates.

With v = r f(z) e_phi the free side is stress-free and the equations of motion reduce to a channel flow:
rho f_t = mu f_zz, with slip length b: b f_z = +-(f - f_plate) at the plates.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import brentq

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import joint_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.ispg.ispg_step import IspgStep
from reflowshock.particles.physics.operators import Inertia, Mass, NavierSlip, NoSlip, Viscosity, wall_areas
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.inertial_step import InertialFlow, InertialStep

RADIUS, GAP, VISCOSITY, DENSITY, SPIN = 0.5, 1.0, 2.0, 3.0, 1e-4
SLIP_LENGTH, LONG = 0.3, 1e6


@dataclass(frozen=True)
class Spin:
    """Plate that rotates about its normal."""

    wall: int
    directions = np.zeros((0, 6))
    load = np.zeros(3)

    def prescribed_twist(self, _plate, _time_step):
        return np.array([0.0, 0.0, 0.0, 0.0, 0.0, SPIN])


@dataclass(frozen=True)
class EdgesHold:
    """Pad edges that pin the contact lines."""

    def pinned(self, body):
        return np.concatenate(body.cloud.rings)


def cylinder(spacing):
    """Return a prism whose number of sides equals the particles per ring."""
    sides = joint_cloud(JointGeometry(GAP, RADIUS, RADIUS), np.pi * RADIUS**2 * GAP, spacing)
    return Body.at_rest(sides)


def physics(condition, *, inertia, spins):
    """Return the physics of a viscous liquid with a wall condition, and turning plates."""
    operators, momenta = [Viscosity(VISCOSITY), Mass(DENSITY)], []
    if inertia:
        momenta = [Inertia(DENSITY)]
    slip = condition == "slip"
    return Physics(
        forces=(),
        operators=operators,
        momenta=momenta,
        events=(),
        lines=(),
        motions=(Spin(1),) if spins else (),
        frictions=[NavierSlip(VISCOSITY / SLIP_LENGTH)] if slip else (),
        holds=() if slip else [NoSlip(), EdgesHold()],
    )


def order(counts, errors):
    """Return the order of errors in the spacing, from particle counts."""
    return -3.0 * np.polyfit(np.log(counts), np.log(errors), 1)[0]


@pytest.mark.parametrize(("condition", "length"), [("no-slip", 0.0), ("slip", SLIP_LENGTH)])
def test_steady_torsion(condition, length):
    """Exact: f = spin (z + b) / (H + 2 b), moment on the plate mu pi R^4 / 2 spin / (H + 2 b)."""
    counts, excess = [], []
    for spacing in (0.2, 0.14, 0.1):
        body = cylinder(spacing)
        step = InertialStep(DENSITY).start(body, physics(condition, inertia=False, spins=True))
        velocity = step.solve(LONG, body.volume()[0]).velocity
        x, y, z = body.points.T
        exact = SPIN * (z + length) / (GAP + 2.0 * length) * np.stack((-y, x, 0.0 * z))
        stress = Viscosity(VISCOSITY).matrix(body, step.state.space(body), LONG) @ velocity.T.ravel()
        top, (fx, fy, _) = body.cloud.wall == 1, stress.reshape(3, -1)
        moment = VISCOSITY * np.pi * RADIUS**4 / 2.0 * SPIN / (GAP + 2.0 * length)
        excess.append((x * fy - y * fx)[top].sum() / moment - 1.0)
        counts.append(len(x))
    assert np.linalg.norm(velocity.T - exact) < 0.02 * np.linalg.norm(exact)
    assert order(counts, excess) > 1.8
    assert 0.0 < excess[-1] < 0.15


def test_walls_share_their_area():
    body = cylinder(0.2)
    step = InertialStep(DENSITY).start(body, physics("slip", inertia=False, spins=True))
    areas = wall_areas(body, step.state.space(body))
    corners = np.linalg.norm(body.points[body.cloud.rings[0]], axis=1)
    polygon = 0.5 * len(corners) * corners[0] ** 2 * np.sin(2.0 * np.pi / len(corners))
    for wall in (0, 1):
        assert areas[body.cloud.wall == wall].sum() == pytest.approx(polygon)
        assert areas[body.cloud.wall == wall].min() > 0.0
    assert areas[body.cloud.wall < 0] == pytest.approx(0.0)


def tetrahedra(body, acting, time_step, steps):
    """Return kinetic energies after steps on tetrahedra."""
    flow = InertialFlow(body, acting, InertialStep(DENSITY))
    for _ in range(steps):
        flow.step(time_step)
        yield flow.solver.kinetic_energy(body)


def ispg(body, acting, time_step, steps):
    """Return kinetic energies after steps of the scheme ispg."""
    solver, volume = IspgStep(), body.volume()[0]
    for _ in range(steps):
        motion = solver.prepare(body, acting, NeighbourList(1.0, 0.0)).solve(time_step, volume)
        body.velocity, body.pressure = motion.velocity, motion.pressure
        body.move(time_step, motion.transport, {})
        yield solver.state.kinetic


def decay_rate(scheme, condition, wave, spacing):
    """Return the decay rate of f = cos(k (z - H/2)) [1/s] from energies over half of its half-life."""
    body, steps = cylinder(spacing), 5
    spin = SPIN * np.cos(wave * (body.points[:, 2] - 0.5 * GAP))
    body.velocity = np.column_stack((-body.points[:, 1] * spin, body.points[:, 0] * spin, np.zeros(len(spin))))
    time_step = 0.5 * DENSITY / (VISCOSITY * wave**2) / steps
    energies = list(scheme(body, physics(condition, inertia=True, spins=False), time_step, steps))
    return len(spin), 0.5 * np.log(energies[1] / energies[-1]) / ((steps - 2) * time_step)


@pytest.mark.parametrize(
    ("scheme", "condition", "least_order"),
    [
        (tetrahedra, "no-slip", 1.8),
        pytest.param(tetrahedra, "slip", 1.8, marks=pytest.mark.long),
        (ispg, "no-slip", 1.8),
        (ispg, "slip", 0.8),
    ],
)
def test_torsion_decays(scheme, condition, least_order):
    """The slowest mode f = cos(k (z - H/2)) decays with k^2 mu / rho, where k b tan(k H / 2) = 1."""
    wave = np.pi / GAP
    if condition == "slip":
        wave = brentq(lambda k: k * SLIP_LENGTH * np.tan(0.5 * k * GAP) - 1.0, 1e-3, 0.999 * np.pi / GAP)
    counts, rates = zip(*(decay_rate(scheme, condition, wave, spacing) for spacing in (0.2, 0.1)), strict=True)
    errors = np.abs(np.array(rates) / (wave**2 * VISCOSITY / DENSITY) - 1.0)
    assert order(counts, errors) > least_order
    assert errors[-1] < 0.15
