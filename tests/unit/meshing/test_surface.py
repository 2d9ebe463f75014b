"""Closed surfaces against bodies whose volume, width and angle are exact."""

import numpy as np
import pytest

from meshing.section import cut_segments, radius_by_angle, section_area, section_centroid
from meshing.surface import close_surface, measure, read_surface, write_surface
from tests.support.joint_surfaces import revolve


def truncated_sphere(around: int, levels: int):
    """Sphere of radius 0.3 mm between planes 0.15 mm from its centre; exact volume, width, contact radius, angle."""
    radius, half = 0.3e-3, 0.15e-3
    heights = np.linspace(-half, half, levels)
    exact = {
        "volume": 2 * np.pi * (radius**2 * half - half**3 / 3),
        "max_width": 2 * radius,
        "contact_radius_board": np.sqrt(radius**2 - half**2),
        "contact_angle_board": np.pi / 2 + np.arcsin(half / radius),
        "contact_angle_package": np.pi / 2 + np.arcsin(half / radius),
    }
    return revolve(np.sqrt(radius**2 - heights**2), 2 * half, around), exact


def test_measures_converge_to_the_sphere():
    errors = []
    for refinement in (1, 2, 4):
        surface_arrays, exact = truncated_sphere(24 * refinement, 12 * refinement + 1)
        measured = measure(close_surface(*surface_arrays))
        errors.append([abs(measured[name] / exact[name] - 1) for name in exact])
    orders = np.log2(np.array(errors[0]) / np.array(errors[2])) / 2
    assert orders[:3] == pytest.approx(2.0, abs=0.35)  # volume, width, radius
    assert (orders[3:] > 0.8).all()  # angle: slope of one triangle
    assert max(errors[2]) < 0.02


def test_section_of_a_cylinder_is_its_polygon():
    points, triangles, *_ = revolve(np.full(9, 1e-3), 1e-3, around=24, offset=0.2e-3)
    segments = cut_segments(points, triangles, 0.4e-3)
    assert section_area(segments) == pytest.approx(0.5 * 24 * 1e-6 * np.sin(2 * np.pi / 24), rel=1e-12)
    assert section_centroid(segments) == pytest.approx([0.08e-3, 0.0], abs=1e-15)
    radii = radius_by_angle(segments, section_centroid(segments), 2 * np.pi * np.arange(24) / 24)
    assert radii == pytest.approx(1e-3, rel=1e-6)


def test_file_keeps_surface_and_labels(tmp_path):
    surface = close_surface(*truncated_sphere(24, 9)[0])
    write_surface(tmp_path / "s.vtu", surface)
    again = read_surface(tmp_path / "s.vtu")
    assert np.array_equal(again.points, surface.points)
    assert np.array_equal(again.triangles, surface.triangles)
    assert np.array_equal(again.boundary, surface.boundary)


def test_torn_surface_is_refused():
    points, triangles, lower, upper = truncated_sphere(24, 9)[0]
    with pytest.raises(ValueError, match="not watertight"):
        close_surface(points, triangles[1:], lower, upper)


def test_inward_surface_is_refused():
    points, triangles, lower, upper = truncated_sphere(24, 9)[0]
    with pytest.raises(ValueError, match=r"not watertight|inwards"):
        close_surface(points, triangles[:, ::-1], lower, upper)


def test_degenerate_triangle_is_refused():
    points, triangles, lower, upper = truncated_sphere(24, 9)[0]
    points[30] = points[31]
    with pytest.raises(ValueError, match="degenerate"):
        close_surface(points, triangles, lower, upper)
