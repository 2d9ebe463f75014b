"""Distances to a surface in a narrow band against VTK, including slivers and folds."""

import numpy as np
import pyvista

from reflowshock.particles.core.grid import Grid
from reflowshock.particles.surface.level_set import signed_distance, signed_distance_in_band


def test_a_band_about_a_rough_surface_has_its_distances():
    ball = pyvista.Icosphere(radius=1.0, nsub=2)
    points, triangles = np.array(ball.points, dtype=float), ball.faces.reshape(-1, 4)[:, 1:].astype(np.int32)
    points = points * [1.0, 1.0, 0.6] + 0.1 * np.random.default_rng(0).normal(size=points.shape)
    triangles = np.append(triangles, triangles[:1, [0, 1, 1]], axis=0)  # edges only
    grid = Grid.around(points, 0.11)
    everywhere = signed_distance(points, triangles[:-1], grid).values
    for band in (0.05, 0.4, 10.0):
        near = signed_distance_in_band(points, triangles, grid, band).values
        assert np.abs(near - np.clip(everywhere, -band, band)).max() < 1e-14


def test_a_triangle_as_thin_as_rounding_is_its_edges():
    """Its normal is dominated by round-off, which would give wrong plane distances and projections."""
    rng = np.random.default_rng(1)
    for height in np.repeat([1e-12, 1e-15, 0.0], 30):
        start, along = rng.uniform(0.3, 0.6, 3), rng.normal(size=3)
        along /= np.linalg.norm(along)
        points = start + np.outer([0.0, 1.0, rng.uniform()], along)
        points[2, 0] += height
        grid = Grid.around(points, 0.11)
        near = signed_distance_in_band(points, np.array([[0, 1, 2]], np.int32), grid, 0.4).values
        places = np.stack(np.meshgrid(*grid.axes(), indexing="ij"), axis=-1) - start
        foot = np.clip(places @ along, 0.0, 1.0)[..., None] * along
        exact = np.minimum(np.linalg.norm(places - foot, axis=-1), 0.4)
        assert np.abs(np.abs(near) - exact).max() < 1e-8
