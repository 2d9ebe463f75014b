import numpy as np
import pytest
from scipy.spatial import Delaunay

from reflowshock.meshing.core.hexahedra import boundary_quads, quad_areas, scaled_jacobian, volumes
from reflowshock.meshing.core.quadratic_tetrahedra import curved_volume, least_jacobian, quadratic_tetrahedra
from reflowshock.meshing.core.split_tetrahedra import split_tetrahedra

REGULAR = np.array([[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]])


@pytest.fixture(scope="module")
def cloud():
    """Tetrahedra of a box with points inside, positively oriented, and their surface."""
    generator = np.random.default_rng(3)
    corners = np.array(np.meshgrid([0.0, 1.0], [0.0, 2.0], [0.0, 3.0])).reshape(3, -1).T
    points = np.vstack([corners, generator.uniform(0.1, 0.9, (40, 3)) * [1.0, 2.0, 3.0]])
    cells = Delaunay(points).simplices
    signed = np.linalg.det(points[cells[:, 1:]] - points[cells[:, :1]])
    cells = np.where((signed > 0.0)[:, None], cells, cells[:, [1, 0, 2, 3]])
    faces = np.vstack([cells[:, [1, 2, 3]], cells[:, [0, 3, 2]], cells[:, [0, 1, 3]], cells[:, [0, 2, 1]]])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return points, cells, faces[first[count == 1]]


def test_hexahedra_of_a_regular_tetrahedron_are_alike_and_well_shaped():
    split = split_tetrahedra(REGULAR, np.array([[0, 1, 2, 3]]))
    assert volumes(split.points, split.cells) == pytest.approx(8.0 / 3.0 / 4.0)
    assert scaled_jacobian(split.points, split.cells) == pytest.approx(0.5, abs=0.25)
    assert np.ptp(scaled_jacobian(split.points, split.cells)) < 1e-12


def test_hexahedra_fill_the_tetrahedra_and_share_their_faces(cloud):
    points, cells, surface = cloud
    split = split_tetrahedra(points, cells)
    hexahedron_volumes = volumes(split.points, split.cells).reshape(-1, 4).sum(axis=1)
    assert hexahedron_volumes == pytest.approx(np.linalg.det(points[cells[:, 1:]] - points[cells[:, :1]]) / 6.0)
    quads = boundary_quads(split.cells)
    assert quad_areas(split.points, quads).sum() == pytest.approx(22.0)
    surface_quads = split.quads_of(surface)
    assert {tuple(sorted(quad)) for quad in surface_quads.tolist()} == {tuple(sorted(quad)) for quad in quads.tolist()}


def test_faces_keep_the_direction_of_their_triangles(cloud):
    points, cells, surface = cloud
    split = split_tetrahedra(points, cells)
    corners = split.points[split.quads_of(surface)]
    outward = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    away = corners.mean(axis=1) - [0.5, 1.0, 1.5]
    assert np.einsum("qi,qi->q", outward, away).min() > 0.0


def test_curved_tetrahedra_have_the_volume_of_the_straight_ones_and_more_where_they_bulge(cloud):
    points, cells, surface = cloud
    split = split_tetrahedra(points, cells)
    straight = quadratic_tetrahedra(split, split.points, cells, {"all": surface})
    assert curved_volume(straight.points, straight.cells) == pytest.approx(6.0)
    bulged = split.points.copy()
    middle = split.middles(surface[:, :2])
    bulged[middle] = [0.5, 1.0, 1.5] + 1.02 * (bulged[middle] - [0.5, 1.0, 1.5])
    curved = quadratic_tetrahedra(split, bulged, cells, {"all": surface})
    assert curved_volume(curved.points, curved.cells) > 6.0


def test_a_tetrahedron_that_would_fold_is_straight_where_it_is_bent():
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, 0.1]])
    split = split_tetrahedra(points, np.array([[0, 1, 2, 3]]))
    bent = split.points.copy()
    base = split.middles(np.array([[[0, 1], [1, 2], [2, 0]]])).ravel()
    for lift, folds in ((-0.1, False), (0.3, True)):
        bent[base, 2] = lift
        mesh = quadratic_tetrahedra(split, bent, np.array([[0, 1, 2, 3]]), {"base": np.array([[0, 2, 1]])})
        assert least_jacobian(mesh.points, mesh.cells).min() > 0.05
        assert (np.abs(mesh.points[base, 2]).max() < 1e-15) == folds
    straight = quadratic_tetrahedra(split, split.points, np.array([[0, 1, 2, 3]]), {"base": np.array([[0, 2, 1]])})
    assert least_jacobian(straight.points, straight.cells) == pytest.approx([1.0])
