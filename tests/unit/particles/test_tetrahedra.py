"""Tetrahedra of a free drop: exact volumes, gradients, mass; geodesic clouds."""

import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import geodesic_sphere, sphere_cloud
from reflowshock.particles.core.surface_measure import enclosed_volume
from reflowshock.particles.core.tetrahedra import boundary_triangles, cell_volumes, tetrahedralise, volume_gradients
from reflowshock.particles.discretisation.discretisation import LinearTetrahedra
from reflowshock.particles.physics.operators import Viscosity
from reflowshock.particles.steps.backward_difference import BackwardDifference


@pytest.fixture
def drop():
    """Return a deformed free drop and its tetrahedra."""
    ball = sphere_cloud(2.0, 3)
    cells = tetrahedralise(ball.points, ball.spacing)
    body = Body.at_rest(ball)
    body.points = body.points * np.array([0.8, 1.25, 1.0]) + 0.02 * np.sin(4.0 * body.points[:, ::-1])
    return body, LinearTetrahedra.start(body.points, cells, density=3.0)


def flat(field):
    """Return a vector field (n, 3) by component, shape (3 n,)."""
    return field.T.ravel()


def oriented(triangles):
    """Return triangles as a set of vertex triples that begin with the smallest number."""
    first = np.argmin(triangles, axis=1)[:, None]
    turned = np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)
    return {tuple(row) for row in turned}


@pytest.mark.parametrize("frequency", range(1, 11))
def test_geodesic_spheres_have_even_edges(frequency):
    points = geodesic_sphere(frequency)
    assert len(points) == 10 * frequency**2 + 2
    assert np.linalg.norm(points, axis=1) == pytest.approx(1.0)
    distance = np.linalg.norm(points[:, None] - points[None], axis=2) + 9.0 * np.eye(len(points))
    assert distance.min(axis=1).max() < 1.3 * distance.min()


@pytest.mark.parametrize("shells", [2, 3, 5, 8])
def test_boundary_of_the_tetrahedra_is_the_surface(shells):
    cloud = sphere_cloud(1e-9, shells)
    cells = tetrahedralise(cloud.points, cloud.spacing)
    assert oriented(boundary_triangles(cells)) == oriented(cloud.triangles)
    assert enclosed_volume(cloud.points, cloud.triangles, (), ()) == pytest.approx(1e-9, rel=1e-12)
    assert cell_volumes(cloud.points, cells).sum() == pytest.approx(1e-9, rel=1e-12)


def test_volume_gradients_equal_differences():
    rng = np.random.default_rng(3)
    points, cells = rng.normal(size=(4, 3)), np.array([[0, 1, 2, 3]], np.int32)
    gradient = volume_gradients(points, cells)[0]
    for k in range(4):
        for d in range(3):
            step = np.zeros((4, 3))
            step[k, d] = 1e-6
            change = cell_volumes(points + step, cells)[0] - cell_volumes(points - step, cells)[0]
            assert gradient[k, d] == pytest.approx(change / 2e-6, abs=1e-8)


def test_constraint_is_the_gradient_of_volumes(drop):
    body, tetrahedra = drop
    space = tetrahedra(body)
    volume, gradient = body.volume()
    assert np.asarray(space.constraint.sum(axis=0)).ravel() == pytest.approx(flat(gradient), abs=1e-12)
    assert space.constraint @ flat(body.points) == pytest.approx(3.0 * volume * space.volume_share)
    translation = np.broadcast_to([1.0, 2.0, 3.0], body.points.shape)
    assert space.constraint @ flat(translation) == pytest.approx(0.0, abs=1e-12)


def test_mass_is_exact_for_linear_velocities(drop):
    """The reference is the second moments of the tetrahedra (origin, surface triangle)."""
    body, tetrahedra = drop
    corners = body.points[body.triangles]
    volumes = np.einsum("td,td->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    total = corners.sum(axis=1)
    products = np.einsum("tki,tkj->tij", corners, corners) + np.einsum("ti,tj->tij", total, total)
    exact = np.einsum("t,tij->ij", volumes / 20.0, products)
    assert body.points.T @ tetrahedra.mass @ body.points == pytest.approx(exact, abs=1e-12)


def test_stabilisation_sees_no_linear_pressure(drop):
    body, tetrahedra = drop
    matrix = tetrahedra(body).stabilisation
    assert matrix @ (2.0 + body.points @ [1.0, -2.0, 0.5]) == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.eigvalsh(matrix.toarray()).min() > -1e-12


def test_viscous_power_of_simple_flows(drop):
    """The integral of 2 mu D : D is mu V in shear, 4 mu V in extension and zero in rotation."""
    body, tetrahedra = drop
    space = tetrahedra(body)
    matrix, volume = Viscosity(2.0).matrix(body, space, 1.0), space.weights.sum()
    assert volume == pytest.approx(body.volume()[0], rel=5e-3)
    x, y, z = body.points.T
    flows = ((z, 0 * x, 0 * x), (x, -y, 0 * x), (-y, x, 0 * x))
    powers = [field @ matrix @ field for field in map(np.concatenate, flows)]
    assert powers == pytest.approx([2.0 * volume, 8.0 * volume, 0.0], abs=1e-12)


def test_backward_difference_is_of_second_order():
    """Steps of x'' = -x alternate in size; the error includes the damping of the first-order start."""
    errors = []
    for steps in (50, 100, 200):
        sizes = np.where(np.arange(steps) % 2 == 0, 0.8, 1.2) / steps
        history = BackwardDifference.start(1)
        x, v = np.array([[1.0, 0.0, 0.0]]), np.zeros((1, 3))
        for size in sizes:
            base = history.base(x, v, size)
            h = base.time_step
            new = (base.velocity - h * base.points) / (1.0 + h * h)
            position = base.points + h * new
            history = BackwardDifference(position - x, new - v, size)
            x, v = position, new
        errors.append(abs(x[0, 0] - np.cos(1.0)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders.min() > 1.8, errors
