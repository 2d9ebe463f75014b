"""Loads and damping against exact solutions, with an energy balance to round-off."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.estimates.estimate import damped_critical_step
from reflowshock.fem.loads.damping import RayleighDamping
from reflowshock.fem.loads.large_mass import LargeMass
from reflowshock.fem.loads.load import BodyAcceleration, Load, NodalForces, PrescribedVelocity
from reflowshock.fem.loads.pulse import Constant, HalfSine
from reflowshock.fem.mesh.facet_areas import outward_areas
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.model.body import Body
from reflowshock.fem.problem.shock import Damping
from reflowshock.materials.parameters import Isotropic
from tests.support.fem_bodies import STEEL

LENGTH, WIDTH = 0.02, 2e-3
SPEED = np.sqrt(STEEL.young_modulus / STEEL.density)
ALONG = np.array([1.0, 0.0, 0.0])


def bar(held: bool, elements: int = 10) -> MeshData:
    """Return a bar along x, fixed at x = 0 or free, with facet sets at both ends."""
    points, cells = grid(np.linspace(0, LENGTH, elements + 1), [0, WIDTH], [0, WIDTH])
    facets = {"symmetry_x": on(0, 0.0)} if held else {}
    return mesh_of(points, cells, "board", facets | {"low": on(0, 0.0), "high": on(0, LENGTH)})


def total_energy(motion: ExplicitMotion) -> float:
    """Return stored plus dissipated energy minus the external work."""
    held = motion.internal_energy()
    return motion.kinetic_energy() + held.total + motion.damping_energy - motion.external_work


def largest_imbalance(motion: ExplicitMotion, steps: int) -> tuple[float, float]:
    """Return the largest change of the total energy and the largest external work."""
    start, error, work = total_energy(motion), 0.0, 0.0
    for _ in range(steps):
        motion.advance()
        motion.update_force()
        error = max(error, abs(total_energy(motion) - start))
        work = max(work, abs(motion.external_work))
    return error, work


def pressure(body: Body, mesh: MeshData, pulse) -> NodalForces:
    """Return the load of a pressure on the facet set ``high``, times a pulse."""
    nodes, areas = outward_areas(mesh, "high")
    return NodalForces.build(body, nodes, -areas, pulse)


def low_nodes(body: Body, mesh: MeshData) -> np.ndarray:
    """Return the local numbers of the nodes of the facet set ``low``."""
    return body.local.locate(mesh.facet_nodes("low"))


def loads_of(kind: str, body: Body, mesh: MeshData, stiffness: float) -> list[Load]:
    """Return the loads of a kind of test on a bar."""
    pulse = HalfSine(1e4, 2 * LENGTH / SPEED)
    if kind == "pressure":
        return [pressure(body, mesh, Constant(1e6)), BodyAcceleration(ALONG, Constant(9.81))]
    if kind == "motion":
        return [PrescribedVelocity(low_nodes(body, mesh), 0, Constant(1.0)), BodyAcceleration(ALONG, pulse)]
    if kind == "large_mass":
        low = mesh.facet_nodes("low")
        large_mass = LargeMass.build(MPI.COMM_SELF, body, low, BodyAcceleration(ALONG, pulse))
        return [large_mass, BodyAcceleration(ALONG, Constant(9.81))]
    return [BodyAcceleration(ALONG, pulse), RayleighDamping(2e4, stiffness, body.terms)]


@pytest.mark.parametrize("fraction", [0.5, 0.99])
@pytest.mark.parametrize("kind", ["pressure", "motion", "large_mass", "damped"])
def test_energy_is_exact(kind, fraction):
    mesh = bar(held=kind == "damped")
    body, critical = dns_body(mesh, STEEL)
    stiffness = 0.1 * critical if kind == "damped" else 0.0
    motion = motion_of(
        body, fraction * damped_critical_step(critical, stiffness), loads_of(kind, body, mesh, stiffness)
    )
    error, work = largest_imbalance(motion, 400)
    assert error < (1e-8 if kind == "large_mass" else 1e-11) * work


def test_pressure_gives_a_free_bar_its_momentum():
    mesh = bar(held=False)
    body, critical = dns_body(mesh, STEEL)
    motion = motion_of(body, 0.9 * critical, [pressure(body, mesh, Constant(1e6))])
    for _ in range(100):
        motion.advance()
        motion.update_force()
    momentum = body.mass @ motion.velocity
    assert momentum[0] == pytest.approx(-1e6 * WIDTH**2 * (motion.time - 0.5 * motion.step), rel=1e-12)
    assert np.abs(momentum[1:]).max() < 1e-12 * abs(momentum[0])


def test_free_body_keeps_momentum_and_angular_momentum():
    mesh = bar(held=False)
    body, critical = dns_body(mesh, Isotropic(density=8000.0, young_modulus=200e9, poisson_ratio=0.3))
    motion = motion_of(body, 0.9 * critical)
    motion.velocity[:] = np.random.default_rng(1).normal(size=motion.velocity.shape)
    points = body.local.points

    def momenta() -> np.ndarray:
        impulse = body.mass[:, None] * motion.velocity
        return np.concatenate([impulse.sum(axis=0), np.cross(points, impulse).sum(axis=0) / LENGTH])

    before = momenta()
    for _ in range(300):
        motion.advance()
        motion.update_force()
    scale = float(body.mass @ np.linalg.norm(motion.velocity, axis=1))
    assert np.abs(momenta() - before).max() < 1e-11 * scale


def test_prescribed_motion_sends_the_exact_wave():
    """Behind the front of a bar pushed at v the stress is rho c v; the reaction supplies kinetic and strain energy."""
    mesh, speed = bar(held=False, elements=60), 1.0
    body, critical = dns_body(mesh, STEEL)
    driven = low_nodes(body, mesh)
    motion = motion_of(body, 0.9 * critical, [PrescribedVelocity(driven, 0, Constant(speed))])
    while motion.time < LENGTH / SPEED:
        motion.advance()
        motion.update_force()
    assert motion.displacement[driven, 0] == pytest.approx(speed * motion.time, rel=1e-12)
    exact = STEEL.density * SPEED * speed**2 * WIDTH**2 * motion.time
    initial_energy = 0.5 * body.mass[driven].sum() * speed**2  # the driven nodes start with their velocity
    assert motion.external_work + initial_energy == pytest.approx(exact, rel=0.005)


def test_large_mass_is_direct_acceleration():
    pulse = HalfSine(1.5e4, 4 * LENGTH / SPEED)
    histories = []
    for method in ("direct", "large_mass"):
        mesh = bar(held=method == "direct")
        body, critical = dns_body(mesh, STEEL)
        low = mesh.facet_nodes("low")
        load = BodyAcceleration(ALONG, pulse) if method == "direct" else None
        acting = load or LargeMass.build(MPI.COMM_SELF, body, low, BodyAcceleration(ALONG, pulse))
        motion = motion_of(body, 0.9 * critical, [acting])
        tip = body.local.locate(mesh.facet_nodes("high"))
        rows = []
        for _ in range(300):
            motion.advance()
            motion.update_force()
            relative = motion.displacement - motion.base_displacement()
            rows.append(relative[tip, 0].mean())
        histories.append(np.array(rows))
    direct, large = histories
    assert np.linalg.norm(large - direct) < 5e-4 * np.linalg.norm(direct)


@pytest.mark.parametrize("kind", ["mass", "stiffness"])
def test_damping_ratio_equals_the_exact_decay(kind):
    """The first mode of a bar fixed at one end decays as exp(-xi w t), measured over ten periods."""
    ratio, mesh = 0.02, bar(held=True)
    body, critical = dns_body(mesh, STEEL)
    frequency = SPEED / (4 * LENGTH)
    coefficients = Damping(**{f"{kind}_ratio": ratio}, frequency=frequency).coefficients
    step = 0.5 * damped_critical_step(critical, coefficients[1])
    motion = motion_of(body, step, [RayleighDamping.build(body, *coefficients)])
    mode = np.sin(np.pi * body.local.points[:, 0] / (2 * LENGTH))
    motion.displacement[:, 0] = 1e-6 * mode
    motion.update_force()
    motion.velocity[:] = -0.5 * step * motion.acceleration()
    energy = [motion.internal_energy().total + motion.kinetic_energy()]
    while motion.time < 10 / frequency:
        motion.advance()
        motion.update_force()
        energy.append(motion.internal_energy().total + motion.kinetic_energy())
    measured = np.log(energy[0] / energy[-1]) / (2 * 2 * np.pi * frequency * motion.time)
    assert measured == pytest.approx(ratio, rel=0.01)
    assert motion.damping_energy == pytest.approx(energy[0] - energy[-1], rel=1e-9)
