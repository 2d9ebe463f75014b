import numpy as np
import pytest

from reflowshock.particles.core.cloud import box_cloud, joint_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.surface_measure import enclosed_volume, surface_area
from reflowshock.particles.surface.surface_quality import flip_to_delaunay, smoothing_offsets, vertex_normals


def opposite_angle_sums(points, triangles):
    """Return the sum of the two angles opposite each inner edge, by NumPy."""
    sums = {}
    for triangle in triangles:
        for k in range(3):
            apex, i, j = (triangle[(k + m) % 3] for m in range(3))
            u, v = points[i] - points[apex], points[j] - points[apex]
            angle = np.arccos(u @ v / np.linalg.norm(u) / np.linalg.norm(v))
            sums.setdefault(frozenset((i, j)), []).append(angle)
    return [sum(angles) for angles in sums.values() if len(angles) == 2]


def test_flips_make_a_plane_delaunay_and_keep_its_area():
    cloud = box_cloud(1.0, 8)
    points = cloud.points.copy()
    top = (points[:, 2] == 1.0) & (np.abs(points[:, :2]) < 0.49).all(axis=1)
    points[top, :2] += np.random.default_rng(10).uniform(-0.045, 0.045, (top.sum(), 2))
    triangles, flips = flip_to_delaunay(points, cloud.triangles, cloud.rings)
    assert flips > 0
    assert max(opposite_angle_sums(points, triangles)) < np.pi + 0.011
    assert surface_area(points, triangles) == pytest.approx(5.0)
    assert enclosed_volume(points, triangles, cloud.rings, cloud.plates) == pytest.approx(1.0)


def test_a_delaunay_surface_is_left_alone():
    cloud = joint_cloud(JointGeometry(1.0, 0.8, 0.8), 2.2, 0.2)
    triangles, flips = flip_to_delaunay(cloud.points, cloud.triangles, cloud.rings)
    assert flips == 0
    assert (triangles == cloud.triangles).all()


def test_flips_equalise_vertex_valences_of_squares():
    """Vertices alternate between eight and four Delaunay triangles; a second pass flips none."""
    cloud = box_cloud(1.0, 8)
    count = cloud.surface_count
    top = np.flatnonzero((cloud.points[:, 2] == 1.0) & (np.abs(cloud.points[:, :2]) < 0.3).all(axis=1))
    assert set(np.bincount(cloud.triangles.ravel(), minlength=count)[top]) == {4, 8}
    triangles, flips = flip_to_delaunay(cloud.points, cloud.triangles, cloud.rings, worth=0.1)
    assert flips > 0
    assert np.abs(np.bincount(triangles.ravel(), minlength=count)[top] - 6).max() <= 1
    assert max(opposite_angle_sums(cloud.points, triangles)) < np.pi + 0.3
    assert flip_to_delaunay(cloud.points, triangles, cloud.rings, worth=0.1)[1] == 0


def test_flips_of_one_pass_do_not_double_an_edge():
    """Both edges along a narrow finger would flip to the same edge, which would make the tip a flat flap."""
    points = np.array([[0.0, 0, 0], [1, 0, 0.1], [0.3, 0.1, 0], [1, 0, -0.1], [0.3, -0.1, 0], [2, 0, 0]])
    sides = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1], [5, 2, 1], [5, 3, 2], [5, 4, 3], [5, 1, 4]]
    triangles, flips = flip_to_delaunay(points, np.array(sides, np.int32), ())
    assert flips > 0
    assert np.bincount(triangles.ravel()).min() >= 3


def test_smoothing_is_tangential_and_vanishes_on_an_even_grid():
    cloud = box_cloud(1.0, 8)
    offset = smoothing_offsets(cloud.points, cloud.triangles, cloud.surface_count, cloud.rings)
    inner_top = (cloud.points[:, 2] == 1.0) & (np.abs(cloud.points[:, :2]) < 0.3).all(axis=1)
    assert np.abs(offset[inner_top[: len(offset)]]).max() < 0.15 * cloud.spacing
    normal = vertex_normals(cloud.points, cloud.triangles, cloud.surface_count)
    off_line = cloud.wall[: cloud.surface_count] < 0
    assert (offset * normal).sum(axis=1)[off_line] == pytest.approx(0.0, abs=1e-15)


def test_smoothing_equals_numpy_twin():
    cloud = box_cloud(1.0, 6)
    points = cloud.points + 0.02 * np.random.default_rng(15).normal(size=cloud.points.shape)
    count = cloud.surface_count
    corner = points[cloud.triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(normal, axis=1)
    offset = smoothing_offsets(points, cloud.triangles, count, cloud.rings)
    for vertex in np.setdiff1d(np.arange(count), cloud.rings[0]):
        incident = (cloud.triangles == vertex).any(axis=1)
        mean = area[incident] @ corner[incident].mean(axis=1) / area[incident].sum() - points[vertex]
        n = normal[incident].sum(axis=0)
        n /= np.linalg.norm(n)
        assert offset[vertex] == pytest.approx(0.3 * (mean - (mean @ n) * n), abs=1e-14)


def test_smoothing_evens_out_a_contact_line_along_itself():
    cloud = joint_cloud(JointGeometry(1.0, 0.8, 0.8), 2.2, 0.2)
    points, ring = cloud.points.copy(), cloud.rings[0]
    vertex = ring[3]
    turn = 0.3 * (points[ring[4]] - points[vertex])
    points[vertex] += turn
    offset = smoothing_offsets(points, cloud.triangles, cloud.surface_count, cloud.rings)[vertex]
    assert offset @ turn < 0.0
    assert offset[2] == 0.0
