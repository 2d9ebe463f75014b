"""Closed surfaces of joints: the free surface of the particles, closed by wetted discs, checked and measured."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np
from numpy.polynomial import Legendre

from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.core.facets import cut_segments, pieces, section_area

FREE, BOARD_PAD, PACKAGE_PAD = 0, 1, 2
SMALLEST_TRIANGLE = 1.0e-8  # of the mean area
SECTIONS, DEGREE, SAMPLES = 64, 6, 401


class SurfaceError(ValueError):
    """Error for a triangulation that does not enclose a body; gives the position and the reason."""


@dataclass(frozen=True, slots=True)
class ClosedSurface:
    """Watertight, outward oriented triangulation in the joint's own frame.

    Attributes:
        points: Vertices, shape (n, 3) [m].
        triangles: Vertex numbers of the triangles, shape (t, 3).
        boundary: Label of each triangle, FREE, BOARD_PAD or PACKAGE_PAD, shape (t,).
    """

    points: np.ndarray
    triangles: np.ndarray
    boundary: np.ndarray


def close_surface(
    points: np.ndarray, triangles: np.ndarray, ring_board: np.ndarray, ring_package: np.ndarray
) -> ClosedSurface:
    """Close the free surface of one joint with a disc on each pad.

    Args:
        points: Vertices, shape (n, 3) [m]; vertices without a triangle are dropped.
        triangles: Triangles of the free surface, outward oriented, open along the rings, shape (t, 3).
        ring_board: Vertices along the contact line on the board, in order, shape (k,).
        ring_package: Vertices along the contact line on the package, in order, shape (l,).

    Returns:
        Vertices, triangles, and a label of each triangle: FREE, BOARD_PAD or PACKAGE_PAD.

    Raises:
        SurfaceError: The result is not watertight, not outward oriented, or has a degenerate triangle.
    """
    return close_rings(points, triangles, (ring_board, ring_package))


def close_rings(points: np.ndarray, triangles: np.ndarray, rings: Sequence[np.ndarray]) -> ClosedSurface:
    """Close a free surface with a disc in each of its contact lines.

    Args:
        points: Vertices, shape (n, 3) [m]; vertices without a triangle are dropped.
        triangles: Triangles of the free surface, outward oriented, open along the rings, shape (t, 3).
        rings: Vertices along each contact line, in order, shape (k,) each; contact lines in the lower half belong to
            the board.

    Returns:
        Vertices, triangles, and a label of each triangle: FREE, BOARD_PAD or PACKAGE_PAD.

    Raises:
        SurfaceError: The result is not watertight, not outward oriented, or has a degenerate triangle.
    """
    heights = np.array([points[ring, 2].mean() for ring in rings])
    upper = heights > 0.5 * (heights.min() + heights.max())
    caps = [_cap(points, ring, len(points) + k, up) for k, (ring, up) in enumerate(zip(rings, upper, strict=True))]
    vertices = np.vstack([points, *(cap[0] for cap in caps)])
    faces = np.vstack([triangles, *(cap[1] for cap in caps)])
    labels = [FREE, *np.where(upper, PACKAGE_PAD, BOARD_PAD)]
    boundary = np.repeat(labels, [len(triangles), *(len(cap[1]) for cap in caps)])
    used, compact = np.unique(faces, return_inverse=True)
    surface = ClosedSurface(vertices[used], compact.reshape(-1, 3).astype(np.int32), boundary.astype(np.int32))
    check_surface(surface)
    return surface


def check_surface(surface: ClosedSurface) -> None:
    """Check that a surface encloses a body, before it is measured or meshed.

    Args:
        surface: Closed surface of a joint.

    Raises:
        SurfaceError: The surface is not watertight, faces inwards, or has a degenerate triangle.
    """
    edges = np.vstack([surface.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    ordered = np.unique(edge_numbers(edges))
    if len(ordered) != len(edges) or not np.array_equal(ordered, np.unique(edge_numbers(edges[:, ::-1]))):
        raise SurfaceError("surface is not watertight: an edge is not shared by two triangles of opposite direction")
    areas = area_vectors(surface.points, surface.triangles)
    sizes = np.linalg.norm(areas, axis=1)
    smallest = int(sizes.argmin())
    if sizes[smallest] < SMALLEST_TRIANGLE * sizes.mean():
        limit = SMALLEST_TRIANGLE * sizes.mean()
        raise SurfaceError(f"triangle {smallest} is degenerate: area {sizes[smallest]:.3g} m^2, allowed >= {limit:.3g}")
    volume = enclosed_volume(surface)
    if volume <= 0.0:
        raise SurfaceError(f"surface is oriented inwards: volume {volume:.3g} m^3, allowed > 0")
    facing = np.select([surface.boundary == BOARD_PAD, surface.boundary == PACKAGE_PAD], [-1.0, 1.0]) * areas[:, 2]
    if facing.min() < 0.0:
        raise SurfaceError(f"triangle {int(facing.argmin())} on a pad faces the joint: a contact line crosses itself")


def edge_numbers(edges: np.ndarray) -> np.ndarray:
    """Return an integer key for each directed edge, given by its two vertices (e, 2); edges with equal keys are equal.

    Args:
        edges: Numbers of the first and the second vertex, shape (e, 2).

    Returns:
        Keys, shape (e,); an edge and its reverse have different keys.
    """
    return (edges[:, 0].astype(np.int64) << 32) + edges[:, 1]


def enclosed_volume(surface: ClosedSurface) -> float:
    """Return the volume that a closed surface of solder encloses [m^3]."""
    return volume_of(surface.points, surface.triangles)


def volume_of(points: np.ndarray, triangles: np.ndarray) -> float:
    """Return the volume [m^3] that triangles enclose (divergence theorem); negative if they are oriented inwards.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Outward oriented triangles of a closed surface, shape (t, 3).
    """
    first, second, third = np.moveaxis(points[triangles], 1, 0)
    return float(np.einsum("ij,ij->", first, np.cross(second, third))) / 6.0


def pad_planes(surface: ClosedSurface) -> PadPlanes:
    """Fit the plane of the package's pad, or the common plane of its pads, in the surface's own frame.

    Args:
        surface: Closed surface of a joint, whose board's pad lies at z = 0.

    Returns:
        Height of the plane above the board's pad [m], centre of the pad in plan [m], and slopes along x and y.
    """
    return PadPlanes.fit(surface.points, surface.triangles[surface.boundary == PACKAGE_PAD])


def measure(surface: ClosedSurface) -> dict[str, float]:
    """Measure volume, standoff, width, contact radii and contact angles of a joint.

    Width and angles belong to the body of revolution whose sections have the areas A(z) of the straightened joint; a
    polynomial is fitted to A(z). Areas are more accurate than distances, because vertices lie outside the smooth shape
    and chords inside it, while the integral of A is the volume.

    Args:
        surface: Closed surface of a joint with one pad on each side.

    Returns:
        ``volume`` [m^3], ``standoff`` [m], ``max_width`` [m], ``contact_radius_board`` and ``contact_radius_package``
        [m], ``contact_angle_board`` and ``contact_angle_package`` [rad] (inside the solder, mean over the contact
        line).
    """
    planes = pad_planes(surface)
    straight, top = planes.straighten(surface.points), planes.gap
    heights = top * (np.arange(SECTIONS) + 0.5) / SECTIONS
    areas = [section_area(cut_segments(straight, surface.triangles, height)) for height in heights]
    profile = Legendre.fit(heights, areas, DEGREE, domain=[0.0, top])
    largest = max(profile(np.linspace(0.0, top, SAMPLES)))
    radii = [math.sqrt(pad_area(surface, pad) / math.pi) for pad in (BOARD_PAD, PACKAGE_PAD)]
    slopes = [float(profile.deriv()(end)) / (2.0 * math.pi * r) for end, r in zip((0.0, top), radii, strict=True)]
    return {
        "volume": enclosed_volume(surface),
        "standoff": top,
        "max_width": 2.0 * max(math.sqrt(largest / math.pi), *radii),
        "contact_radius_board": radii[0],
        "contact_radius_package": radii[1],
        "contact_angle_board": 0.5 * math.pi + math.atan(slopes[0]),
        "contact_angle_package": 0.5 * math.pi - math.atan(slopes[1]),
    }


def pieces_of(surface: ClosedSurface, pad: int | None = None) -> list[np.ndarray]:
    """Return the triangles of each connected piece of a surface, shape (t, 3) each, the largest number first.

    Args:
        surface: Closed surface.
        pad: BOARD_PAD or PACKAGE_PAD to consider the triangles on the pads of that side only; None for all triangles.
    """
    triangles = surface.triangles if pad is None else surface.triangles[surface.boundary == pad]
    return [triangles[rows] for rows in pieces(triangles)]


def write_surface(path: Path, surface: ClosedSurface) -> None:
    """Write a surface in metres: with its boundary labels as ``.vtu``, or without them as ``.stl``, by the suffix.

    Args:
        path: File to write, replaced if it exists; its suffix selects the format.
        surface: Vertices, triangles and labels.
    """
    labels = {} if path.suffix == ".stl" else {"boundary": [surface.boundary]}
    meshio.write(path, meshio.Mesh(surface.points, [("triangle", surface.triangles)], cell_data=labels))


def read_surface(path: Path) -> ClosedSurface:
    """Read a surface that ``write_surface`` wrote as ``.vtu``: vertices in metres, triangles, and their labels."""
    mesh = meshio.read(path)
    return ClosedSurface(mesh.points, mesh.cells[0].data.astype(np.int32), mesh.cell_data["boundary"][0])


def _cap(points: np.ndarray, ring: np.ndarray, centre: int, upward: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return centre and triangles of a fan around the mean point of a ring, facing upward or downward."""
    x, y = points[ring, 0], points[ring, 1]
    counter_clockwise = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) > 0.0
    first, second = (ring, np.roll(ring, -1)) if counter_clockwise == upward else (np.roll(ring, -1), ring)
    return points[ring].mean(axis=0)[None, :], np.column_stack([first, second, np.full(len(ring), centre)])


def area_vectors(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the area vector of each triangle: along its normal, with its area as length.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).

    Returns:
        Area vectors, shape (t, 3) [m^2].
    """
    first, second, third = np.moveaxis(points[triangles], 1, 0)
    return 0.5 * np.cross(second - first, third - first)


def pad_area(surface: ClosedSurface, pad: int) -> float:
    """Return the wetted area of all pads of one side [m^2].

    Args:
        surface: Closed surface of a joint, with labels of its triangles.
        pad: Label of the side, BOARD_PAD or PACKAGE_PAD.
    """
    return float(np.linalg.norm(area_vectors(surface.points, surface.triangles[surface.boundary == pad]), axis=1).sum())
