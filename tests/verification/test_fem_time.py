"""Waves through a change of impedance, and second order in time under each type of load."""

from itertools import pairwise

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.loads.damping import RayleighDamping
from reflowshock.fem.loads.large_mass import LargeMass
from reflowshock.fem.loads.load import BodyAcceleration, Load, NodalForces, PrescribedVelocity
from reflowshock.fem.loads.pulse import HalfSine, Tabulated
from reflowshock.fem.mesh.facet_areas import outward_areas
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.materials.parameters import Isotropic
from reflowshock.materials.roles import Materials
from tests.support.fem_bodies import STEEL

SPEED = np.sqrt(STEEL.young_modulus / STEEL.density)
ALONG = np.array([1.0, 0.0, 0.0])


def smooth_pulse(peak: float, duration: float) -> Tabulated:
    """Return a tabulated sin^2 pulse of the given peak."""
    times = np.linspace(0.0, duration, 201)
    return Tabulated(times, peak * np.sin(np.pi * times / duration) ** 2)


@pytest.mark.parametrize("ratio", [3.0, 1.0 / 3.0])
def test_wave_through_a_change_of_impedance(ratio):
    """The stress factors are 2 Z2 / (Z1 + Z2) transmitted and (Z2 - Z1) / (Z1 + Z2) reflected, Z = rho c."""
    count, size = 200, 1e-4
    other = Isotropic(density=STEEL.density * ratio**2, young_modulus=STEEL.young_modulus, poisson_ratio=0.0)
    # Element lengths are proportional to the wave speeds, so both bars have the same critical step.
    x = np.concatenate([np.linspace(0, count, count + 1), count + np.linspace(0, count, count + 1)[1:] / ratio]) * size
    points, cells = grid(x, [0, size], [0, size])
    second = points[cells][:, :, 0].mean(axis=1) > count * size
    mesh = mesh_of(points, cells, np.where(second, "copper", "board"), {"low": on(0, 0.0)})
    body, critical = dns_body(mesh, materials=Materials(board=STEEL, copper=other))
    unit = size / SPEED
    driven = body.local.locate(mesh.facet_nodes("low"))
    motion = motion_of(body, 0.9 * critical, [PrescribedVelocity(driven, 0, smooth_pulse(1.0, 60 * unit))])
    before, behind = (int(np.argmin(np.abs(body.local.points[:, 0] - x[k]))) for k in (count // 2, count + 60))
    times, gauges = [], []
    while motion.time < 380 * unit:
        motion.advance()
        motion.update_force()
        times.append(motion.time / unit)
        gauges.append(motion.velocity[[before, behind], 0])
    gauge, clock = np.array(gauges), np.array(times)
    incident = gauge[(clock > 90) & (clock < 200), 0].max()
    back = gauge[clock > 280, 0]
    reflected = back[np.argmax(np.abs(back))]
    transmitted = gauge[:, 1].max()
    assert incident == pytest.approx(1.0, rel=0.005)
    assert ratio * transmitted / incident == pytest.approx(2 * ratio / (1 + ratio), rel=0.01)
    assert -reflected / incident == pytest.approx((ratio - 1) / (1 + ratio), rel=0.01)


def box(held: bool) -> MeshData:
    """Return the mesh of a bar of 6 mm, held by symmetry at x = 0 or free."""
    points, cells = grid(np.linspace(0, 6e-3, 7), [0, 1e-3], [0, 1e-3])
    facets = {"symmetry_x": on(0, 0.0)} if held else {}
    return mesh_of(points, cells, "board", facets | {"low": on(0, 0.0), "high": on(0, 6e-3)})


LOADS = ("direct", "large_mass", "pressure", "motion", "damping")


def loads_of(kind: str, body, mesh: MeshData, duration: float) -> list[Load]:
    """Return the loads of a kind of test on a bar, with pulses within a duration [s]."""
    pulse = HalfSine(1e4, 0.6 * duration)
    low = mesh.facet_nodes("low")
    if kind == "direct":
        return [BodyAcceleration(ALONG, pulse)]
    if kind == "large_mass":
        return [LargeMass.build(MPI.COMM_SELF, body, low, BodyAcceleration(ALONG, pulse))]
    if kind == "pressure":
        nodes, areas = outward_areas(mesh, "high")
        return [NodalForces.build(body, nodes, -areas, smooth_pulse(1e6, 0.6 * duration))]
    if kind == "motion":
        return [PrescribedVelocity(body.local.locate(low), 0, smooth_pulse(1.0, 0.6 * duration))]
    return [BodyAcceleration(ALONG, pulse), RayleighDamping(2e5, 0.0, body.terms)]


def order(fields: list[np.ndarray]) -> float:
    """Return the order observed in three results with the step halved twice."""
    first, second = (np.linalg.norm(after - before) for before, after in pairwise(fields))
    return float(np.log2(first / second))


@pytest.mark.parametrize("kind", LOADS)
def test_second_order_in_time(kind):
    mesh = box(held=kind not in ("large_mass", "motion"))
    body, critical = dns_body(mesh, STEEL)
    duration = 40 * critical

    def field(steps: int) -> np.ndarray:
        motion = motion_of(body, duration / steps, loads_of(kind, body, mesh, duration))
        for _ in range(steps):
            motion.advance()
            motion.update_force()
        return motion.displacement - motion.base_displacement()

    assert order([field(steps) for steps in (100, 200, 400)]) == pytest.approx(2.0, abs=0.2)


def test_second_order_of_a_body_that_starts_with_a_velocity_and_drag():
    """A free body has the velocity v exp(-alpha t) and the displacement v (1 - exp(-alpha t)) / alpha."""
    drag = 2e5
    body, critical = dns_body(box(held=False), STEEL)
    duration = 40 * critical
    exact = (1.0 - np.exp(-drag * duration)) / drag

    def error(steps: int) -> float:
        motion = motion_of(body, duration / steps, [RayleighDamping(drag, 0.0, body.terms)])
        motion.launch(ALONG)
        for _ in range(steps):
            motion.advance()
            motion.update_force()
        return abs(float(motion.displacement[0, 0]) - exact) / exact

    assert error(100) < 1e-3
    assert np.log2(error(100) / error(200)) == pytest.approx(2.0, abs=0.1)


def test_stiffness_damping_half_a_step_late_is_of_first_order():
    """The error is the damping ratio times the step, small compared with the damping."""
    mesh = box(held=True)
    body, critical = dns_body(mesh, STEEL)
    duration, stiffness = 40 * critical, 0.2 * critical

    def field(steps: int) -> np.ndarray:
        loads = [BodyAcceleration(ALONG, HalfSine(1e4, 0.6 * duration)), RayleighDamping(0.0, stiffness, body.terms)]
        motion = motion_of(body, duration / steps, loads)
        for _ in range(steps):
            motion.advance()
            motion.update_force()
        return motion.displacement

    fields = [field(steps) for steps in (800, 1600, 3200)]
    assert order(fields) == pytest.approx(1.0, abs=0.2)
    assert np.linalg.norm(fields[0] - fields[-1]) < 0.01 * np.linalg.norm(fields[-1])
