"""Forces of a surface across it: what drives vertices along it is taken out, the net force and moment are left."""

from dataclasses import replace

import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.ispg.normal_pull import normal_pull
from reflowshock.particles.ispg.rigid_motions import rigid_momenta, rigid_motions
from reflowshock.particles.physics.forces import SurfaceTension
from reflowshock.particles.physics.operators import NoSlip
from reflowshock.particles.physics.physics import Physics

ALONG_WALL = [0, 1, 5]  # two shifts and the turn that walls without friction admit


@pytest.fixture(scope="module")
def body():
    """A cube on a wall that is skewed, so that nothing is symmetric."""
    cube = Body.at_rest(box_cloud(1.0, 5))
    x, y, z = cube.points.T
    return replace(cube, points=cube.points + 0.1 * np.column_stack((x * y + z, x * z - y**2, z * x)))


def test_net_force_and_moment_stay(body):
    physics, masses = Physics((SurfaceTension(1.0),), (), (), (), (), holds=(NoSlip(),)), np.ones(len(body.points))
    motions, whole = rigid_motions(body.points)[ALONG_WALL], physics.force(body)
    pull = normal_pull(body, physics, masses)
    assert rigid_momenta(motions, masses, pull) == pytest.approx(rigid_momenta(motions, masses, whole), abs=1e-12)
    assert np.abs(pull - whole).max() > 0.01 * np.abs(whole).max()


def test_nothing_pulls_along_the_surface_but_a_swirl(body):
    physics, count = Physics((SurfaceTension(1.0),), (), (), (), ()), body.cloud.surface_count
    masses = np.ones(len(body.points))
    pull = physics.admit(body, normal_pull(body, physics, masses))
    normal = physics.admit(body, body.volume()[1])[:count]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    swirl = (
        pull[-1, 0]
        / (body.points.mean(axis=0) - body.points[-1])[1]
        * rigid_motions(body.points - body.points.mean(axis=0))[5]
    )
    assert pull[count:] == pytest.approx(swirl[count:], abs=1e-12)
    along = (pull - swirl)[:count]
    assert along - (along * normal).sum(axis=1)[:, None] * normal == pytest.approx(0.0, abs=1e-12)
