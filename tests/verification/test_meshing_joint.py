"""Measures and meshes of truncated spheres converge at second order to the exact body."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.surfaces import truncated_sphere
from reflowshock.meshing.board.parameters import JointNumerics
from reflowshock.meshing.core.hexahedra import volumes
from reflowshock.meshing.joint.butterfly import butterfly
from reflowshock.meshing.joint.swept import layer_cells, solder_levels
from reflowshock.meshing.surface.closed_surface import close_surface, enclosed_volume, measure

RADIUS, HALF_GAP = 0.3e-3, 0.15e-3


def test_measures_converge_to_the_sphere():
    errors = []
    for refinement in (1, 2, 4):
        arrays, exact = truncated_sphere(RADIUS, HALF_GAP, 24 * refinement, 12 * refinement + 1)
        measured = measure(close_surface(*arrays))
        errors.append([abs(measured[name] / exact[name] - 1.0) for name in exact])
    orders = 0.5 * np.log2(np.array(errors[0]) / np.array(errors[2]))
    assert orders[:4] == pytest.approx(2.0, abs=0.2)  # volume, width, contact radii
    assert orders[4:].min() > 1.4  # contact angles
    assert max(errors[2]) < 2e-3


def test_correction_of_the_sections_vanishes_at_second_order():
    """Chords over n layers remove 2 pi h^2 H / 12 of the volume of a sphere, h = H / n."""
    surface = close_surface(*truncated_sphere(RADIUS, HALF_GAP, 192, 97)[0])
    section = butterfly(4, 2)
    corrections = [
        solder_levels(surface, section, JointNumerics(layers=layers), np.asarray).scale - 1.0 for layers in (4, 8, 16)
    ]
    assert np.log2(corrections[0] / corrections[1]) == pytest.approx(2.0, abs=0.2)
    assert np.log2(corrections[1] / corrections[2]) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("layers", [3, 6, 12])
def test_volume_and_end_areas_are_exact_at_any_resolution(layers):
    surface = close_surface(*truncated_sphere(RADIUS, HALF_GAP, 48, 25)[0])
    section = butterfly(2, 1)
    levels = solder_levels(surface, section, JointNumerics(layers=layers), np.asarray).points
    cells = layer_cells(section.quads, levels.shape[1], layers)
    assert volumes(levels.reshape(-1, 3), cells).sum() == pytest.approx(enclosed_volume(surface), rel=1e-12)
    x, y = levels[0, section.rim, 0], levels[0, section.rim, 1]
    area = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    assert area == pytest.approx(np.pi * measure(surface)["contact_radius_board"] ** 2, rel=1e-6)


def test_width_of_the_mesh_equals_the_sphere():
    """With an even number of layers the equator is a mesh level whose octagon has the area of the circle."""
    surface = close_surface(*truncated_sphere(RADIUS, HALF_GAP, 96, 49)[0])
    section = butterfly(2, 1)
    middle = solder_levels(surface, section, JointNumerics(layers=6), np.asarray).points[3]
    x, y = middle[section.rim, 0], middle[section.rim, 1]
    area = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    assert 2.0 * np.sqrt(area / np.pi) == pytest.approx(2.0 * RADIUS, rel=5e-3)
