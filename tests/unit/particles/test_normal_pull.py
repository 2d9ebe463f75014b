"""Normal forces of a surface: the tangential part is removed, net force and moment are unchanged."""

from dataclasses import replace

import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.ispg.normal_forces import normal_surface_force, tangential_share
from reflowshock.particles.ispg.rigid_motions import edges_are_coaxial, rigid_momenta, rigid_motions
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.forces import SurfaceTension
from reflowshock.particles.physics.operators import NoSlip
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.scenes.reflow import LiquidJoint

ALONG_WALL = [0, 1, 5]  # two translations and the rotation that a frictionless wall admits


@pytest.fixture(scope="module")
def body():
    """Return a skewed cube on a wall, without symmetry."""
    cube = Body.at_rest(box_cloud(1.0, 5))
    x, y, z = cube.points.T
    return replace(cube, points=cube.points + 0.1 * np.column_stack((x * y + z, x * z - y**2, z * x)))


def test_net_force_and_moment_stay(body):
    physics, masses = Physics((SurfaceTension(1.0),), (), (), (), (), holds=(NoSlip(),)), np.ones(len(body.points))
    motions, whole = rigid_motions(body.points)[ALONG_WALL], physics.force(body)
    pull = normal_surface_force(body, physics, masses)
    assert rigid_momenta(motions, masses, pull) == pytest.approx(rigid_momenta(motions, masses, whole), abs=1e-12)
    assert np.abs(pull - whole).max() > 0.01 * np.abs(whole).max()


def test_the_tangential_force_is_a_swirl(body):
    physics, count = Physics((SurfaceTension(1.0),), (), (), (), ()), body.cloud.surface_count
    masses = np.ones(len(body.points))
    pull = physics.admit(body, normal_surface_force(body, physics, masses))
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


def test_under_fast_strain_the_whole_force_acts(body):
    physics = Physics((SurfaceTension(1.0),), (), (), (), ())
    still, fast = np.zeros((3, 3, 3)), np.broadcast_to(np.diag([1.0, -1.0, 0.0]), (3, 3, 3))
    assert (tangential_share(still, 1.0), tangential_share(fast, 1.0)) == (0.0, 1.0)
    assert 0.0 < tangential_share(0.01 * fast, 1.0) < 1.0
    whole = normal_surface_force(body, physics, np.ones(len(body.points)), share=1.0)
    assert whole == pytest.approx(physics.force(body), abs=1e-12)


@pytest.mark.parametrize(("offset", "turns"), [(0.0, True), (7e-5, False)])
def test_round_edges_about_the_axis_do_not_turn_a_body(offset, turns):
    geometry, solder = JointGeometry(0.35e-3, 0.24e-3, 0.24e-3, (offset, 0.0)), Solder(volume=7.2e-11)
    flow = LiquidJoint(geometry, solder).start()
    assert edges_are_coaxial(flow.body, flow.physics) == turns
