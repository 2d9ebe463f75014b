from types import SimpleNamespace

import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud, equal_area_radius, joint_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import Pad, Plate
from reflowshock.particles.core.surface_measure import ring_area
from reflowshock.particles.physics.forces import Wetting
from reflowshock.particles.scenes.metrics import verdict
from reflowshock.particles.steps.descent import StepStart
from reflowshock.particles.surface.contact_line import ON_MASK, ON_PAD, PINNED, ContactLine
from reflowshock.particles.surface.hysteresis import ADVANCING, RECEDING, FrictionLine

PAD, MASK = np.radians(5.0), np.radians(148.0)


@pytest.fixture
def body():
    """Return a body between two equal discs."""
    return Body.at_rest(joint_cloud(JointGeometry(1.0, 0.8, 0.8), 2.2, 0.2))


def line_on(body, state=PINNED, pad=PAD):
    """Return the contact line of a body on its first wall, with all vertices in a state."""
    ring = body.cloud.rings[0]
    line = ContactLine(0, (Pad((0, 0), 0.8, pad),), MASK, body.points[ring], np.array([len(ring)]))
    assert (line.state == PINNED).all()
    line.state[:] = state
    return line


def load_of_angle(body, line, angle):
    """Return the forces of a surface at a contact angle on the line, gamma = 1."""
    load = np.zeros_like(body.points)
    radial, length = line.outward(body)
    load[body.cloud.rings[0]] = -np.cos(angle) * length[:, None] * radial
    return load


@pytest.mark.parametrize(("degrees", "state"), [(2.0, PINNED), (60.0, PINNED), (140.0, PINNED), (155.0, ON_MASK)])
def test_gibbs_condition_at_the_edge(body, degrees, state):
    line = line_on(body)
    line.update(body, load_of_angle(body, line, np.radians(degrees)), 1.0)
    assert (line.state == state).all()


def test_line_recedes_below_the_angle_of_the_pad(body):
    line = line_on(body, pad=np.radians(40.0))
    line.update(body, load_of_angle(body, line, np.radians(30.0)), 1.0)
    assert (line.state == ON_PAD).all()


@pytest.mark.parametrize(("state", "factor"), [(ON_PAD, 1.03), (ON_MASK, 0.97)])
def test_a_vertex_that_crosses_the_edge_is_caught_there(body, state, factor):
    line, vertex = line_on(body, state), body.cloud.rings[0][4]
    away = 2.0 - factor
    body.points[body.cloud.rings[0], :2] *= away
    body.points[vertex, :2] *= factor / away
    line.update(body, load_of_angle(body, line, np.radians(90.0)), 1.0)
    assert line.state[4] == PINNED
    assert (np.delete(line.state, 4) == state).all()
    assert np.linalg.norm(body.points[vertex]) == pytest.approx(line.edges[0])


def test_a_vertex_near_the_edge_is_caught_where_the_edge_would_hold_it(body):
    line, ring = line_on(body, ON_MASK), body.cloud.rings[0]
    body.points[ring, :2] *= 1.005
    assert not line.near_edges(body, load_of_angle(body, line, np.radians(150.0)), 1.0).any()
    near = line.near_edges(body, load_of_angle(body, line, np.radians(140.0)), 1.0)
    assert near.all()
    line.catch(body, near)
    assert (line.state == PINNED).all()
    assert np.linalg.norm(body.points[ring], axis=1) == pytest.approx(line.edges[0])


def test_a_vertex_that_a_step_stopped_at_an_edge_is_held_for_the_next_one(body):
    """The first stopped vertex stays pinned while the others arrive, although its angle differs."""
    line, ring = line_on(body, ON_MASK), body.cloud.rings[0]
    body.points[ring, :2] *= 1.03
    body.points[ring[4], :2] *= 0.97 / 1.03
    line.stop_at_edges(body)
    assert (np.flatnonzero(line.state == PINNED) == [4]).all()
    assert np.linalg.norm(body.points[ring[4]]) == pytest.approx(line.edges[0])
    released = load_of_angle(body, line, np.radians(155.0))
    line.update(body, released, 1.0)
    assert line.state[4] == PINNED
    line.update(body, released, 1.0)
    assert line.state[4] == ON_MASK


def test_vertices_near_an_edge_are_put_onto_it_on_trial(body):
    line, ring = line_on(body, ON_MASK), body.cloud.rings[0]
    body.points[ring, :2] *= 1.005
    load = load_of_angle(body, line, np.radians(140.0))
    wetting = Wetting(1.0, (line,), (SimpleNamespace(force=lambda _: load),))
    wetting.update(body)
    assert (line.state == ON_MASK).all()
    before, start = body.points.copy(), StepStart.of(body, (line,))
    assert wetting.attempt(body)
    assert (line.state == PINNED).all()
    assert not wetting.attempt(body)
    start.restore(body, (line,))
    assert (body.points == before).all()
    assert (line.state == ON_MASK).all()


