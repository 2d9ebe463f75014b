"""Swept solder meshes: butterfly sections of a body, stacked from the board's pad to the package's."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from reflowshock.meshing.board.parameters import JointNumerics
from reflowshock.meshing.core.facets import cut_segments, radius_by_angle, section_area, section_centroid
from reflowshock.meshing.core.hexahedra import volumes
from reflowshock.meshing.joint.butterfly import Butterfly, butterfly
from reflowshock.meshing.joint.solder import Solder, WettedFace
from reflowshock.meshing.surface.closed_surface import ClosedSurface, enclosed_volume, pad_planes

END = 1.0e-9  # of the height: how far inside the end sections are cut, where the plane still crosses the triangles
LARGEST_CORRECTION = 0.1
VOLUME_TOLERANCE = 1.0e-12
SECANT_STEPS = 20
LARGEST_GROWTH = 2.2  # of neighbouring layers
Placing = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, slots=True)
class Levels:
    """Nodes of the solder, level by level.

    Attributes:
        points: Node coordinates, shape (layers + 1, n, 3) [m].
        scale: Factor by which the inner outlines were scaled to keep the volume.
        volume: Exact volume of the body [m^3].
    """

    points: np.ndarray
    scale: float
    volume: float


def swept_solder(surface: ClosedSurface, numerics: JointNumerics, place: Placing, overhang: float = 0.0) -> Solder:
    """Fill a body of solder with layers of hexahedra from pad to pad.

    Args:
        surface: Closed surface in the body's own frame.
        numerics: Resolution of the cross-section, number and heights of the layers.
        place: Map from the own frame to the assembly, where the volume is kept; points of shape (n, 3) [m].
        overhang: Height by which each end face is extruded as a part of the body [m].

    Returns:
        Hexahedra in the body's own frame, with wetted faces, exact volume, and the scale of the outlines.

    Raises:
        ValueError: A section is not star-shaped, or the layers are too few to keep the volume or to grow smoothly.
    """
    section = butterfly(numerics.core, numerics.rings)
    levels = solder_levels(surface, section, numerics, place, overhang)
    count = len(section.points)
    top = numerics.layers * count
    faces = (
        WettedFace("board", section.quads, section.rim),
        WettedFace("package", section.quads + top, section.rim + top),
    )
    cells = layer_cells(section.quads, count, numerics.layers)
    return Solder(levels.points.reshape(-1, 3), cells, faces, levels.volume, levels.scale, pad_planes(surface))


def solder_levels(
    surface: ClosedSurface,
    section: Butterfly,
    numerics: JointNumerics,
    place: Placing,
    overhang: float = 0.0,
) -> Levels:
    """Cut a body into horizontal sections and fit a butterfly mesh to each.

    The body is straightened between its pads first, and restored afterwards. A polygon encloses less than the section
    that it approximates, and straight layers less than a bulge: each outline is scaled to the area of its section, then
    all outlines between the ends by one common factor to the volume of the body.

    Args:
        surface: Closed surface in the body's own frame.
        section: Quadrilaterals of the unit disc, a core inside rings.
        numerics: Number and heights of the layers.
        place: Map from the own frame to the assembly, points of shape (n, 3) [m]. The volume is kept there, because the
            gap under a curved package varies over the joint.
        overhang: Height by which each end face is extruded as a part of the body [m].

    Returns:
        Nodes level by level, shape (layers + 1, n, 3) [m], the common factor, and the exact volume [m^3].

    Raises:
        ValueError: A section is not star-shaped, or the layers are too few to keep the volume or to grow smoothly.
    """
    planes, layers = pad_planes(surface), numerics.layers
    straight = planes.straighten(surface.points)
    heights = layer_levels(planes.gap + 2.0 * overhang, numerics) - overhang
    cuts = np.clip(heights, END * planes.gap, (1.0 - END) * planes.gap)
    points = np.empty((layers + 1, len(section.points), 3))
    for level, cut in enumerate(cuts):
        points[level, :, :2] = section_nodes(cut_segments(straight, surface.triangles, cut), section)
    points[:, :, 2] = heights[:, None]
    cells = layer_cells(section.quads, len(section.points), layers)

    def restored(scale: float) -> np.ndarray:
        return planes.restore(_scaled(points, section, scale).reshape(-1, 3))

    def swept_volume(scale: float) -> float:
        return float(volumes(place(restored(scale)), cells).sum())

    ends = sum(section_area(cut_segments(straight, surface.triangles, cut)) for cut in cuts[[0, -1]])
    volume = enclosed_volume(surface) + overhang * ends
    scale = volume_keeping_scale(swept_volume, volume)
    return Levels(restored(scale).reshape(points.shape), scale, volume)


def layer_levels(height: float, numerics: JointNumerics) -> np.ndarray:
    """Return the heights of the planes between the element layers of a joint, graded towards the pads.

    Args:
        height: Height of the joint [m].
        numerics: Number of layers, and thickness and number of the layers at the pads, if these are prescribed.

    Returns:
        Heights from 0 to ``height``, shape (layers + 1,) [m].

    Raises:
        ValueError: No growth ratio within the limits fits between the layers at the pads.
    """
    if numerics.pad_layer is None:
        return np.linspace(0.0, height, numerics.layers + 1)
    first, between = numerics.pad_layer / numerics.pad_layers, numerics.layers - 2 * numerics.pad_layers
    steps = 1 + np.minimum(np.arange(between), np.arange(between)[::-1])
    rest = (height - 2.0 * numerics.pad_layer) / first

    def missing(logarithm: float) -> float:
        return float(np.exp(logarithm * steps).sum()) - rest

    limits = -math.log(LARGEST_GROWTH), math.log(LARGEST_GROWTH)
    if between < 1 or not missing(limits[0]) <= 0.0 <= missing(limits[1]):
        raise ValueError(
            f"{numerics.layers} layers, {numerics.pad_layers} of them in {numerics.pad_layer:.3g} m at each pad, do not"
            f" fill {height:.3g} m: the heights of neighbouring layers may differ by a factor of {LARGEST_GROWTH:g}"
        )
    inner = first * np.exp(brentq(missing, *limits, xtol=1.0e-14) * steps)
    pad = np.full(numerics.pad_layers, first)
    return height * np.concatenate([[0.0], (total := np.concatenate([pad, inner, pad]).cumsum()) / total[-1]])


def layer_cells(quads: np.ndarray, nodes: int, layers: int) -> np.ndarray:
    """Sweep the quadrilaterals of a section through layers to hexahedra.

    Args:
        quads: Nodes of the quadrilaterals of the lowest level, shape (q, 4).
        nodes: Number of nodes of each level; node i of level k has the number i + k ``nodes``.
        layers: Number of layers.

    Returns:
        Nodes of the hexahedra, the lower face first, shape (layers q, 8).
    """
    return np.vstack([np.hstack([quads + k * nodes, quads + (k + 1) * nodes]) for k in range(layers)]).astype(np.int32)


def section_nodes(segments: np.ndarray, section: Butterfly) -> np.ndarray:
    """Stretch the unit disc radially to the outline of a section, keeping its area.

    Args:
        segments: Start and end (x, y) of each segment of the outline, counter-clockwise, shape (s, 2, 2) [m].
        section: Quadrilaterals of the unit disc, whose n nodes are moved.

    Returns:
        Nodes of the section, shape (n, 2) [m].
    """
    centre, area = section_centroid(segments), section_area(segments)
    angles = _angles(section.points[section.rim])
    radii = radius_by_angle(segments, centre, angles)
    sector = np.sin(np.roll(angles, -1) - angles)
    polygon = 0.5 * float(np.sum(radii * np.roll(radii, -1) * sector))
    order = np.argsort(angles)
    stretch = np.interp(_angles(section.points), angles[order], radii[order], period=2.0 * np.pi)
    return centre + np.sqrt(area / polygon) * stretch[:, None] * section.points


def volume_keeping_scale(swept_volume: Callable[[float], float], volume: float) -> float:
    """Find the factor by which the outlines between the pads are scaled so that the mesh has the exact volume.

    Args:
        swept_volume: Function of the scale, 1 for the unscaled mesh, that returns the volume of the mesh [m^3].
        volume: Exact volume [m^3].

    Returns:
        Factor, near 1, found by the secant method.

    Raises:
        ValueError: The scale would differ from 1 by more than the allowed correction.
    """
    before, scale = 1.0 - LARGEST_CORRECTION, 1.0
    errors = [swept_volume(value) / volume - 1.0 for value in (before, scale)]
    share, steps = 1.0 + errors[1], 0
    while abs(errors[1]) > VOLUME_TOLERANCE and abs(scale - 1.0) <= LARGEST_CORRECTION and steps < SECANT_STEPS:
        before, scale = scale, scale - errors[1] * (scale - before) / (errors[1] - errors[0])
        errors, steps = [errors[1], swept_volume(scale) / volume - 1.0], steps + 1
    if abs(errors[1]) > VOLUME_TOLERANCE or abs(scale - 1.0) > LARGEST_CORRECTION:
        raise ValueError(
            f"its layers enclose {share:.3f} of its volume; scaling the inner sections by a factor of"
            f" 1 +- {LARGEST_CORRECTION:g} at most cannot correct this; use more layers"
        )
    return scale


def _scaled(points: np.ndarray, section: Butterfly, scale: float) -> np.ndarray:
    """Scale all levels except the ends about their centres."""
    result = points.copy()
    inner = points[1:-1, :, :2]
    centres = inner[:, section.rim].mean(axis=1, keepdims=True)
    result[1:-1, :, :2] = centres + scale * (inner - centres)
    return result


def _angles(points: np.ndarray) -> np.ndarray:
    return np.arctan2(points[:, 1], points[:, 0])
