"""From a closed surface to the nodes of a swept butterfly: one section a level, areas and volume kept."""

from dataclasses import dataclass

import numpy as np

from meshing.butterfly import Butterfly
from meshing.hexahedra import volumes
from meshing.section import cut_segments, radius_by_angle, section_area, section_centroid
from meshing.surface import ClosedSurface, enclosed_volume

END = 1.0e-9  # of the height: how far inside the end sections are cut, where the plane still crosses the triangles
LARGEST_CORRECTION = 0.1


@dataclass(frozen=True, slots=True)
class Levels:
    """Nodes of the solder, level by level.

    Attributes:
        points: (layers + 1, n, 3) [m].
        scale: factor by which the inner outlines were scaled to keep the volume.
    """

    points: np.ndarray
    scale: float


def solder_levels(surface: ClosedSurface, section: Butterfly, layers: int) -> Levels:
    """Cut a body into sections of equal distance and lay the butterfly into each.

    A polygon of few sides encloses less than the section that it follows, and straight layers less than a bulge: each
    outline is scaled to its section's area, then those between the ends by one common factor to the body's volume.

    Raises:
        ValueError: a section is not star-shaped, or the layers are too few to keep the volume.
    """
    bottom, top = float(surface.points[:, 2].min()), float(surface.points[:, 2].max())
    heights = np.linspace(bottom, top, layers + 1)
    cuts = np.clip(heights, bottom + END * (top - bottom), top - END * (top - bottom))
    points = np.empty((layers + 1, len(section.points), 3))
    for level, cut in enumerate(cuts):
        points[level, :, :2] = _section_nodes(surface, section, cut)
    points[:, :, 2] = heights[:, None]
    scale = _volume_keeping_scale(points, section, enclosed_volume(surface))
    return Levels(_scaled(points, section, scale), scale)


def layer_cells(quads: np.ndarray, nodes: int, layers: int) -> np.ndarray:
    """Sweep quads (q, 4) through ``layers`` layers of ``nodes`` nodes a level: hexahedra (layers q, 8)."""
    return np.vstack([np.hstack([quads + k * nodes, quads + (k + 1) * nodes]) for k in range(layers)]).astype(np.int32)


def _section_nodes(surface: ClosedSurface, section: Butterfly, height: float) -> np.ndarray:
    """Section nodes at one height, (n, 2) [m]: the unit disc stretched to the outline along each angle."""
    segments = cut_segments(surface.points, surface.triangles, height)
    centre, area = section_centroid(segments), section_area(segments)
    angles = _angles(section.points[section.rim])
    radii = radius_by_angle(segments, centre, angles)
    sector = np.sin(np.roll(angles, -1) - angles)
    polygon = 0.5 * float(np.sum(radii * np.roll(radii, -1) * sector))
    order = np.argsort(angles)
    stretch = np.interp(_angles(section.points), angles[order], radii[order], period=2.0 * np.pi)
    return centre + np.sqrt(area / polygon) * stretch[:, None] * section.points


def _volume_keeping_scale(points: np.ndarray, section: Butterfly, volume: float) -> float:
    """Scale of the inner outlines at which the swept hexahedra have the volume: root of an exact quadratic."""
    cells = layer_cells(section.quads, points.shape[1], len(points) - 1)
    samples = np.array([0.0, 1.0, 2.0])
    swept = [volumes(_scaled(points, section, scale).reshape(-1, 3), cells).sum() / volume for scale in samples]
    quadratic = np.polyfit(samples, np.array(swept) - 1.0, 2)
    roots = np.roots(quadratic)
    scale = float(roots[np.argmin(np.abs(roots - 1.0))].real)
    if np.iscomplex(roots).any() or abs(scale - 1.0) > LARGEST_CORRECTION:
        raise ValueError(
            f"{len(points) - 1} layers hold {swept[1]:.3f} of its volume, allowed is a correction of the inner sections"
            f" by {LARGEST_CORRECTION:g}; use more layers"
        )
    return scale


def _scaled(points: np.ndarray, section: Butterfly, scale: float) -> np.ndarray:
    """Scale all levels but the ends about their centres."""
    result = points.copy()
    inner = points[1:-1, :, :2]
    centres = inner[:, section.rim].mean(axis=1, keepdims=True)
    result[1:-1, :, :2] = centres + scale * (inner - centres)
    return result


def _angles(points: np.ndarray) -> np.ndarray:
    return np.arctan2(points[:, 1], points[:, 0])
