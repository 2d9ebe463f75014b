from itertools import permutations

import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud, joint_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.grid import Grid
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.scenes.rebuild import CannotRebuild, closed_surface, collapsing, rebuild, touch
from reflowshock.particles.surface.cloud_level_set import boundary_loops, cloud_from_level_set
from reflowshock.particles.surface.level_set import (
    LevelSet,
    extract_surface,
    measure_depths,
    signed_distance,
    smooth_on_level_set,
    smooth_union,
    winding_numbers_on,
)
from reflowshock.particles.surface.morphological_closing import smooth_slits
from tests.support.level_sets import ball, cap_radius, grid_around_ball

R = 0.5e-3
SPHERE = 4.0 / 3.0 * np.pi * R**3


def sphere_body(spacing, centre=(0.0, 0.0, 0.0)):
    """Return a ball of particles about a centre, from its spacing."""
    cloud = cloud_from_level_set(ball(grid_around_ball((0, 0, 0), R, spacing), (0, 0, 0), R), SPHERE, ())
    body = Body.at_rest(cloud)
    body.points += np.asarray(centre)
    return body


def quality(points, triangles):
    """Return the quality of triangles, 1 if equilateral, shape (t,)."""
    corner = points[triangles]
    edges = corner - np.roll(corner, 1, axis=1)
    area = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return 4.0 * np.sqrt(3.0) * area / (edges**2).sum(axis=(1, 2))


@pytest.mark.parametrize("centre", [(0, 0, 0), (0.31e-4, -0.17e-4, 0.23e-4)])
def test_the_net_of_a_sphere_is_closed_even_and_near(centre):
    spacing = 0.2 * R
    level = ball(grid_around_ball(centre, R, spacing), centre, R)
    points, triangles = smooth_on_level_set(level, *extract_surface(level), ())
    assert boundary_loops(triangles) == ()
    assert len(points) - len(triangles) // 2 == 2  # Euler's formula for a sphere
    assert np.abs(np.linalg.norm(points - centre, axis=1) / R - 1.0).max() < 5e-3
    assert quality(points, triangles).min() > 0.6


def test_the_net_converges_with_order_two():
    errors = []
    for spacing in (R / 4, R / 8):
        level = ball(grid_around_ball((0, 0, 0), R, spacing), (0, 0, 0), R)
        points, triangles = smooth_on_level_set(level, *extract_surface(level), ())
        errors.append(
            1.0
            - np.einsum("ij,ij", points[triangles[:, 0]], np.cross(*points[triangles[:, 1:]].swapaxes(0, 1)))
            / 6
            / SPHERE
        )
    assert np.log2(errors[0] / errors[1]) > 1.8


def test_signed_distance_of_a_net_is_that_of_the_sphere():
    spacing = R / 8
    grid = grid_around_ball((0, 0, 0), R, spacing)
    exact = ball(grid, (0, 0, 0), R)
    points, triangles = smooth_on_level_set(exact, *extract_surface(exact), ())
    assert np.abs(signed_distance(points, triangles, grid).values - exact.values).max() < 0.1 * spacing


@pytest.mark.long
def test_inside_is_what_a_surface_winds_round_where_its_sheets_have_crossed():
    """In the overlap of two balls of one surface the nearest sheet has the wrong orientation."""
    points, triangles = extract_surface(ball(grid_around_ball((0, 0, 0), R, R / 8), (0, 0, 0), R))
    aside = np.array([0.8 * R, 0.0, 0.0])
    both = np.concatenate((points - aside, points + aside)), np.concatenate((triangles, triangles + len(points)))
    grid = Grid.around(both[0], R / 7)
    level = signed_distance(*both, grid)
    nodes = np.stack(np.meshgrid(*grid.axes(), indexing="ij"), axis=-1).reshape(-1, 3)
    exact = np.minimum(*(np.linalg.norm(nodes - centre, axis=1) - R for centre in (-aside, aside)))
    clear = np.abs(exact) > 0.05 * R
    assert np.array_equal(level.values.ravel()[clear] < 0.0, exact[clear] < 0.0)
    assert np.array_equal(measure_depths(nodes[clear], *both) > 0.0, exact[clear] < 0.0)


def test_windings_hold_below_vertices_and_edges_however_they_are_numbered():
    """In an octahedron all upper triangles meet above the centre, and edges lie above the axes."""
    corners = np.concatenate((np.eye(3), -np.eye(3)))
    sides = np.array([[x, y, z] for x in (0, 3) for y in (1, 4) for z in (2, 5)], np.int32)
    inward = np.linalg.det(corners[sides]) < 0.0
    sides[inward] = sides[inward][:, ::-1]
    grid = Grid(np.full(3, -1.5), 0.5, (7, 7, 7))
    nodes = np.stack(np.meshgrid(*grid.axes(), indexing="ij"), axis=-1)
    distance = np.abs(nodes).sum(axis=-1) - 1.0
    clear = distance != 0.0
    for order in permutations(range(6)):
        permutation = np.array(order, np.int32)
        surface = corners[permutation], np.argsort(permutation).astype(np.int32)[sides]
        assert np.array_equal(winding_numbers_on(grid, *surface)[clear], (distance < 0.0)[clear])
        assert np.array_equal(measure_depths(nodes[clear], *surface) > 0.0, distance[clear] < 0.0)


