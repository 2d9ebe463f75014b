import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud, equal_area_radius, joint_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.surface_measure import enclosed_volume, ring_area
from reflowshock.particles.parameters.estimate import particle_count, reflow_seconds
from reflowshock.particles.parameters.solder import Solder

BALL = 0.0724e-9
GEOMETRY = JointGeometry(0.31e-3, 0.24e-3, 0.20e-3)


def edges(triangles):
    """Return the directed edges of triangles as a set of vertex pairs."""
    directed = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    return {tuple(edge) for edge in directed}


@pytest.mark.parametrize("cloud", [joint_cloud(GEOMETRY, BALL, 5e-5), box_cloud(1e-3, 6)], ids=["joint", "drop"])
def test_surface_is_an_oriented_manifold_that_ends_at_the_contact_lines(cloud):
    directed = edges(cloud.triangles)
    assert len(directed) == 3 * len(cloud.triangles)
    border = {edge for edge in directed if edge[::-1] not in directed}
    lines = set()
    for ring in cloud.rings:
        lines |= {frozenset(pair) for pair in zip(ring, np.roll(ring, -1), strict=True)}
    assert {frozenset(edge) for edge in border} == lines
    assert set(np.unique(cloud.triangles)) == set(range(cloud.surface_count))


def test_joint_has_the_volume_and_the_wetted_areas():
    cloud = joint_cloud(GEOMETRY, BALL, 5e-5)
    volume = enclosed_volume(cloud.points, cloud.triangles, cloud.rings, cloud.plates)
    assert volume == pytest.approx(BALL, rel=1e-10)
    for ring, radius in zip(cloud.rings, (0.24e-3, 0.20e-3), strict=True):
        assert ring_area(cloud.points, ring) == pytest.approx(np.pi * radius**2, rel=1e-12)


def test_particles_are_about_a_spacing_apart():
    cloud = joint_cloud(JointGeometry(0.31e-3, 0.24e-3, 0.24e-3), BALL, 5e-5)
    distance = np.linalg.norm(cloud.points[:, None] - cloud.points[None, :], axis=2)
    np.fill_diagonal(distance, np.inf)
    nearest = distance.min(axis=1) / cloud.spacing
    assert nearest.min() > 0.6
    assert nearest.max() < 1.2


def test_shares_of_the_volume_sum_to_the_volume():
    body = Body.at_rest(joint_cloud(GEOMETRY, BALL, 5e-5))
    assert body.volumes.sum() == pytest.approx(BALL)
    assert body.volumes.min() > 0.0


def test_a_volume_that_cannot_span_the_gap_is_an_error():
    with pytest.raises(ValueError, match=r"solder.volume .* ruptures"):
        joint_cloud(GEOMETRY, 0.01e-9, 5e-5)


def test_polygon_of_equal_area():
    radius = equal_area_radius(1.0, 12)
    assert 0.5 * 12 * radius**2 * np.sin(np.pi / 6) == pytest.approx(np.pi)


@pytest.mark.parametrize("gap", [0.28e-3, 0.31e-3, 0.42e-3])
def test_predicted_count_is_the_count(gap):
    geometry, solder = JointGeometry(gap, 0.24e-3, 0.24e-3), Solder(volume=BALL)
    assert particle_count(solder, geometry) == len(joint_cloud(geometry, BALL, solder.numerics.spacing).points)
    assert 0.1 < reflow_seconds(solder, geometry) < 6.0
