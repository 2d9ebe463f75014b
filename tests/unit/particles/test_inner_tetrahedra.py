"""Tetrahedra bounded by the tracked surface, and velocities of shifted particles."""

import numpy as np
import pytest

from reflowshock.particles.core import winding_numbers
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud, joint_cloud, sphere_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.surface_measure import wall_corners
from reflowshock.particles.core.tetrahedra import cell_volumes, volume_gradients
from reflowshock.particles.discretisation.discretisation import LinearTetrahedra
from reflowshock.particles.discretisation.field_transfer import Transfer, interpolation_matrix
from reflowshock.particles.discretisation.inner_tetrahedra import fill_with_tetrahedra

CLOUDS = {
    "ball": lambda: sphere_cloud(1.0, 3),
    "cube": lambda: box_cloud(1.0, 5),
    "neck": lambda: joint_cloud(JointGeometry(1.0, 0.5, 0.5), 0.35, 0.12),
}


def jittered(name, amount):
    """Return a body with randomly displaced particles (amount in spacings), tangential on walls."""
    body = Body.at_rest(CLOUDS[name]())
    shift = np.random.default_rng(5).uniform(-amount, amount, body.points.shape) * body.cloud.spacing
    shift[body.cloud.wall >= 0, 2] = 0.0
    body.points = body.points + shift
    return body


@pytest.mark.parametrize("name", CLOUDS)
@pytest.mark.parametrize("amount", [0.0, 0.1, 0.3])
def test_volume_and_its_gradient_are_those_of_the_surface(name, amount):
    """This includes a non-Delaunay surface (0.3) and a neck far inside the convex hull."""
    body = jittered(name, amount)
    cells = fill_with_tetrahedra(body)
    volume, gradient = body.volume()
    assert cell_volumes(body.points, cells).sum() == pytest.approx(volume, rel=1e-12)
    result = np.zeros_like(body.points)
    np.add.at(result, cells, volume_gradients(body.points, cells))
    result[body.cloud.wall >= 0, 2] = gradient[body.cloud.wall >= 0, 2]
    assert result == pytest.approx(gradient, abs=1e-12)
    assert len(np.unique(cells)) == len(body.points)


def test_a_neck_is_not_filled_to_its_hull():
    body = jittered("neck", 0.0)
    volumes = cell_volumes(body.points, fill_with_tetrahedra(body))
    assert volumes.min() > -1e-6 * volumes.max()


def winding_number_by_numpy(point, corners):
    """Return the sum of solid angles over 4 pi."""
    a, b, c = np.moveaxis(corners - point, 1, 0)
    lengths = [np.linalg.norm(side, axis=1) for side in (a, b, c)]
    products = (a * b).sum(axis=1) * lengths[2] + (b * c).sum(axis=1) * lengths[0] + (c * a).sum(axis=1) * lengths[1]
    triple = (a * np.cross(b, c)).sum(axis=1)
    return 2.0 * np.arctan2(triple, np.prod(lengths, axis=0) + products).sum() / (4.0 * np.pi)


def test_winding_numbers_tell_inside_from_outside():
    body = jittered("neck", 0.1)
    walls = [wall_corners(body.points, *on_wall) for on_wall in zip(body.cloud.rings, body.plates, strict=True)]
    corners = np.concatenate([body.points[body.triangles], *walls])
    points = np.array([[0.0, 0.0, 0.5], [0.45, 0.0, 0.05], [0.45, 0.0, 0.5], [0.0, 0.0, -0.1]])
    result = winding_numbers.at_points(points, corners)
    assert result == pytest.approx([1.0, 1.0, 0.0, 0.0], abs=1e-9)
    assert result == pytest.approx([winding_number_by_numpy(point, corners) for point in points], abs=1e-12)


def test_linear_fields_are_transferred_exactly():
    body = jittered("cube", 0.1)
    shift = np.random.default_rng(6).uniform(-0.05, 0.05, body.points.shape) * body.cloud.spacing
    matrix = interpolation_matrix(body.points, fill_with_tetrahedra(body), shift)
    slope = np.array([[1.0, -2.0, 0.5], [0.0, 3.0, 1.0], [2.0, 1.0, -1.0]])
    assert matrix @ (body.points @ slope) == pytest.approx((body.points + shift) @ slope, abs=1e-12)
    assert matrix.sum(axis=1) == pytest.approx(1.0)


def test_a_transfer_keeps_momentum_and_raises_no_energy():
    body = jittered("ball", 0.1)
    old = LinearTetrahedra.start(body.points, fill_with_tetrahedra(body), 1.0)
    shift = np.random.default_rng(7).uniform(-0.1, 0.1, body.points.shape) * body.cloud.spacing
    shift[: body.cloud.surface_count] = 0.0
    values = interpolation_matrix(body.points, old.cells, shift)
    body.points = body.points + shift
    new = LinearTetrahedra.start(body.points, fill_with_tetrahedra(body), 1.0)
    translations = [np.broadcast_to(axis, body.points.shape) for axis in np.eye(3)]
    transfer = Transfer(values, old.mass, new.mass, translations)
    for velocity in (np.random.default_rng(8).normal(size=shift.shape), body.points[:, ::-1] + 1.0):
        moved = transfer(velocity)
        assert (new.mass @ moved).sum(axis=0) == pytest.approx((old.mass @ velocity).sum(axis=0), abs=1e-12)
        energy = (velocity * (old.mass @ velocity)).sum()
        assert (moved * (new.mass @ moved)).sum() <= energy * (1.0 + 1e-12)
    assert transfer(translations[0]) == pytest.approx(translations[0], abs=1e-12)


@pytest.mark.parametrize("count", [5, 8])
def test_flipped_edges_of_a_lattice_are_single_cells(count):
    """Surface diagonals of a cube may differ from Delaunay's: no cell is inverted, so cells do not overlap."""
    body = Body.at_rest(box_cloud(1.0, count))
    volumes = cell_volumes(body.points, fill_with_tetrahedra(body))
    assert volumes.min() >= 0.0
    assert volumes.sum() == pytest.approx(body.volume()[0], rel=1e-12)
