import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud, joint_cloud, sphere_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.surface_measure import (
    area_gradient,
    area_stiffness,
    cotangent_laplacian,
    enclosed_volume,
    ring_area,
    ring_area_gradient,
    surface_area,
    volume_and_gradient,
)
from reflowshock.particles.physics.forces import Gravity

CLOUDS = [box_cloud(1.0, 5), joint_cloud(JointGeometry(1.0, 0.8, 0.6), 1.9, 0.25)]


def shaken(cloud, seed=6):
    """Return randomly displaced points, tangential on walls."""
    move = 0.05 * cloud.spacing * np.random.default_rng(seed).normal(size=cloud.points.shape)
    move[cloud.wall >= 0, 2] = 0.0
    return cloud.points + move


def slope(function, points, direction, step=1e-6):
    """Return the derivative of a function of points along a direction, by differences."""
    return (function(points + step * direction) - function(points - step * direction)) / (2 * step)


def test_box_has_the_area_and_volume_of_a_cube():
    cloud = CLOUDS[0]
    assert surface_area(cloud.points, cloud.triangles) == pytest.approx(5.0)
    assert enclosed_volume(cloud.points, cloud.triangles, cloud.rings, cloud.plates) == pytest.approx(1.0)
    assert ring_area(cloud.points, cloud.rings[0]) == pytest.approx(1.0)


@pytest.mark.parametrize("cloud", CLOUDS, ids=["drop", "joint"])
def test_area_equals_numpy_twin(cloud):
    points = shaken(cloud)
    a, b, c = (points[cloud.triangles[:, k]] for k in range(3))
    assert surface_area(points, cloud.triangles) == pytest.approx(
        0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    )


@pytest.mark.parametrize("cloud", CLOUDS, ids=["drop", "joint"])
def test_volume_equals_numpy_twin(cloud):
    """The twin integrates z n_z over the free surface and the upper wall."""
    points = shaken(cloud)
    a, b, c = (points[cloud.triangles[:, k]] for k in range(3))
    free = float((np.cross(b - a, c - a)[:, 2] * (a + b + c)[:, 2]).sum() / 6)
    walls = sum(
        plate.origin[2] * ring_area(points, ring) for ring, plate in zip(cloud.rings[1:], cloud.plates[1:], strict=True)
    )
    volume = enclosed_volume(points, cloud.triangles, cloud.rings, cloud.plates)
    assert volume == pytest.approx(free + walls)


@pytest.mark.parametrize("cloud", CLOUDS, ids=["drop", "joint"])
def test_stiffness_times_position_is_the_gradient_of_the_area(cloud):
    points = shaken(cloud)
    stiffness = cotangent_laplacian(points, cloud.triangles, len(points))
    direction = np.random.default_rng(7).normal(size=points.shape)
    expected = slope(lambda x: surface_area(x, cloud.triangles), points, direction)
    assert float(((stiffness @ points) * direction).sum()) == pytest.approx(expected, rel=1e-7)
    assert abs(stiffness - stiffness.T).max() < 1e-12
    assert np.linalg.eigvalsh(stiffness.toarray()).min() > -1e-10


@pytest.mark.parametrize("cloud", CLOUDS, ids=["drop", "joint"])
def test_gradient_of_the_volume(cloud):
    points = shaken(cloud)
    direction = np.random.default_rng(8).normal(size=points.shape)
    direction[cloud.wall >= 0, 2] = 0.0
    gradient = volume_and_gradient(points, cloud.triangles, cloud.rings, cloud.plates)[1]
    expected = slope(lambda x: enclosed_volume(x, cloud.triangles, cloud.rings, cloud.plates), points, direction)
    assert float((gradient * direction).sum()) == pytest.approx(expected, rel=1e-7)


def test_gradient_of_the_wetted_area():
    cloud = CLOUDS[0]
    points, ring = shaken(cloud), cloud.rings[0]
    direction = np.zeros_like(points)
    direction[ring] = np.random.default_rng(9).normal(size=(len(ring), 3))
    expected = slope(lambda x: ring_area(x, ring), points, direction)
    assert float((ring_area_gradient(points, ring) * direction[ring]).sum()) == pytest.approx(expected, rel=1e-7)


def test_potential_energy_is_weight_times_height_of_the_centroid():
    body = Body.at_rest(CLOUDS[0])
    assert Gravity(3.0).energy(body) == pytest.approx(3.0 * 0.5)


@pytest.mark.parametrize("cloud", CLOUDS)
def test_the_force_of_gravity_is_the_gradient_of_its_energy(cloud):
    """The force is the exact gradient of the discrete energy in any direction."""
    body, gravity = Body.at_rest(cloud), Gravity(3.0)
    points = shaken(cloud)
    direction = np.random.default_rng(11).normal(size=points.shape)

    def energy(x):
        body.points = x
        return gravity.energy(body)

    expected = slope(energy, points, direction)
    body.points = points
    assert -float((gravity.force(body) * direction).sum()) == pytest.approx(expected, rel=1e-7)


def test_the_gradient_of_the_area_is_that_of_the_stiffness():
    random = np.random.default_rng(4)
    points, triangles = random.normal(size=(8, 3)), np.array([[0, 1, 2], [2, 1, 3], [3, 4, 5], [5, 6, 7]], np.int32)
    expected = cotangent_laplacian(points, triangles, 8) @ points
    assert area_gradient(points, triangles) == pytest.approx(expected, abs=1e-12)
    points[7] = points[6]
    assert np.isfinite(area_gradient(points, triangles)).all()


def test_the_stiffness_of_the_area_is_nearly_its_second_derivative():
    """The test stretches a ball at constant volume; a flat sheet resists normal and some tangential displacements."""
    cloud = sphere_cloud(1.0, 6)
    points, triangles, count = cloud.points, cloud.triangles, cloud.surface_count
    stretch = np.array([-1.0, -1.0, 2.0])
    areas = [surface_area(points * np.exp(step * stretch), triangles) for step in (-1e-3, 0.0, 1e-3)]
    field = (points * stretch)[:count].ravel()
    second = (areas[0] - 2.0 * areas[1] + areas[2]) / 1e-6
    assert field @ area_stiffness(points, triangles, count) @ field == pytest.approx(second, rel=0.05)
    sheet = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.2, 1.1, 0.0], [-0.5, 0.4, 0.0]])
    flat = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]], np.int32)
    across = cotangent_laplacian(sheet, flat, 5).toarray()
    whole = area_stiffness(sheet, flat, 5).toarray().reshape(5, 3, 5, 3)
    assert whole[:, 2, :, 2] == pytest.approx(across)
    assert whole[:, 0, :, 0] == pytest.approx(0.7 * across)
    assert np.abs(whole[:, 0, :, 1:]).max() == 0.0
