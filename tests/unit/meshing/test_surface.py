import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM
from reflowshock.cases.hard.trials.surfaces import barrel, truncated_sphere
from reflowshock.meshing.surface.closed_surface import (
    BOARD_PAD,
    FREE,
    PACKAGE_PAD,
    SurfaceError,
    close_surface,
    enclosed_volume,
    measure,
    read_surface,
    write_surface,
)


@pytest.fixture
def arrays():
    """Return points, triangles and rings of a truncated sphere."""
    return truncated_sphere(0.3 * MM, 0.15 * MM, 24, 9)[0]


def test_every_edge_has_two_triangles(arrays):
    surface = close_surface(*arrays)
    edges = np.sort(np.vstack([surface.triangles[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert [np.sum(surface.boundary == label) for label in (FREE, BOARD_PAD, PACKAGE_PAD)] == [2 * 24 * 8, 24, 24]


def test_particles_inside_and_the_direction_of_rings_do_not_matter(arrays):
    points, triangles, lower, upper = arrays
    with_inside = np.vstack([points, np.zeros((5, 3))])
    surface = close_surface(with_inside, triangles, lower[::-1], upper[::-1])
    assert len(surface.points) == len(points) + 2
    assert enclosed_volume(surface) == pytest.approx(enclosed_volume(close_surface(*arrays)))


def test_tilted_joint_has_the_volume_of_the_straight_one():
    straight, tilted = (enclosed_volume(barrel(0.3 * MM, 0.05 * MM, offset=shift)) for shift in (0.0, 0.1 * MM))
    assert tilted == pytest.approx(straight)


def test_contact_angle_of_an_hourglass_is_sharp():
    # The parabola r(z) = r0 - 4 b s (1 - s), s = z / gap, leaves the pad with slope -4 b / gap.
    measured = measure(barrel(0.3 * MM, -0.05 * MM))
    assert measured["contact_angle_board"] == pytest.approx(np.pi / 2 - np.arctan(4 * 0.05 / 0.3), rel=0.01)
    assert measured["max_width"] == pytest.approx(0.48 * MM, rel=0.01)


def test_file_keeps_surface_and_labels(tmp_path, arrays):
    surface = close_surface(*arrays)
    write_surface(tmp_path / "s.vtu", surface)
    again = read_surface(tmp_path / "s.vtu")
    assert np.array_equal(again.points, surface.points)
    assert np.array_equal(again.triangles, surface.triangles)
    assert np.array_equal(again.boundary, surface.boundary)


def test_stereolithography_file_holds_the_triangles(tmp_path, arrays):
    import meshio

    surface = close_surface(*arrays)
    write_surface(tmp_path / "s.stl", surface)
    assert len(meshio.read(tmp_path / "s.stl").cells_dict["triangle"]) == len(surface.triangles)


def test_torn_surface_is_refused(arrays):
    points, triangles, lower, upper = arrays
    with pytest.raises(SurfaceError, match="not watertight"):
        close_surface(points, triangles[1:], lower, upper)


def test_inward_surface_is_refused(arrays):
    points, triangles, lower, upper = arrays
    with pytest.raises(SurfaceError, match="not watertight"):  # its edges run against those of the discs
        close_surface(points, triangles[:, ::-1], lower, upper)


def test_degenerate_triangle_is_refused(arrays):
    points, triangles, lower, upper = arrays
    points[30] = points[31]
    with pytest.raises(SurfaceError, match="degenerate"):
        close_surface(points, triangles, lower, upper)


def test_contact_line_that_folds_over_is_refused(arrays):
    points, triangles, lower, upper = arrays
    points[lower[0], :2] = 0.6 * points[lower[12], :2]
    with pytest.raises(SurfaceError, match="contact line crosses itself"):
        close_surface(points, triangles, lower, upper)
