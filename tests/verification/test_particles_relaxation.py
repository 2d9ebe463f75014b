"""Relaxation towards rest: iterations independent of size, motion of inner particles."""

import numpy as np
import pytest

from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.parameters.solder import Solder, SolderEffects, SolderNumerics
from reflowshock.particles.scenes.flow_setup import contact_line, start_flow
from reflowshock.particles.steps.flow import LiquidFlow

EFFECTS = {"surface_tension": True, "wall_adhesion": True, "gravity": False, "inertia": False, "viscosity": False}


def cube(degrees: float, count: int) -> LiquidFlow:
    """Return the flow of a cube on a wall, from contact angle [degrees] and particles per edge."""
    solder = Solder(
        volume=1e-9,
        pad_contact_angle=np.radians(degrees),
        numerics=SolderNumerics(time_step_limit=100),
        effects=SolderEffects(gravity="off"),
    )
    cloud = box_cloud(1e-3, count)
    return start_flow(cloud, solder, EFFECTS, (contact_line(cloud, 0, np.inf, solder),))


@pytest.mark.parametrize("count", [13, 27])
def test_iterations_do_not_grow_with_the_body(count):
    flow = cube(60, count)
    assert max(flow.step().iterations for _ in range(8)) <= 15


def test_particles_inside_stay_above_the_wall_and_are_no_faster_than_the_surface():
    flow = cube(60, 7)
    for _ in range(30):
        flow.step()
    body = flow.body
    assert (body.points[:, 2] > -1e-12).all()
    speed = np.linalg.norm(body.velocity, axis=1)
    assert speed[body.interior].max() <= speed[: body.cloud.surface_count].max() * (1 + 1e-12)