def test_contact_cosine_inverts_the_pull(body):
    line = line_on(body)
    cosine = line.contact_cosine(body, load_of_angle(body, line, np.radians(70.0)), 1.0)
    assert np.degrees(np.arccos(cosine)) == pytest.approx(70.0)


def test_wetting_force_is_the_gradient_of_its_energy_and_vanishes_at_right_angles():
    body = Body.at_rest(box_cloud(1.0, 5))
    ring = body.cloud.rings[0]
    for degrees, pull in ((60.0, 0.5), (90.0, 0.0)):
        line = ContactLine(
            0, (Pad((0, 0), np.inf, np.radians(degrees)),), MASK, body.points[ring], np.array([len(ring)])
        )
        wetting = Wetting(2.0, (line,), ())
        assert wetting.energy(body) == pytest.approx(-2.0 * pull * ring_area(body.points, ring))
        # Widening the square by a factor 1 + e gains 2 e gamma cos(theta) A.
        assert float((wetting.force(body) * body.points).sum()) == pytest.approx(2.0 * 2.0 * pull, abs=1e-12)


def test_wetting_energy_is_continuous_at_the_edge_and_falls_along_the_force(body):
    """With half of the line on the mask, the energy change of a vertex leaving the edge is the work of its force."""
    line, ring = line_on(body), body.cloud.rings[0]
    wetting, count = Wetting(2.0, (line,), ()), len(body.cloud.rings[0]) // 2
    line.state[:count] = ON_MASK
    assert wetting.energy(body) == pytest.approx(0.0, abs=1e-15)
    body.points[ring[:count], :2] *= 1.1
    field = np.zeros_like(body.points)
    field[ring[:count], :2] = body.points[ring[:count], :2]
    force = wetting.force(body)
    energies = []
    for step in (1e-6, -1e-6):
        moved = Body.at_rest(body.cloud)
        moved.points = body.points + step * field
        energies.append(wetting.energy(moved))
    assert float((force * field).sum()) == pytest.approx(-(energies[0] - energies[1]) / 2e-6, rel=1e-6)


@pytest.mark.parametrize("degrees", [2.0, 155.0])
def test_wetting_energy_does_not_jump_where_an_edge_releases_and_catches_a_vertex_of_an_uneven_line(body, degrees):
    """Vertices that left an edge and returned are unevenly spaced along it."""
    line, ring = line_on(body, pad=np.radians(40.0)), body.cloud.rings[0]
    angle = 2.0 * np.pi * (np.arange(len(ring)) + 0.2 * np.sin(np.arange(len(ring)))) / len(ring)
    body.points[ring, :2] = line.edges[0] * np.column_stack((np.cos(angle), np.sin(angle)))
    wetting, load = Wetting(2.0, (line,), ()), load_of_angle(body, line, np.radians(90.0))
    held = wetting.energy(body)
    load[ring[3:9]] = load_of_angle(body, line, np.radians(degrees))[ring[3:9]]
    line.update(body, load, 1.0)
    assert (line.state[4:8] != PINNED).all()
    assert wetting.energy(body) == pytest.approx(held, abs=1e-14)
    line.catch(body, line.state != PINNED)
    assert wetting.energy(body) == pytest.approx(held, abs=1e-14)


def test_wetting_force_is_the_gradient_of_its_energy_where_vertices_differ():
    """Vertices lie on pad, mask and edge in any order, on a tilted plate."""
    body = Body.at_rest(joint_cloud(JointGeometry(1.0, 0.8, 0.6, (0.3, 0.0), (0.0, 0.1)), 2.2, 0.2))
    random = np.random.default_rng(3)
    ring, plate = body.cloud.rings[1], body.plates[1]
    local = plate.local(body.points[ring])
    line = ContactLine(1, (Pad((0, 0), 0.6, PAD),), MASK, local, np.array([len(ring)]))
    line.state[:] = random.integers(PINNED, ON_MASK + 1, len(ring))
    side = np.select([line.state == ON_PAD, line.state == ON_MASK], [-1.0, 1.0], 0.0)
    local[:, :2] *= (1.0 + 0.05 * side * random.random(len(ring)))[:, None]
    points = body.points.copy()
    points[ring] = plate.place(local)
    wetting, field = Wetting(2.0, (line,), ()), np.zeros_like(points)
    field[ring] = random.normal(size=(len(ring), 2)) @ plate.frame[:2]
    energies = []
    for step in (1e-6, -1e-6, 0.0):
        body.points = points + step * field
        energies.append(wetting.energy(body))
    assert float((wetting.force(body) * field).sum()) == pytest.approx(-(energies[0] - energies[1]) / 2e-6, rel=1e-6)


