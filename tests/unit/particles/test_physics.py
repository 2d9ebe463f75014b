"""Consistent constraints of plates, planes of symmetry and pad edges."""

from types import SimpleNamespace

import numpy as np

from reflowshock.particles.physics.physics import Physics


def test_projections_do_what_admit_does():
    """The body is a quarter model on two tilted plates, with each kind of particle."""
    random = np.random.default_rng(2)
    points = random.uniform(0.5, 1.0, (30, 3))
    points[::2, 0], points[::3, 1] = 0.0, 0.0
    normals = np.array([[0.1, 0.2, 1.0], [-0.3, 0.1, -1.0]])
    plates = [SimpleNamespace(normal=normal / np.linalg.norm(normal)) for normal in normals]
    cloud = SimpleNamespace(points=points, wall=np.arange(30) % 3 - 1, symmetry=(0, 1))
    body = SimpleNamespace(points=points, plates=plates, cloud=cloud)
    hold = SimpleNamespace(pinned=lambda body: np.array([3, 4, 17], np.int32))
    physics, field = Physics([], [], [], [], [], holds=[hold]), random.normal(size=(30, 3))
    projections = physics.projections(body)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", projections, field), physics.admit(body, field), atol=1e-15)
    expected = np.tile(np.eye(3), (30, 1, 1))
    for number, plate in enumerate(plates):
        expected[cloud.wall == number] -= np.outer(plate.normal, plate.normal)
    expected[points[:, 0] == 0.0, 0] = 0.0
    expected[points[:, 1] == 0.0, 1] = 0.0
    expected[[3, 4, 17]] = 0.0
    assert np.array_equal(projections, expected)
