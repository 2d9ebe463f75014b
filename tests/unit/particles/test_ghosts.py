import numpy as np
import pytest

from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.gripc.moving_least_squares import fit_derivatives
from reflowshock.particles.ispg.ghosts import mirror_particles

REACH = 0.3


def tilted() -> Plate:
    """Return a plate that is tilted about x and y."""
    return Plate.horizontal(0.0).moved(np.array([0.0, 0.0, 0.0, 0.2, -0.1, 0.0]))


@pytest.fixture
def points():
    """Return random points, some of them on z = 0, shape (n, 3)."""
    cloud = np.random.default_rng(3).uniform(0.0, 1.0, (200, 3))
    cloud[:20, 2] = 0.0
    return cloud


def test_images_equal_a_loop_over_particles(points):
    """The twin applies the reflection formula to one particle at a time."""
    plate = tilted()
    images = mirror_particles(points, (plate,), REACH)
    expected, source = [], []
    for number, point in enumerate(points):
        height = float((point - plate.origin) @ plate.normal)
        if 1e-6 * REACH < height < REACH:
            expected.append(point - 2.0 * height * plate.normal)
            source.append(number)
    assert images.source.tolist() == source
    assert images.points == pytest.approx(np.array(expected))


def test_particles_on_the_wall_are_their_own_image(points):
    images = mirror_particles(points, (Plate.horizontal(0.0),), REACH)
    assert not set(images.source) & set(range(20))


def test_an_edge_between_two_walls_has_images_of_both():
    side = Plate(np.zeros(3), np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]))
    images = mirror_particles(np.array([[0.1, 0.5, 0.1]]), (Plate.horizontal(0.0), side), REACH)
    expected = [[-0.1, 0.5, -0.1], [-0.1, 0.5, 0.1], [0.1, 0.5, -0.1]]
    assert np.array(sorted(images.points.tolist())) == pytest.approx(np.array(expected))
    velocity = images.vector(1) @ np.array([1.0, 2.0, 3.0])
    assert pytest.approx(np.sign([[0.1, 0.5, 0.1], *images.points]) * [1.0, 2.0, 3.0]) == velocity.reshape(3, -1).T


@pytest.mark.parametrize("slip", [np.inf, 0.1, 0.0])
def test_images_of_liquid_that_a_plate_takes_along_move_with_both(slip):
    """Images follow the rigid motion of plate and liquid, including images at a second plate."""
    points = np.random.default_rng(4).uniform(0.05, 0.25, (30, 3))
    plates = (tilted(), Plate.horizontal(0.4, side=1.0))
    twist = np.array([0.3, -0.2, 0.5, 0.7, 1.1, -0.4])
    mirrored = mirror_particles(points, plates, 2.0 * REACH, [slip, slip])
    other = np.concatenate((twist[:3] + np.cross(twist[3:], plates[1].origin - plates[0].origin), twist[3:]))
    moving = plates[0].rigid_velocity(twist, points)
    images = np.einsum("gcd,gd->gc", mirrored.reflection, moving[mirrored.source])
    images += mirrored.drift(points, plates, {0: twist, 1: other})
    assert set(mirrored.parent) - set(range(30))
    assert images == pytest.approx(plates[0].rigid_velocity(twist, mirrored.points))


def test_a_plate_that_slides_takes_nothing_along_without_friction():
    points = np.random.default_rng(4).uniform(0.05, 0.25, (30, 3))
    plates = (Plate.horizontal(0.0),)
    drift = mirror_particles(points, plates, REACH).drift(points, plates, {0: np.array([1.0, 2.0, 0.0, 0.0, 0.0, 3.0])})
    assert drift == pytest.approx(0.0, abs=1e-12)


def gradients(basis):
    """Return gradients at wall particles, of an even field and a mirrored vector field."""
    axis = np.linspace(0.0, 1.0, 7)
    cloud = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    cloud += np.random.default_rng(8).uniform(-0.02, 0.02, cloud.shape) * (cloud[:, 2:] > 0.0)
    ghosts = mirror_particles(cloud, (Plate.horizontal(0.0),), 0.4)
    everything = np.concatenate((cloud, ghosts.points))
    rows = np.flatnonzero((cloud[:, 2] == 0.0) & (np.abs(cloud[:, :2] - 0.5) < 0.3).all(axis=1)).astype(np.int32)
    neighbours = NeighbourList(0.4, 0.0)
    neighbours.update(everything)
    fitted = fit_derivatives(everything, rows, neighbours, basis)
    scalar = ghosts.even(len(cloud)) @ (2.0 * cloud[:, 0] - cloud[:, 1] + 3.0)
    vector = ghosts.vector(len(cloud)) @ np.column_stack((cloud[:, 0], -3.0 * cloud[:, 1], 2.0 * cloud[:, 2])).T.ravel()
    components = [scalar, *vector.reshape(3, -1)]
    return np.array([[(part @ field).ravel() for part in fitted.gradient] for field in components])


@pytest.mark.parametrize("basis", ["linear", "quadratic"])
def test_linear_fields_that_fit_the_wall_are_exact_on_it(basis):
    """The fields are a scalar without normal gradient and a velocity along the wall."""
    exact = np.array([[2.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -3.0, 0.0], [0.0, 0.0, 2.0]])
    assert gradients(basis) == pytest.approx(np.broadcast_to(exact[:, :, None], gradients(basis).shape), abs=1e-9)


def test_a_quadratic_even_field_is_exact_at_the_wall():
    """For the even field u = x^2 - z^2 the Laplacian and the normal gradient vanish on the wall."""
    axis = np.linspace(-0.5, 0.5, 7)
    cloud = np.stack(np.meshgrid(axis, axis, axis + 0.5, indexing="ij"), axis=-1).reshape(-1, 3)
    ghosts = mirror_particles(cloud, (Plate.horizontal(0.0),), 0.4)
    everything = np.concatenate((cloud, ghosts.points))
    neighbours = NeighbourList(0.4, 0.0)
    neighbours.update(everything)
    row = np.array([np.argmin((cloud**2).sum(axis=1))], np.int32)
    fitted = fit_derivatives(everything, row, neighbours, "quadratic")
    field = ghosts.even(len(cloud)) @ (cloud[:, 0] ** 2 - cloud[:, 2] ** 2)
    assert fitted.laplacian @ field == pytest.approx(0.0, abs=1e-9)
    assert fitted.gradient[2] @ field == pytest.approx(0.0, abs=1e-9)
