import numpy as np
import pytest

from reflowshock.particles.core.cloud import box_cloud, joint_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.surface.profile import fit_profile, section_areas


def test_sections_of_a_cube():
    cloud = box_cloud(2.0, 5)
    assert section_areas(cloud.points, cloud.triangles, np.array([0.1, 0.7, 1.9])) == pytest.approx(4.0)


def test_sections_integrate_to_the_volume():
    volume, gap = 2.2, 1.0
    cloud = joint_cloud(JointGeometry(gap, 0.8, 0.7), volume, 0.15)
    nodes, weights = np.polynomial.legendre.leggauss(400)
    areas = section_areas(cloud.points, cloud.triangles, 0.5 * gap * (nodes + 1.0))
    assert 0.5 * gap * areas @ weights == pytest.approx(volume, rel=1e-4)


def test_profile_of_a_sphere_between_two_planes():
    """Vertices lie on the zone |z| < 0.6 of the unit sphere; the inscribed polyhedron is 0.3 % too small."""
    cloud = joint_cloud(JointGeometry(1.2, 0.8, 0.8), 3.3, 0.08)
    points = cloud.points - [0.0, 0.0, 0.6]
    radius = np.sqrt(1.0 - points[:, 2] ** 2)
    surface = slice(cloud.surface_count)
    points[surface, :2] *= (radius / np.linalg.norm(points[:, :2], axis=1).clip(1e-12))[surface, None]
    profile = fit_profile(points, cloud.triangles)
    assert profile.max_width == pytest.approx(2.0, rel=3e-3)
    assert profile.waist == pytest.approx(1.6, rel=3e-3)
