"""Joint surfaces with exactly known measures: revolved, lobed, bridged, hooked, with voids."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from skimage.measure import marching_cubes

from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.core.facets import outlines
from reflowshock.meshing.surface.closed_surface import FREE, ClosedSurface, close_rings, close_surface


def revolve(profile: np.ndarray, gap: float, around: int = 48, offset: float = 0.0):
    """Triangulate a body of revolution.

    Args:
        profile: Radii [m] at equal steps of height from 0 to gap, shape (k,).
        gap: Height [m].
        around: Vertices per circle.
        offset: Shift of the upper end along x [m], linear in height.

    Returns:
        Points, free triangles, lower ring, upper ring.
    """
    angles = 2.0 * np.pi * np.arange(around) / around
    shares = np.linspace(0.0, 1.0, len(profile))
    x = offset * shares[:, None] + profile[:, None] * np.cos(angles)
    y = profile[:, None] * np.sin(angles)
    points = np.stack([x, y, np.broadcast_to(gap * shares[:, None], x.shape)], axis=-1).reshape(-1, 3)
    lower = np.arange(len(profile) - 1)[:, None] * around
    ring = np.arange(around)
    first, second = (lower + ring).ravel(), (lower + np.roll(ring, -1)).ravel()
    triangles = np.vstack(
        [np.column_stack([first, second, second + around]), np.column_stack([first, second + around, first + around])]
    )
    return points, triangles, ring, (len(profile) - 1) * around + ring


def barrel(
    gap: float, bulge: float, lower: float = 0.24e-3, upper: float = 0.24e-3, offset: float = 0.0
) -> ClosedSurface:
    """Return a parabolic barrel (bulge > 0) or hourglass (bulge < 0) between discs of two radii [m]."""
    share = np.linspace(0.0, 1.0, 25)
    profile = lower + (upper - lower) * share + 4.0 * bulge * share * (1.0 - share)
    return close_surface(*revolve(profile, gap, offset=offset))


def truncated_sphere(radius: float, half_gap: float, around: int, levels: int):
    """Return a sphere between two planes at equal distance from its centre, as ``revolve``, and its exact measures."""
    heights = np.linspace(-half_gap, half_gap, levels)
    contact = np.sqrt(radius**2 - half_gap**2)
    exact = {
        "volume": 2.0 * np.pi * (radius**2 * half_gap - half_gap**3 / 3.0),
        "max_width": 2.0 * radius,
        "contact_radius_board": contact,
        "contact_radius_package": contact,
        "contact_angle_board": 0.5 * np.pi + np.arcsin(half_gap / radius),
        "contact_angle_package": 0.5 * np.pi + np.arcsin(half_gap / radius),
    }
    return revolve(np.sqrt(radius**2 - heights**2), 2.0 * half_gap, around), exact


def laid_between(surface: ClosedSurface, offset: tuple[float, float], slope: tuple[float, float]) -> ClosedSurface:
    """Return a straight joint between a pad at z = 0 and a shifted [m] and sloped pad."""
    planes = PadPlanes(float(surface.points[:, 2].max()), np.array(offset), np.array(slope))
    return replace(surface, points=planes.restore(surface.points))


def overflow(gap: float, angle: float, reach: float, around: int = 48, levels: int = 25) -> ClosedSurface:
    """Return solder on the mask: an arc that meets both plates above 90 degrees, with discs of radius ``reach``."""
    radius = 0.5 * gap / np.cos(np.pi - angle)
    neck = max(0.0, reach - radius * np.sin(angle))
    height = np.linspace(-0.5 * gap, 0.5 * gap, levels)
    return close_surface(*revolve(neck + np.sqrt(radius**2 - height**2), gap, around))


def lobed(gap: float, radius: float, lobes: int, depth: float, levels: int = 25) -> ClosedSurface:
    """Return a star-shaped cylinder of a radius [m] with lobes at half height."""
    points, triangles, lower, upper = revolve(np.full(levels, radius), gap, 96)
    angle = np.arctan2(points[:, 1], points[:, 0])
    wave = np.cos(lobes * angle) * np.sin(np.pi * points[:, 2] / gap)
    points[:, :2] *= 1.0 + depth * wave[:, None]
    return close_surface(points, triangles, lower, upper)


Field = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def sphere(centre: Sequence[float], radius: float, rings: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Return points and outward triangles of a sphere with ``rings`` circles of latitude."""
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
    """Return a body with a spherical void inside."""
    points, triangles = sphere(centre, radius)
    return ClosedSurface(
        np.vstack([surface.points, points]),
        np.vstack([surface.triangles, triangles[:, ::-1] + len(surface.points)]),
        np.concatenate([surface.boundary, np.full(len(triangles), FREE)]),
    )


def of_level_set(inside: Field, gap: float, box: tuple[float, float], across: int = 16) -> ClosedSurface:
    """Triangulate the positive region of a function between z = 0 and the gap, |x| and |y| within a box [m]."""
    step = gap / across
    counts = [int(np.ceil(half / step)) for half in box]
    axes = [step * np.arange(-count, count + 1) for count in counts] + [np.linspace(0.0, gap, across + 1)]
    values = inside(*np.meshgrid(*axes, indexing="ij"))
    values[np.abs(values) < 0.02 * step] = 0.02 * step  # avoids degenerate triangles near grid nodes
    points, triangles, *_ = marching_cubes(values, 0.0, gradient_direction="ascent")
    points = step * (points - [*counts, 0])
    points[:, 2] = np.where(points[:, 2] > (1.0 - 1e-9) * gap, gap, points[:, 2])
    volume = np.einsum("ij,ij->", *(points[triangles[:, 0]], np.cross(*(points[triangles[:, k]] for k in (1, 2)))))
    return close_rings(points, triangles if volume > 0.0 else triangles[:, ::-1], outlines(triangles))


def bridged_pair(gap: float, distance: float, radius: float, bridge: float) -> ClosedSurface:
    """Return two truncated spheres on the x axis, joined by a cylinder of a radius [m]."""

    def inside(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        height = z - 0.5 * gap
        left, right = (radius - np.sqrt((x - side * distance / 2) ** 2 + y**2 + height**2) for side in (-1, 1))
        between = bridge - np.sqrt(y**2 + height**2) - np.maximum(0.0, np.abs(x) - 0.5 * distance)
        sharp = 20.0 / radius * 0.36
        return np.log(np.exp(sharp * left) + np.exp(sharp * right) + np.exp(sharp * between)) / sharp

    return of_level_set(inside, gap, (0.5 * distance + 1.2 * radius, 1.2 * radius))


def hooked(gap: float, reach: float) -> ClosedSurface:
    """Return a joint of about 0.73 gaps' radius with an arm that reaches out [m] round a bay: not star-shaped."""
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
