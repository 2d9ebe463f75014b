import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import joint_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.physics.plate_motion import LIFT, SHIFT, TURN, Floating, Travel
from reflowshock.particles.steps.step_equations import Admissible

SPEED = 0.5


@pytest.fixture
def body():
    """Return a body between an offset, tilted package and a board."""
    return Body.at_rest(joint_cloud(JointGeometry(1.0, 0.8, 0.8, offset=(0.1, 0.0), tilt=(0.1, 0.2)), 2.2, 0.25))


@pytest.fixture
def pinned(body):
    """Return whether each particle is on a contact line, shape (n,)."""
    pinned = np.zeros(len(body.points), bool)
    pinned[np.concatenate(body.cloud.rings)] = True
    return pinned


def field_of(admissible, unknowns):
    """Return the velocity field of unknowns, shape (n, 3)."""
    return (admissible.basis @ unknowns).reshape(3, -1).T


def test_own_motion_slides_on_plates_and_leaves_edges(body, pinned):
    admissible = Admissible(body, pinned, ())
    walls = body.cloud.wall
    assert admissible.basis.shape[1] == 3 * (walls < 0).sum() + 2 * ((walls >= 0) & ~pinned).sum()
    field = field_of(admissible, np.random.default_rng(1).normal(size=admissible.basis.shape[1]))
    assert (field[pinned] == 0.0).all()
    for wall, plate in enumerate(body.plates):
        assert field[walls == wall] @ plate.normal == pytest.approx(0.0, abs=1e-14)
    gram = (admissible.basis.T @ admissible.basis).toarray()
    assert gram == pytest.approx(np.eye(len(gram)), abs=1e-14)


def test_a_floating_plate_carries_its_particles_and_its_load(body, pinned):
    load = np.array([0.1, 0.2, -3.0])
    directions = np.vstack((LIFT, SHIFT, TURN))
    admissible = Admissible(body, pinned, (Floating(1, directions, load),))
    unknowns = np.zeros(admissible.basis.shape[1])
    unknowns[-5:] = rates = np.random.default_rng(2).normal(size=5)
    twist = admissible.twists(unknowns, 1.0)[1]
    assert twist == pytest.approx(rates @ directions)
    field, rigid = field_of(admissible, unknowns), body.plates[1].rigid_velocity(twist, body.points)
    on_plate, normal = body.cloud.wall == 1, body.plates[1].normal
    assert field[pinned & on_plate] == pytest.approx(rigid[pinned & on_plate])
    assert field[on_plate] @ normal == pytest.approx(rigid[on_plate] @ normal)
    assert (field[~on_plate] == 0.0).all()
    forces = np.random.default_rng(3).normal(size=field.size)
    work = float(admissible.reduce(forces) @ unknowns)
    assert work == pytest.approx(forces @ field.T.ravel() + load @ twist[:3])


def test_a_travelling_plate_arrives_with_its_particles(body, pinned):
    target = Plate.horizontal(0.9, (0.0, 0.2))
    travel, arrived = Travel(1, target, SPEED, lever=0.8), 0
    before = body.plates[1].local(body.points)
    way = np.linalg.norm(body.plates[1].motion_to(target) * np.repeat((1.0, 0.8), 3))
    time_step = 0.1 * way / SPEED
    while np.abs(body.plates[1].motion_to(target)).max() > 1e-12:
        admissible = Admissible(body, pinned, (travel,))
        body.velocity = admissible.prescribed(time_step).reshape(3, -1).T
        body.move(time_step, body.velocity, admissible.twists(np.zeros(admissible.basis.shape[1]), time_step))
        arrived += 1
    assert arrived == pytest.approx(10, abs=1)
    on_edge = pinned & (body.cloud.wall == 1)
    assert target.local(body.points[on_edge]) == pytest.approx(before[on_edge], abs=1e-12)
    assert target.local(body.points[body.cloud.wall == 1])[:, 2] == pytest.approx(0.0, abs=1e-12)
