"""Operators of the implicit step, and particle shifting."""

import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.discretisation.discretisation import LinearTetrahedra
from reflowshock.particles.discretisation.inner_tetrahedra import fill_with_tetrahedra
from reflowshock.particles.physics.forces import SurfaceTension
from reflowshock.particles.physics.operators import Inertia, Mass, Viscosity
from reflowshock.particles.steps.interior_shift import SMALLEST_DEPTH, interior_shift
from reflowshock.particles.steps.time_step import TimeStep, capillary_limit
from reflowshock.particles.surface.surface_quality import vertex_normals


@pytest.fixture
def body():
    """Return a cube on a wall at rest."""
    return Body.at_rest(box_cloud(1.0, 6))


def discretise(body):
    """Return the operators of linear tetrahedra in a body."""
    return LinearTetrahedra.start(body.points, fill_with_tetrahedra(body), density=5.0)(body)


def power(matrix, field):
    """Return field . matrix field for a vector field, shape (n, 3)."""
    vector = field.T.ravel()
    return float(vector @ (matrix @ vector))


def test_viscous_power_of_simple_flows(body):
    """The integral of 2 mu D : D is mu V in shear, 4 mu V in extension and zero in rotation."""
    space = discretise(body)
    matrix = Viscosity(2.0).matrix(body, space, 1.0)
    x, y, z = body.points.T
    volume = body.volume()[0]
    assert power(matrix, np.column_stack((z, 0 * x, 0 * x))) == pytest.approx(2.0 * volume)
    assert power(matrix, np.column_stack((x, -y, 0 * x))) == pytest.approx(2.0 * 4.0 * volume)
    assert power(matrix, np.column_stack((-y, x, 0 * x))) == pytest.approx(0.0, abs=1e-12)
    assert abs(matrix - matrix.T).max() < 1e-12


def test_surface_tension_matrix_is_the_time_step_times_the_stiffness(body):
    tension = SurfaceTension(0.5)
    matrix = tension.matrix(body, discretise(body), 0.1)
    pulled = (matrix @ body.points.T.ravel()).reshape(3, -1).T
    assert pulled == pytest.approx(-0.1 * tension.force(body), abs=1e-12)


def test_mass_and_momentum(body):
    body.velocity[:] = [1.0, 2.0, 3.0]
    assert Mass(5.0).matrix(body, discretise(body), 0.5).sum() == pytest.approx(3 * 5.0 * 1.0 / 0.5)
    assert Inertia(5.0).load(body, discretise(body), 0.5).sum(axis=0) == pytest.approx([10.0, 20.0, 30.0])


def test_shift_keeps_particles_below_the_surface_and_on_their_wall(body):
    spacing, count = body.cloud.spacing, body.cloud.surface_count
    near_top = count + int(np.argmax(body.points[count:, 2]))
    body.points[near_top, 2] = 1.0 + 0.1 * spacing
    neighbours = NeighbourList(2.4 * spacing, 0.0)
    neighbours.update(body.points)
    shift = interior_shift(body, neighbours, vertex_normals(body.points, body.triangles, count))
    assert body.points[near_top, 2] + shift[near_top - count, 2] < 1.0 - (SMALLEST_DEPTH - 0.11) * spacing
    assert (shift[body.cloud.wall[body.interior] >= 0, 2] == 0.0).all()


def test_shift_equals_numpy_twin(body):
    """The twin evaluates the repulsion of inner particles."""
    rng, spacing, count = np.random.default_rng(12), body.cloud.spacing, body.cloud.surface_count
    body.points[body.interior] += 0.1 * spacing * rng.uniform(-1, 1, (len(body.interior), 3))
    neighbours = NeighbourList(2.4 * spacing, 0.0)
    neighbours.update(body.points)
    shift = interior_shift(body, neighbours, vertex_normals(body.points, body.triangles, count))
    for k, i in enumerate(body.interior):
        if not (np.abs(body.points[i] - [0, 0, 0.5]) < 0.25).all():
            continue
        d = body.points[i] - np.delete(body.points, i, axis=0)
        r = np.linalg.norm(d, axis=1)
        expected = 0.15 * spacing * (np.maximum(1 - r / (1.1 * spacing), 0) / r) @ d
        expected *= min(1.0, 0.1 * spacing / np.linalg.norm(expected))
        assert shift[k] == pytest.approx(expected, abs=1e-12)


def test_time_step_is_cut_by_the_displacement_and_grows_back():
    step = TimeStep(largest=1.0, spacing=0.1, size=1.0)
    assert not step.accepts(speed=0.05)
    assert step.binding == "displacement"
    assert step.size == pytest.approx(0.8 * 0.25 * 0.1 / 0.05)
    assert step.accepts(speed=0.05)
    step.grow(speed=0.05)
    assert (step.binding, step.size) == ("displacement", pytest.approx(0.9 * 0.25 * 0.1 / 0.05))
    step.grow(speed=0.01)
    assert (step.binding, step.size) == ("growth", pytest.approx(1.15 * 0.45))
    for _ in range(10):
        step.grow(speed=0.01)
    assert (step.binding, step.size) == ("capillary multiple", 1.0)


def test_capillary_limit_of_solder():
    """The limit 0.25 sqrt(rho h^3 / (2 pi gamma)) is 4.72 us at 0.05 mm."""
    assert capillary_limit(8930.0, 5e-5, 0.4985) == pytest.approx(4.72e-6, rel=1e-3)
