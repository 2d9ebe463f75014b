"""Joint surfaces that no sweep fits: two joints bridged, voids inside; and the triangulation of any level set."""

from collections.abc import Callable, Sequence

import numpy as np
from skimage.measure import marching_cubes

from reflowshock.meshing.core.facets import outlines
from reflowshock.meshing.surface.closed_surface import FREE, ClosedSurface, close_rings

Field = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def sphere(centre: Sequence[float], radius: float, rings: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Points and outward triangles of a sphere with ``rings`` circles of latitude."""
    latitude = np.pi * (np.arange(rings) + 1.0) / (rings + 1.0)
    longitude = np.pi * np.arange(2 * rings) / rings
    circles = np.stack(
        [
            np.outer(np.sin(latitude), np.cos(longitude)),
            np.outer(np.sin(latitude), np.sin(longitude)),
            np.repeat(np.cos(latitude)[:, None], 2 * rings, axis=1),
        ],
        axis=-1,
    ).reshape(-1, 3)
    points = np.vstack([circles, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
    around, after = np.arange(2 * rings), np.roll(np.arange(2 * rings), -1)
    triangles = [np.column_stack([around, after, np.full(2 * rings, len(circles))])]
    for ring in range(rings - 1):
        upper, lower = 2 * rings * ring, 2 * rings * (ring + 1)
        triangles.append(np.column_stack([upper + around, lower + around, lower + after]))
        triangles.append(np.column_stack([upper + around, lower + after, upper + after]))
    last = 2 * rings * (rings - 1)
    triangles.append(np.column_stack([last + after, last + around, np.full(2 * rings, len(circles) + 1)]))
    return np.asarray(centre) + radius * points, np.vstack(triangles)


def with_void(surface: ClosedSurface, centre: Sequence[float], radius: float) -> ClosedSurface:
    """A body with a spherical void inside."""
    points, triangles = sphere(centre, radius)
    return ClosedSurface(
        np.vstack([surface.points, points]),
        np.vstack([surface.triangles, triangles[:, ::-1] + len(surface.points)]),
        np.concatenate([surface.boundary, np.full(len(triangles), FREE)]),
    )


def of_level_set(inside: Field, gap: float, box: tuple[float, float], across: int = 16) -> ClosedSurface:
    """Triangulate where a function is positive between z = 0 and the gap, |x| and |y| within a box [m]."""
    step = gap / across
    counts = [int(np.ceil(half / step)) for half in box]
    axes = [step * np.arange(-count, count + 1) for count in counts] + [np.linspace(0.0, gap, across + 1)]
    values = inside(*np.meshgrid(*axes, indexing="ij"))
    values[np.abs(values) < 0.02 * step] = 0.02 * step  # no vertex so near a node that triangles degenerate
    points, triangles, *_ = marching_cubes(values, 0.0, gradient_direction="ascent")
    points = step * (points - [*counts, 0])
    points[:, 2] = np.where(points[:, 2] > (1.0 - 1e-9) * gap, gap, points[:, 2])
    volume = np.einsum("ij,ij->", *(points[triangles[:, 0]], np.cross(*(points[triangles[:, k]] for k in (1, 2)))))
    return close_rings(points, triangles if volume > 0.0 else triangles[:, ::-1], outlines(triangles))


def bridged_pair(gap: float, distance: float, radius: float, bridge: float) -> ClosedSurface:
    """Two truncated spheres, joined by a cylinder of a radius between them [m]; their axes are on x."""

    def inside(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        height = z - 0.5 * gap
        left, right = (radius - np.sqrt((x - side * distance / 2) ** 2 + y**2 + height**2) for side in (-1, 1))
        between = bridge - np.sqrt(y**2 + height**2) - np.maximum(0.0, np.abs(x) - 0.5 * distance)
        sharp = 20.0 / radius * 0.36
        return np.log(np.exp(sharp * left) + np.exp(sharp * right) + np.exp(sharp * between)) / sharp

    return of_level_set(inside, gap, (0.5 * distance + 1.2 * radius, 1.2 * radius))


def hooked(gap: float, reach: float) -> ClosedSurface:
    """A joint of about 0.73 gaps' radius with an arm that reaches out [m] and bends round a bay: not star-shaped."""
    unit = gap / 0.3

    def inside(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        height = z - 0.5 * gap
        column = 0.22 * unit - np.sqrt(x**2 + y**2)
        along = np.clip(x, 0.0, reach)
        arm = 0.08 * unit - np.sqrt((x - along) ** 2 + y**2 + height**2)
        up = np.clip(y, 0.0, 0.25 * unit)
        finger = 0.08 * unit - np.sqrt((x - reach) ** 2 + (y - up) ** 2 + height**2)
        sharp = 60.0 / unit
        return np.log(sum(np.exp(sharp * part) for part in (column, arm, finger))) / sharp

    return of_level_set(inside, gap, (0.65 * unit, 0.45 * unit), across=14)
