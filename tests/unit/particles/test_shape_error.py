"""Distance of a triangulated surface from an exact surface of revolution."""

import numpy as np
import pytest

from reflowshock.particles.reference.shape_error import distance, shape_error
from reflowshock.particles.reference.young_laplace import sphere_meridian

VOLUME = 4.0 / 3.0 * np.pi * 1e-9  # sphere of 1 mm
OCTAHEDRON = np.vstack((np.eye(3), -np.eye(3)))
FACES = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])


def refined(points, triangles):
    """Split each triangle into four with new vertices on the unit sphere."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    middles = [(a + b) / 2, (b + c) / 2, (c + a) / 2]
    ab, bc, ca = (m / np.linalg.norm(m, axis=1, keepdims=True) for m in middles)
    pieces = [np.stack(piece, axis=1) for piece in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return np.concatenate(pieces).reshape(-1, 3), np.arange(12 * len(triangles)).reshape(-1, 3)


def test_distance_to_the_nearest_point_of_the_surface():
    sphere = sphere_meridian(VOLUME, 0.5)
    points = 1e-3 * np.array([[1.1, 0.0, 0.0], [0.0, 0.6, 0.6], [0.0, 0.0, -0.5]])
    exact = 1e-3 * np.array([0.1, 1.0 - 0.6 * np.sqrt(2.0), 0.5])
    assert distance(points, sphere) == pytest.approx(exact, abs=1e-8)  # the meridian has 400 straight pieces


def test_error_of_a_surface_shifted_outwards_is_its_shift():
    points, triangles = OCTAHEDRON, FACES
    for _ in range(5):
        points, triangles = refined(points, triangles)
    assert shape_error(1.05e-3 * points, triangles, sphere_meridian(VOLUME, 0.5)) == pytest.approx(5e-5, rel=0.02)


def test_flat_triangles_on_a_sphere_are_off_by_second_order():
    points, triangles, errors = OCTAHEDRON, FACES, []
    for _ in range(5):
        points, triangles = refined(points, triangles)
        errors.append(shape_error(1e-3 * points, triangles, sphere_meridian(VOLUME, 0.5)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-2:] == pytest.approx(2.0, abs=0.1)
