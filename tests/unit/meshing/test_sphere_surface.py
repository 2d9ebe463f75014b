"""The identical joint: a truncated sphere as a closed surface, meshed under a flat package."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM
from reflowshock.meshing.surface.closed_surface import FREE, enclosed_volume, measure
from reflowshock.meshing.surface.sphere_surface import sphere_surface
from reflowshock.meshing.surface.truncated_sphere import TruncatedSphere


@pytest.mark.parametrize(("board", "package", "volume"), [(0.24, 0.24, 0.0724), (0.3, 0.2, 0.09), (0.24, 0.24, 0.03)])
def test_surface_equals_the_sphere(board, package, volume):
    sphere = TruncatedSphere.of_volume(volume * MM**3, board * MM, package * MM)
    surface = sphere_surface(sphere)
    measured = measure(surface)
    assert enclosed_volume(surface) == pytest.approx(volume * MM**3, rel=1e-4)
    assert measured["standoff"] == pytest.approx(sphere.height, rel=1e-12)
    for radius, name in ((board, "board"), (package, "package")):
        assert measured[f"contact_radius_{name}"] == pytest.approx(radius * MM, rel=1e-6)
    free = surface.points[np.unique(surface.triangles[surface.boundary == FREE])]
    assert np.abs(sphere.signed_distance(free)).max() < 1e-3 * sphere.radius


def test_volume_converges_at_second_order_in_the_levels():
    sphere = TruncatedSphere.of_volume(0.0724 * MM**3, 0.24 * MM, 0.24 * MM)
    errors = [1.0 - enclosed_volume(sphere_surface(sphere, levels=levels)) / sphere.volume for levels in (13, 25, 49)]
    assert np.diff(np.log2(errors)) == pytest.approx(-2.0, abs=0.02)
