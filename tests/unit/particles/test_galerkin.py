"""The Galerkin space of the scheme ispg against exact sums, and the spectrum of its linearised step."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import cholesky, null_space

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud, sphere_cloud
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.ispg.collocation import collocate
from reflowshock.particles.ispg.galerkin import Galerkin
from reflowshock.particles.ispg.gripc_step import force_pressure
from reflowshock.particles.ispg.ispg_step import IspgStep
from reflowshock.particles.ispg.lagged_cholesky import LaggedCholesky
from reflowshock.particles.ispg.mls import DegenerateStencil
from reflowshock.particles.ispg.nodal_volumes import body_moments
from reflowshock.particles.physics.forces import SurfaceTension
from reflowshock.particles.physics.operators import Inertia, Mass
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.relaxation import Relaxation
from reflowshock.particles.steps.time_step import TimeStep


def shaken(cloud):
    """A body whose particles off the walls are not on a lattice."""
    body = Body.at_rest(cloud)
    shake = np.random.default_rng(5).uniform(-0.15, 0.15, cloud.points.shape) * cloud.spacing
    body.points = cloud.points + np.where((cloud.wall < 0)[:, None], shake, 0.0)
    return body


@pytest.fixture(scope="module")
def body():
    return shaken(box_cloud(1.0, 6))


@pytest.fixture(scope="module")
def space(body):
    return Galerkin.of(body)


def test_linear_velocities_along_the_wall_are_exact(body, space):
    slope = np.array([[0.3, -0.7, 0.0], [0.2, 0.5, 0.0], [0.0, 0.0, -0.8]])
    velocity, gradient = space.values(body.points @ slope.T + [1.0, -2.0, 0.0])
    assert velocity == pytest.approx(body.points @ slope.T + [1.0, -2.0, 0.0])
    assert gradient == pytest.approx(np.broadcast_to(slope, gradient.shape), abs=1e-9)
    assert space.divergence(body.points @ slope.T) == pytest.approx(0.0, abs=1e-9)


def test_loads_are_the_transposed(body, space):
    """Virtual power: f . N v + s : grad v, and p div v, as matrix and without one."""
    random = np.random.default_rng(3)
    field, force = random.normal(size=(2, len(body.points), 3))
    stress, factor = random.normal(size=(len(body.points), 3, 3)), random.normal(size=len(body.points))
    velocity, gradient = space.values(field)
    power = (force * velocity).sum() + (stress * gradient).sum()
    assert (space.load(force, stress) * field).sum() == pytest.approx(power)
    assert space.velocity(field) == pytest.approx(velocity)
    assert (space.load_forces(force) * field).sum() == pytest.approx((force * velocity).sum())
    assert (space.divergence_load(factor) * field).sum() == pytest.approx(factor @ space.divergence(field))
    assert space.divergence_rows() @ field.ravel() == pytest.approx(space.divergence(field))


def test_volumes_have_the_moments_of_the_body(body, space):
    volume, first, second = body_moments(body)
    assert volume == pytest.approx(body.volume()[0])
    assert space.volumes.sum() == pytest.approx(volume)
    assert space.volumes @ body.points == pytest.approx(first)
    assert (body.points * space.volumes[:, None]).T @ body.points == pytest.approx(second)
    assert space.volumes.min() > 0.0


def test_a_uniform_pressure_pushes_the_surface_only(body, space):
    """B^T 1 is the load of the gradient of the enclosed volume, whatever nodal integration misses."""
    equations = IspgStep().prepare(body, water(), NeighbourList(1.0, 0.0)).equations(body, 1e-3)
    flux = space.load(body.volume()[1], np.zeros((len(body.points), 3, 3)))
    assert equations.push(np.ones(len(body.points))) == pytest.approx(flux, abs=1e-12)


def test_linear_velocities_have_the_energy_of_the_body_and_none_has_too_little(body):
    """A stretch: sum of m v v, exact by the moments; rough velocities keep half of their own at least."""
    equations = IspgStep().prepare(body, water(), NeighbourList(1.0, 0.0)).equations(body, 1e-3)
    stretch = body.points * [1.0, 1.0, -2.0]
    second = np.diag(body_moments(body)[2])
    assert equations.kinetic(stretch) == pytest.approx(0.5 * (second @ [1.0, 1.0, 4.0]))
    rough = np.random.default_rng(2).normal(size=body.points.shape)
    own = 0.5 * float(equations.masses @ (rough**2).sum(axis=1))
    assert 0.5 * own < equations.kinetic(rough) < 2.0 * own


def test_the_projection_solves_with_the_mass(ball):
    """Accelerations of the change of the pressure: B v is met, and M (v - v*) is dt B^T phi to a percent."""
    body = shaken_inside(ball)
    equations = IspgStep().prepare(body, water(), NeighbourList(1.0, 0.0)).equations(body, 1e-3)
    start = np.random.default_rng(4).normal(size=body.points.shape)
    field, potential = equations.project(start, 0.0, LaggedCholesky())
    assert equations.constraint(field) == pytest.approx(0.0, abs=1e-4 * np.abs(equations.constraint(start)).max())
    push = equations.time_step * equations.push(potential)
    assert np.linalg.norm(equations.momentum(field - start) - push) < 0.02 * np.linalg.norm(push)


def test_a_lonely_particle_is_named():
    lonely = shaken(box_cloud(1.0, 6))
    lonely.points[-1] += 7.0
    with pytest.raises(DegenerateStencil, match=f"particle {len(lonely.points) - 1} at .* fewer than 16"):
        Galerkin.of(lonely)


def water(inertia=True):
    """Density and surface tension are one."""
    tension = SurfaceTension(1.0)
    return Physics((tension,), (Mass(1.0), tension), (Inertia(1.0),) if inertia else (), (), ())


@pytest.fixture(scope="module")
def ball():
    """A ball of 147 particles at rest."""
    rest = Body.at_rest(sphere_cloud(4.0 / 3.0 * np.pi, 3))
    flow = LiquidFlow(rest, water(inertia=False), TimeStep(10.0, rest.cloud.spacing, 10.0), Relaxation(1.0))
    for _ in range(30):
        flow.step()
    return rest


def stiffness(ball):
    """Minus the derivative of the force and the pressure of the body by the positions, `(3 n, 3 n)`, by differences."""
    count, size = ball.cloud.surface_count, 3 * len(ball.points)
    slope, tension = ball.volume()[1][:count], water()
    pressure = -(tension.force(ball)[:count] * slope).sum() / (slope**2).sum()

    def force(points):
        moved = replace(ball, points=points)
        return (tension.force(moved) + pressure * moved.volume()[1]).ravel()

    matrix = np.zeros((size, size))
    for column in range(3 * count):
        step = np.zeros(size)
        step[column] = 1e-5
        shift = step.reshape(-1, 3)
        matrix[:, column] = -(force(ball.points + shift) - force(ball.points - shift)) / 2e-5
    return 0.5 * (matrix + matrix.T)


def shaken_inside(ball):
    """The ball with particles below its surface that are not on shells: the surface stays at rest."""
    shake = np.random.default_rng(1).uniform(-0.1, 0.1, ball.points.shape) * ball.cloud.spacing
    shake[: ball.cloud.surface_count] = 0.0
    return replace(ball, points=ball.points + shake)


def test_no_mode_of_the_linearised_scheme_grows(ball):
    """Squares of the frequencies of M v' = -N^T K x + B^T p, x' = N v, B v = 0 at rest; those of order two: 8."""
    body = shaken_inside(ball)
    equations = IspgStep().prepare(body, water(), NeighbourList(1.0, 0.0)).equations(body, 1e-3)
    units = np.eye(body.points.size).reshape(-1, *body.points.shape)
    shown = np.array([equations.space.values(unit)[0].ravel() for unit in units]).T
    root = np.linalg.inv(cholesky(np.array([equations.momentum(unit).ravel() for unit in units]), lower=True)).T
    free = null_space(np.array([equations.constraint(unit) for unit in units]).T @ root, rcond=1e-9)
    scaled = shown @ root
    squares = np.linalg.eigvalsh(free.T @ scaled.T @ stiffness(body) @ scaled @ free)
    assert squares.min() > -1e-8
    assert ((squares > 5.0) & (squares < 8.0)).sum() >= 5


@pytest.mark.parametrize("basis", ["linear", "quadratic"])
def test_modes_of_the_collocated_scheme_grow(ball, basis):
    """Eigenvalues of x'' = -grad p, lap p = 0 below the surface, p given on it, gradient and Laplacian collocated."""
    body, count = shaken_inside(ball), ball.cloud.surface_count
    size = body.points.size
    given = np.zeros((len(body.points), size))
    for column in range(3 * count):
        step = np.zeros(size)
        step[column] = 1e-5
        ends = [force_pressure(replace(body, points=body.points + s * step.reshape(-1, 3)), water()) for s in (1, -1)]
        given[:count, column] = (ends[0] - ends[1]) / 2e-5
    operators = collocate(body.points, (), body.cloud.spacing, basis)
    poisson = operators.laplacian.toarray()
    poisson[:count] = operators.values.toarray()[:count]
    pressure = np.linalg.solve(poisson, given)
    slope = np.stack([part @ pressure for part in operators.gradient], axis=1).reshape(size, size)
    growth = np.sqrt(np.linalg.eigvals(-slope).astype(complex)).real
    assert growth.max() > 0.05