def test_smooth_union_closes_gaps_narrower_than_half_its_reach():
    spacing, reach = 0.1 * R, 0.2 * R
    for gap, connected in ((0.4 * reach, True), (0.6 * reach, False)):
        x = R + 0.5 * gap
        grid = Grid.around(np.array([[-x - R, -R, -R], [x + R, R, R]]), spacing)
        union = smooth_union([ball(grid, (s * x, 0, 0), R) for s in (-1, 1)], reach)
        assert (union.at(np.zeros((1, 3)))[0] < 0.0) == connected


def test_a_rebuilt_drop_on_a_wall_has_one_ring_and_its_volume():
    angle, volume = np.radians(60.0), 1e-9
    radius = cap_radius(volume, angle)
    centre = (0, 0, -radius * np.cos(angle))
    grid = Grid.around(np.array([[-radius] * 3, [radius] * 3]), 0.1 * radius)
    cloud = cloud_from_level_set(ball(grid, centre, radius, mirrored=True), volume, (Plate.horizontal(0.0),))
    body = Body.at_rest(cloud)
    assert body.volume()[0] == pytest.approx(volume, rel=1e-9)
    assert len(cloud.rings) == 1
    ring = cloud.points[cloud.rings[0]]
    assert np.all(ring[:, 2] == 0.0)
    x, y = ring[:, 0], ring[:, 1]
    assert (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 0.0  # counter-clockwise
    # the surface rounds the edge between drop and mirror image within a cell
    assert np.hypot(x, y) == pytest.approx(radius * np.sin(angle), rel=0.03)
    assert cloud.points[:, 2].min() == 0.0
    assert (cloud.wall[cloud.surface_count :] == 0).any()


def test_contact_lines_that_meet_in_a_point_are_an_error():
    bow = np.array([[0, 1, 2], [0, 3, 4]], np.int32)
    with pytest.raises(CannotRebuild, match="meet in a point"):
        boundary_loops(bow)


def test_a_mirrored_drop_closes():
    body = Body.at_rest(box_cloud(1e-3, 5))
    points, triangles = closed_surface(body)
    assert boundary_loops(triangles) == ()
    inside = signed_distance(points, triangles, Grid.around(points, 2e-4)).at(np.array([[0.0, 0.0, 1e-5]]))
    assert inside[0] < 0.0


def test_touching_needs_a_spacing():
    spacing = 0.2 * R
    first = sphere_body(spacing)
    assert touch(first, sphere_body(spacing, (2.0 * R + 0.5 * spacing, 0, 0)))
    assert not touch(first, sphere_body(spacing, (2.0 * R + 1.5 * spacing, 0, 0)))


def test_merging_keeps_volume_and_momentum():
    spacing = 0.2 * R
    first, second = sphere_body(spacing), sphere_body(spacing, (2.0 * R + 0.5 * spacing, 0, 0))
    first.velocity[:] = (0.3, 0.1, 0.0)
    second.velocity[:] = (-0.2, 0.0, 0.05)
    body = rebuild(first, second)
    assert body.volume()[0] == pytest.approx(2.0 * SPHERE, rel=1e-9)
    momentum = (body.volumes[:, None] * body.velocity).sum(axis=0)
    assert momentum == pytest.approx(SPHERE * np.array([0.1, 0.1, 0.05]), rel=1e-9)
    assert len(body.points) > body.cloud.surface_count
    assert boundary_loops(body.triangles) == ()


def test_bodies_that_cannot_rebuild():
    tilted = JointGeometry(0.3e-3, 0.24e-3, 0.24e-3, tilt=(0.02, 0.0))
    joint = Body.at_rest(joint_cloud(tilted, 0.07e-9, 0.8e-4))
    with pytest.raises(CannotRebuild, match="horizontal walls"):
        rebuild(joint, joint)
    with pytest.raises(CannotRebuild, match="only free bodies, or bodies on the same walls"):
        rebuild(sphere_body(0.2 * R), Body.at_rest(box_cloud(1e-3, 5)))


def test_a_groove_narrower_than_a_cell_is_blunted_and_a_smooth_net_stays():
    """Two bars touch along an edge, and both surfaces share the vertices of its cells."""
    grid = Grid.around(np.array([[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]]), 0.1)
    x, y, z = np.meshgrid(*grid.axes(), indexing="ij")
    x, y = x - 0.03, y - 0.03
    bars = -np.sign(x * y) * np.minimum(np.abs(x), np.abs(y))
    grooved = LevelSet(grid, np.maximum(bars, np.max([np.abs(x), np.abs(y), np.abs(z)], axis=0) - 0.4))

    def most(level):
        edges = np.sort(np.concatenate([extract_surface(level)[1][:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
        return np.unique(edges, axis=0, return_counts=True)[1].max()

    assert most(grooved) > 2
    assert most(smooth_slits(grooved)) == 2
    smooth = ball(grid, (0, 0, 0), 0.4)
    assert smooth_slits(smooth) is smooth


def test_a_collapsed_surface_is_made_even_again():
    body = sphere_body(0.2 * R)
    top = int(body.points[: body.cloud.surface_count, 2].argmax())
    neighbour = int(np.setdiff1d(body.triangles[(body.triangles == top).any(axis=1)], [top])[0])
    assert not collapsing(body)
    body.points[neighbour] += 0.9 * (body.points[top] - body.points[neighbour])
    assert collapsing(body)
    volume = body.volume()[0]
    body = rebuild(body)
    assert not collapsing(body)
    assert body.volume()[0] == pytest.approx(volume, rel=1e-9)
