"""How often a surface winds round the nodes of a grid without bounds: as on an array, and where none would fit."""

import numpy as np
import pyvista

from reflowshock.particles.core.grid import Grid
from reflowshock.particles.core.winding_numbers import WindingNumbers
from reflowshock.particles.surface.breakup import are_outside
from reflowshock.particles.surface.level_set import winding_numbers_on
from reflowshock.particles.surface.surface_quality import vertex_normals

SPACING = 0.12


def ball():
    """A flat ball of radius 1."""
    sphere = pyvista.Icosphere(radius=1.0, nsub=3)
    points = np.array(sphere.points, dtype=float) * [1.0, 1.0, 0.7]
    return points, sphere.faces.reshape(-1, 4)[:, 1:].astype(np.int32)


def several(*parts):
    """One surface of several: points and triangles."""
    first = np.cumsum([0, *(len(points) for points, _ in parts)])
    return np.concatenate([points for points, _ in parts]), np.concatenate(
        [triangles + start for (_, triangles), start in zip(parts, first, strict=False)]
    )


def test_crossings_alone_tell_what_a_grid_tells():
    points, triangles = ball()
    crossed = several((points, triangles), (points + [0.7, 0.0, 0.0], triangles))
    turned = several((points, triangles), (0.3 * points + [3.0, 0.0, 0.0], triangles[:, ::-1]))
    upper = triangles[points[triangles, 2].min(axis=1) > 0.0]  # the wall below closes it
    for surface, bounds in ((ball(), (0, 1)), (crossed, (0, 2)), (turned, (-1, 1)), ((points, upper), (0, 1))):
        numbers = WindingNumbers.of(*surface, SPACING)
        counts = tuple(int(extent) for extent in np.ceil((surface[0].max(axis=0) - numbers.origin) / SPACING) + 3.0)
        grid = Grid(numbers.origin, SPACING, counts)
        nodes = np.stack(np.meshgrid(*grid.axes(), indexing="ij"), axis=-1).reshape(-1, 3)
        assert np.array_equal(numbers.at(nodes), winding_numbers_on(grid, *surface).ravel())
        assert numbers.bounds == bounds
    far = 9.0 * np.concatenate((np.eye(3), -np.eye(3), [[0.0, 1.0, -1.0]]))
    assert not WindingNumbers.of(points, triangles, SPACING).at(far).any()


def test_crossings_of_steep_triangles_are_within_them():
    """Corners in a line, but for rounding, seen from above: the crossing of a node on that line is at their heights."""
    rng, node, met = np.random.default_rng(0), 7.5 * SPACING, 0
    for _ in range(2000):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        corners_above = node + np.outer(rng.uniform(-0.8, 0.8, 3), [np.cos(angle), np.sin(angle)])
        corners = np.column_stack((corners_above, rng.uniform(5.0, 5.5, 3)))
        numbers = WindingNumbers.of(np.concatenate((np.zeros((1, 3)), corners)), np.array([[1, 2, 3]]), SPACING)
        below = numbers.shape[1] - 1 - numbers.keys % numbers.shape[1]
        assert (numbers.origin[2] + SPACING * below <= corners[:, 2].max()).all()
        assert (numbers.origin[2] + SPACING * (below + 1) >= corners[:, 2].min()).all()
        met += len(below)
    assert met > 20


def test_what_has_no_crossings_winds_round_nothing():
    points, triangles = ball()
    numbers = WindingNumbers.of(1e-3 * points, triangles[:0], SPACING)
    assert numbers.bounds == (0, 0) and numbers.at(points).tolist() == [0] * len(points)


def test_no_windings_are_found_where_no_place_is_far(monkeypatch):
    points, triangles = ball()
    monkeypatch.setattr(WindingNumbers, "of", None)
    assert are_outside(1.2 * points, points, triangles, vertex_normals(points, triangles, len(points)), SPACING).all()


def test_parts_that_are_far_apart_cost_no_more():
    points, triangles = ball()
    apart = several((points, triangles), (points + [1e5, -1e5, 1e5], triangles))
    numbers = WindingNumbers.of(*apart, SPACING)
    assert numbers.bounds == (0, 1) and len(numbers.keys) < 2 * 4 * 3.2 / SPACING**2
    assert numbers.at(np.array([[0.0, 0.0, 0.0], [1e5, -1e5, 1e5], [5e4, -5e4, 5e4]])).tolist() == [1, 1, 0]


def test_what_is_outside_is_so_however_far():
    points, triangles = ball()
    places = np.random.default_rng(0).uniform(-1.6, 1.6, (2000, 3))
    beyond = np.linalg.norm(places, axis=1) > 1.3
    outside = are_outside(places, points, triangles, vertex_normals(points, triangles, len(points)), SPACING)
    assert outside[beyond].all() and not outside[np.linalg.norm(places, axis=1) < 0.7].any()
