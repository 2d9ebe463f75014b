"""The truncated sphere against its own formulas and brute force."""

import numpy as np
import pytest

from reflowshock.meshing.surface.truncated_sphere import TruncatedSphere

DISCS = ((2.4e-4, 2.4e-4), (2.4e-4, 2.0e-4), (1.0e-4, 2.9e-4))


@pytest.mark.parametrize("discs", DISCS)
@pytest.mark.parametrize("volume", [7.24e-11, 1.0e-12])
def test_height_follows_from_volume(discs, volume):
    zone = TruncatedSphere.of_volume(volume, *discs)
    assert zone.volume == pytest.approx(volume, rel=1e-12)
    for height, radius in ((0.0, zone.radius_board), (zone.height, zone.radius_package)):
        assert np.hypot(radius, height - zone.centre) == pytest.approx(zone.radius, rel=1e-12)


def test_equal_discs_are_symmetric():
    zone = TruncatedSphere.of_volume(7.24e-11, 2.4e-4, 2.4e-4)
    assert zone.centre == pytest.approx(0.5 * zone.height)
    assert zone.radius**2 == pytest.approx(2.4e-4**2 + 0.25 * zone.height**2)


@pytest.mark.parametrize("discs", DISCS)
def test_distance_equals_the_distance_to_the_nearest_point(discs):
    zone = TruncatedSphere.of_volume(7.24e-11, *discs)
    heights = np.linspace(0.0, zone.height, 20001)
    radii = np.sqrt(zone.radius**2 - (heights - zone.centre) ** 2)
    points = np.random.default_rng(1).uniform([-4e-4, 0.0, -2e-4], [4e-4, 1e-9, 6e-4], (200, 3))
    nearest = [np.hypot(radii - np.hypot(x, y), heights - z).min() for x, y, z in points]
    inside = (points[:, 2] >= 0.0) & (points[:, 2] <= zone.height)
    inside &= np.abs(points[:, 0]) < np.sqrt(np.maximum(zone.radius**2 - (points[:, 2] - zone.centre) ** 2, 0.0))
    assert zone.signed_distance(points) == pytest.approx(np.where(inside, -1.0, 1.0) * nearest, abs=2e-8)


def test_the_centre_of_a_whole_sphere_is_inside():
    zone = TruncatedSphere(2.0, 1e-6, 1e-6)
    assert zone.signed_distance(np.array([[0.0, 0.0, zone.centre]])) == pytest.approx([-1.0], rel=1e-6)