def stadium(half_length, radius, count):
    """Return counter-clockwise points of a stadium about (-half_length, 0) and (half_length, 0), shape (4 count, 3)."""
    angle = np.linspace(-0.5, 0.5, count, endpoint=False) * np.pi
    arc = np.column_stack((half_length + radius * np.cos(angle), radius * np.sin(angle)))
    side = np.column_stack((np.linspace(half_length, -half_length, count, endpoint=False), np.full(count, radius)))
    half = np.concatenate((arc, side))
    return np.column_stack((np.concatenate((half, -half)), np.zeros(4 * count)))


def line_over_pads(points, pads, corners=60):
    """Return a contact line and the required part of a body."""
    ring = np.arange(len(points), dtype=np.int32)
    cloud = SimpleNamespace(points=points, rings=(ring,), spacing=0.1, symmetry=(), parts=1)
    body = SimpleNamespace(points=points, plates=(Plate.horizontal(0.0),), cloud=cloud)
    return ContactLine(0, pads, MASK, points, np.full(len(pads), corners)), body


PAIR = (Pad((-1.0, 0.0), 0.5, PAD), Pad((1.0, 0.0), 0.5, PAD))


def test_a_line_around_two_pads_wets_the_mask_between_them():
    """The line is pinned at both outer pad edges and free on the mask: its sides enclose 2 x 1 with two half discs."""
    line, body = line_over_pads(stadium(1.0, equal_area_radius(0.5, 60), 31), PAIR)
    assert line.wetted_pads() == {0, 1}
    assert verdict((line,), ruptured=False) == "bridged"
    assert (line.state == PINNED).sum() == 2 * 32  # the arcs and the first vertex of each side
    assert line.cosine_area(body) == pytest.approx(np.cos(MASK) * (2.0 * 1.0 - 0.25 * np.pi), rel=1e-2)


def test_the_energy_around_two_pads_falls_along_the_force():
    points = stadium(1.0, 0.6, 30)
    line, body = line_over_pads(points, PAIR)
    assert (line.state == ON_MASK).all()
    area = 4.0 * 0.6 + np.pi * 0.36 - 2.0 * np.pi * 0.25
    assert line.cosine_area(body) == pytest.approx(np.cos(MASK) * area, rel=3e-3)
    force = line.cosine_area_gradient(body)
    field = 1e-6 * np.random.default_rng(1).normal(size=points.shape) * (1.0, 1.0, 0.0)
    areas = []
    for sign in (1.0, -1.0):
        body.points = points + sign * field
        areas.append(line.cosine_area(body))
    assert float((force * field).sum()) == pytest.approx(0.5 * (areas[0] - areas[1]), rel=1e-5)


def test_a_line_steps_onto_a_pad_that_it_comes_to_and_stops_at_its_far_edge():
    """A circular line about the left pad grows until it has crossed the right pad."""
    angle = 2.0 * np.pi * np.arange(200) / 200
    circle = np.column_stack((np.cos(angle), np.sin(angle), np.zeros(200)))
    line, body = line_over_pads(1.4 * circle - (1.0, 0, 0), PAIR)
    reached = []
    for radius in (1.4, 1.8, 2.2, 2.6):
        body.points = np.where((line.state == PINNED)[:, None], body.points, radius * circle - (1.0, 0, 0))
        line.update(body, load_of_angle(body, line, np.radians(120.0)), 1.0)
        reached.append((line.wetted_pads(), int(line.state[0])))
    assert reached == [(set(), ON_MASK), ({1}, ON_PAD), ({1}, ON_PAD), ({1}, PINNED)]
    assert body.points[0] == pytest.approx((1.0 + line.edges[1], 0.0, 0.0))


def test_friction_holds_a_line_or_opposes_its_motion():
    """Pinned vertices are released beyond the limit, reversing vertices are pinned, and friction dissipates energy."""
    body = Body.at_rest(box_cloud(1.0, 5))
    ring = body.cloud.rings[0]
    line = FrictionLine(0, np.radians(60.0), np.radians(120.0), body.points[ring])
    across, zero = line._area_gradient(body), np.zeros_like(body.points)
    needed = zero.copy()
    needed[ring] = np.resize([0.4, -0.4, 0.6, -0.6], len(ring))[:, None] * across
    assert not line.update_states(body, zero, needed, releases=False)
    assert line.update_states(body, zero, needed, releases=True)
    assert np.array_equal(line.state, np.resize([PINNED, PINNED, RECEDING, ADVANCING], len(ring)))
    inward, outward = -np.resize([0.0, 0.0, 1.0, -1.0], len(ring)), zero.copy()
    outward[ring] = inward[:, None] * across
    assert (line.friction(body) * outward[ring]).sum() < 0.0
    assert not line.update_states(body, outward, needed, releases=False)
    assert line.update_states(body, -outward, needed, releases=False)
    assert (line.state == PINNED).all()
