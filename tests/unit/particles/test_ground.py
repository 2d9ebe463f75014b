"""The ground below a liquid surface: distances, normals, landing and images."""

import numpy as np
import pytest

from reflowshock.particles.core.grid import Grid
from reflowshock.particles.surface import ground
from reflowshock.particles.surface.level_set import LevelSet

RADIUS = 1.0


def ball():
    """Return the distance to a ball of radius 1 about the origin."""
    grid = Grid.around(np.array([[-2.0, -2.0, -2.0], [2.0, 2.0, 2.0]]), 0.1)
    x, y, z = np.meshgrid(*grid.axes(), indexing="ij")
    return LevelSet(grid, np.sqrt(x * x + y * y + z * z) - RADIUS)


def test_distances_and_normals_are_those_of_the_level_set():
    solid, points = ball(), np.random.default_rng(3).uniform(-1.9, 1.9, (200, 3))
    distance, normals = ground._distance_and_normals(solid, points)
    assert distance == pytest.approx(solid.at(points, 1), abs=1e-12)
    gradient = solid.gradient(points, 1)
    assert normals * np.linalg.norm(gradient, axis=1)[:, None] == pytest.approx(gradient, abs=1e-10)
    far = ground._distance_and_normals(solid, points + 100.0)[0]
    assert far == pytest.approx(solid.at(points + 100.0, 1), abs=1e-4)


def test_images_are_as_deep_as_points_are_high_and_turned():
    solid, points = ball(), np.array([[1.2, 0.0, 0.0], [0.0, 0.0, 1.9]])
    images, turned = ground.reflect_at_ground(solid, points, np.array([[1.0, 2.0, 0.0], [1.0, 1.0, 1.0]]), reach=0.5)
    assert images[0] == pytest.approx((0.8, 0.0, 0.0), abs=5e-3)
    assert turned[0] == pytest.approx((-1.0, 2.0, 0.0), abs=1e-9)
    assert np.array_equal(images[1], points[1]) and not turned[1].any()


def test_what_is_near_and_faces_the_ground_settles_on_it():
    points = np.array([[1.05, 0.0, 0.0], [1.05, 0.0, 0.0], [0.0, 0.95, 0.0], [0.0, 0.0, 1.5]])
    outward = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])
    share, normals = ground.settle_on_ground(ball(), points, outward, near=0.1)
    assert share == pytest.approx((1.0, 0.0, 0.0, 0.0))
    assert np.linalg.norm(points, axis=1) == pytest.approx((1.0, 1.05, 1.0, 1.5), abs=5e-3)
    vectors = ground.remove_normal_part(np.array([[3.0, 4.0, 0.0]]), share[:1], normals[:1])
    assert vectors[0] == pytest.approx((0.0, 4.0, 0.0), abs=1e-9)
