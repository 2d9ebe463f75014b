"""Inertial steps with moving plates."""

import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import joint_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.physics.operators import Inertia, Mass
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.physics.plate_motion import Travel
from reflowshock.particles.steps.inertial_step import InertialFlow, InertialStep


def test_a_plate_arrives_exactly_and_rests():
    """Second-order backward differences extrapolate half of the last step, but a stopping plate must not overshoot."""
    density, speed, time_step, target = 3.0, 0.5, 0.02, Plate.horizontal(1.045, side=1.0)
    body = Body.at_rest(joint_cloud(JointGeometry(1.0, 0.5, 0.5), 0.7, 0.25))
    travel = Travel(1, target, speed, lever=0.5)
    flow = InertialFlow(
        body, Physics((), (Mass(density),), (Inertia(density),), (), (), (travel,)), InertialStep(density)
    )
    heights = []
    for _ in range(7):
        flow.step(time_step)
        heights.append(body.plates[1].origin[2] - 1.0)
    assert heights == pytest.approx([0.01, 0.02, 0.03, 0.04, 0.045, 0.045, 0.045])
    assert body.points[body.cloud.wall == 1, 2] == pytest.approx(1.045)
    assert body.volume()[0] == pytest.approx(flow.volume, rel=1e-4)
    assert np.abs(body.velocity[body.cloud.wall == 1, 2]).max() < 1e-9
