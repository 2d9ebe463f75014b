import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reflowshock.cases.hard.trials.surfaces import revolve
from reflowshock.meshing.core.facets import cut_segments, radius_by_angle, section_area, section_centroid
from reflowshock.meshing.joint.butterfly import butterfly


@pytest.mark.parametrize("height", [0.4e-3, 0.5e-3])  # between vertices, and exactly at a level of them
def test_section_of_a_slanted_cylinder_is_its_polygon(height):
    points, triangles, *_ = revolve(np.full(9, 1e-3), 1e-3, around=24, offset=0.2e-3)
    segments = cut_segments(points, triangles, height)
    assert section_area(segments) == pytest.approx(0.5 * 24 * 1e-6 * np.sin(2 * np.pi / 24), rel=1e-12)
    assert section_centroid(segments) == pytest.approx([0.2 * height, 0.0], abs=1e-15)
    radii = radius_by_angle(segments, section_centroid(segments), 2 * np.pi * np.arange(24) / 24)
    assert radii == pytest.approx(1e-3, rel=1e-6)


@settings(max_examples=20, deadline=None)
@given(st.integers(3, 12), st.floats(0.0, 0.3), st.floats(0.0, 6.28))
def test_radius_of_a_wavy_section(waves, depth, phase):
    angles = 2.0 * np.pi * np.arange(360) / 360
    radii = 1.0 + depth * np.cos(waves * angles + phase)
    outline = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    segments = np.stack([outline, np.roll(outline, -1, axis=0)], axis=1)
    assert section_area(segments) == pytest.approx(np.pi * (1.0 + 0.5 * depth**2), rel=1e-3)
    assert radius_by_angle(segments, np.zeros(2), angles[::7]) == pytest.approx(radii[::7], rel=1e-9)


def test_ray_that_meets_the_outline_thrice_is_refused():
    outline = np.array([[1, -1], [1, 1], [-1, 1], [-1, 0.5], [0.5, 0.2], [0.5, -0.2], [-1, -0.5], [-1, -1]], float)
    segments = np.stack([outline, np.roll(outline, -1, axis=0)], axis=1)
    with pytest.raises(ValueError, match="not star-shaped"):
        radius_by_angle(segments, section_centroid(segments), np.linspace(0.0, 6.0, 12))


@pytest.mark.parametrize(("core", "rings"), [(1, 1), (2, 1), (3, 2), (8, 4)])
def test_butterfly_tiles_its_polygon(core, rings):
    section = butterfly(core, rings)
    corners = section.points[section.quads]
    edges = np.roll(corners, -1, axis=1) - corners
    before = -np.roll(edges, 1, axis=1)
    sines = edges[..., 0] * before[..., 1] - edges[..., 1] * before[..., 0]
    assert len(section.quads) == core**2 + 4 * core * rings
    assert (sines / np.linalg.norm(edges, axis=2) / np.linalg.norm(before, axis=2)).min() > 0.4
    areas = 0.5 * np.sum(corners[:, :, 0] * np.roll(corners[:, :, 1], -1, axis=1), axis=1)
    areas -= 0.5 * np.sum(corners[:, :, 1] * np.roll(corners[:, :, 0], -1, axis=1), axis=1)
    assert areas.sum() == pytest.approx(2.0 * core * np.sin(2.0 * np.pi / (4 * core)))
    assert np.linalg.norm(section.points[section.rim], axis=1) == pytest.approx(1.0)
