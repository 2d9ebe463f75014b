"""Contact angle hysteresis: a drop that is filled and emptied on one wall, against spherical caps."""

import numpy as np
import pytest

from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.core.surface_measure import ring_area
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.scenes.reflow import start_flow, stop_rule
from reflowshock.particles.steps.rest import run_to_rest
from reflowshock.particles.surface.contact_line import HystereticLine
from tests.support.level_sets import cap_radius

RECEDING, ADVANCING = np.radians(60.0), np.radians(110.0)
VOLUME = 1e-9
EFFECTS = {"surface_tension": True, "gravity": False, "wall_adhesion": True, "viscosity": False, "inertia": False}


def base_radius(volume, angle):
    return cap_radius(volume, angle) * np.sin(angle)


@pytest.fixture(scope="module")
def flow():
    cloud = box_cloud(np.cbrt(VOLUME), 8)
    solder = Solder(volume=VOLUME, numerics=SolderNumerics(spacing=cloud.spacing, max_steps=2000))
    return start_flow(
        cloud, solder, EFFECTS, (HystereticLine(0, RECEDING, ADVANCING, cloud.points[cloud.rings[0]]),)
    ), solder


def to_volume(flow, solder, volume):
    """Fill or empty slowly, wait for rest; return radius of the wetted area, height and contact angle of a cap."""
    steps = round(80.0 * abs(volume - flow.volume) / VOLUME)
    for target in np.linspace(flow.volume, volume, steps + 1)[1:]:
        flow.volume = target
        flow.step()
    run_to_rest(flow, stop_rule(flow.body.cloud, solder, EFFECTS))
    points, ring = flow.body.points, flow.body.cloud.rings[0]
    radius, height = np.sqrt(ring_area(points, ring) / np.pi), np.ptp(points[:, 2])
    assert flow.body.volume()[0] == pytest.approx(volume, rel=1e-3)
    return radius, height, 2.0 * np.degrees(np.arctan(height / radius))


def test_a_drop_that_is_filled_and_emptied(flow):
    liquid, solder = flow
    radius, _, angle = to_volume(liquid, solder, 1.4 * VOLUME)
    assert angle == pytest.approx(np.degrees(ADVANCING), abs=1.5)  # it has advanced
    assert radius == pytest.approx(base_radius(1.4 * VOLUME, ADVANCING), rel=2e-2)
    stood, height, angle = to_volume(liquid, solder, 0.9 * VOLUME)
    assert stood == pytest.approx(radius, rel=1e-2)  # it stands, where an advancing line would go back by 14 %
    assert np.degrees(RECEDING) < angle < np.degrees(ADVANCING)
    assert np.pi * height * (3.0 * stood**2 + height**2) / 6.0 == pytest.approx(0.9 * VOLUME, rel=1e-2)
    radius, _, angle = to_volume(liquid, solder, 0.3 * VOLUME)
    assert angle == pytest.approx(np.degrees(RECEDING), abs=1.0)  # it has receded
    assert radius == pytest.approx(base_radius(0.3 * VOLUME, RECEDING), rel=1e-2)
