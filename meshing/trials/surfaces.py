"""Joint surfaces of which everything is known."""

from dataclasses import replace

import numpy as np

from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.surface.closed_surface import ClosedSurface, close_surface


def revolve(profile: np.ndarray, gap: float, around: int = 48, offset: float = 0.0):
    """Triangulate a body of revolution.

    Args:
        profile: (k,) radii [m] at equal steps of height from 0 to gap.
        gap: height [m].
        around: vertices a circle.
        offset: shift of the upper end along x [m], linear in height.

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
    """A parabolic barrel (bulge > 0) or hourglass (bulge < 0) between discs of two radii [m]."""
    share = np.linspace(0.0, 1.0, 25)
    profile = lower + (upper - lower) * share + 4.0 * bulge * share * (1.0 - share)
    return close_surface(*revolve(profile, gap, offset=offset))


def truncated_sphere(radius: float, half_gap: float, around: int, levels: int):
    """Sphere between two planes at equal distance from its centre, as ``revolve``, and its exact measures."""
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
    """A straight joint between a pad at z = 0 and one that is shifted [m] and slopes along x and y."""
    planes = PadPlanes(float(surface.points[:, 2].max()), np.array(offset), np.array(slope))
    return replace(surface, points=planes.restore(surface.points))


def overflow(gap: float, angle: float, reach: float, around: int = 48, levels: int = 25) -> ClosedSurface:
    """Solder on the mask: an arc that meets both plates at an angle above 90 degrees, its discs of a radius `reach`."""
    radius = 0.5 * gap / np.cos(np.pi - angle)
    neck = max(0.0, reach - radius * np.sin(angle))
    height = np.linspace(-0.5 * gap, 0.5 * gap, levels)
    return close_surface(*revolve(neck + np.sqrt(radius**2 - height**2), gap, around))


def lobed(gap: float, radius: float, lobes: int, depth: float, levels: int = 25) -> ClosedSurface:
    """A cylinder of a radius [m] with lobes at half height, as deep as a share of the radius: star-shaped."""
    points, triangles, lower, upper = revolve(np.full(levels, radius), gap, 96)
    angle = np.arctan2(points[:, 1], points[:, 0])
    wave = np.cos(lobes * angle) * np.sin(np.pi * points[:, 2] / gap)
    points[:, :2] *= 1.0 + depth * wave[:, None]
    return close_surface(points, triangles, lower, upper)
