"""Closed surface of a joint: the particles' free surface and the two wetted discs, checked and measured."""

from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np

from meshing.section import cut_segments, section_area

FREE, BOARD_PAD, PACKAGE_PAD = 0, 1, 2
SECTIONS = 41


@dataclass(frozen=True, slots=True)
class ClosedSurface:
    """A watertight, outward oriented triangulation in the joint's own frame.

    ``points`` (n, 3) [m], ``triangles`` (t, 3), ``boundary`` (t,): FREE, BOARD_PAD or PACKAGE_PAD.
    """

    points: np.ndarray
    triangles: np.ndarray
    boundary: np.ndarray


def close_surface(points: np.ndarray, triangles: np.ndarray, ring_board: np.ndarray, ring_package: np.ndarray) -> ClosedSurface:
    """Close a free surface with a disc on each pad.

    Args:
        points: (n, 3) vertices [m]; others than those of the triangles are dropped.
        triangles: (t, 3) free surface, outward oriented, open along the two rings.
        ring_board: vertices along the board-side contact line, in order.
        ring_package: likewise on the package side.

    Raises:
        ValueError: the result is not watertight, not outward oriented, or has a degenerate triangle.
    """
    caps = [_cap(points, ring, len(points) + k, up) for k, (ring, up) in enumerate(((ring_board, -1), (ring_package, 1)))]
    vertices = np.vstack([points, *(cap[0] for cap in caps)])
    faces = np.vstack([triangles, *(cap[1] for cap in caps)])
    boundary = np.repeat([FREE, BOARD_PAD, PACKAGE_PAD], [len(triangles), *(len(cap[1]) for cap in caps)])
    used, compact = np.unique(faces, return_inverse=True)
    surface = ClosedSurface(vertices[used], compact.reshape(-1, 3).astype(np.int32), boundary.astype(np.int32))
    check_surface(surface)
    return surface


def check_surface(surface: ClosedSurface) -> None:
    """Raise ValueError unless the surface is watertight, outward oriented and without degenerate triangles."""
    edges = np.vstack([surface.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    ordered = np.unique(edges, axis=0)
    if len(ordered) != len(edges) or not _same_rows(ordered, np.unique(edges[:, ::-1], axis=0)):
        raise ValueError("joint surface is not watertight: an edge is not shared by exactly two triangles")
    corners = surface.points[surface.triangles]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    if areas.min() < 1e-8 * areas.mean():
        raise ValueError(f"joint surface: triangle {int(areas.argmin())} is degenerate (area {areas.min():.3g} m^2)")
    if enclosed_volume(surface) <= 0.0:
        raise ValueError("joint surface is oriented inwards (negative volume)")


def enclosed_volume(surface: ClosedSurface) -> float:
    """Volume enclosed by the surface [m^3] (divergence theorem)."""
    first, second, third = np.moveaxis(surface.points[surface.triangles], 1, 0)
    return float(np.einsum("ij,ij->", first, np.cross(second, third))) / 6.0


def measure(surface: ClosedSurface) -> dict[str, float]:
    """Measure a closed surface.

    Returns:
        volume [m^3], standoff [m], max_width [m] (diameter of the circle of the largest section's area),
        contact_radius_board and _package [m] (likewise), contact_angle_board and _package [rad] (mean slope of
        the free triangles on the contact line, measured inside the solder).
    """
    bottom, top = surface.points[:, 2].min(), surface.points[:, 2].max()
    heights = bottom + (top - bottom) * (np.arange(SECTIONS) + 0.5) / SECTIONS
    areas = [section_area(cut_segments(surface.points, surface.triangles, height)) for height in heights]
    pads = [_disc_area(surface, pad) for pad in (BOARD_PAD, PACKAGE_PAD)]
    return {
        "volume": enclosed_volume(surface),
        "standoff": float(top - bottom),
        "max_width": 2.0 * float(np.sqrt(max(*areas, *pads) / np.pi)),
        "contact_radius_board": float(np.sqrt(pads[0] / np.pi)),
        "contact_radius_package": float(np.sqrt(pads[1] / np.pi)),
        "contact_angle_board": _contact_angle(surface, BOARD_PAD),
        "contact_angle_package": _contact_angle(surface, PACKAGE_PAD),
    }


def write_surface(path: Path, surface: ClosedSurface) -> None:
    """Write the surface with its boundary labels, in the format of the file's suffix (.vtu; .stl drops the labels)."""
    labels = {} if path.suffix == ".stl" else {"boundary": [surface.boundary]}
    meshio.write(path, meshio.Mesh(surface.points, [("triangle", surface.triangles)], cell_data=labels))


def read_surface(path: Path) -> ClosedSurface:
    """Read a surface written by ``write_surface`` as VTU."""
    mesh = meshio.read(path)
    return ClosedSurface(mesh.points, mesh.cells[0].data.astype(np.int32), mesh.cell_data["boundary"][0])


def _cap(points: np.ndarray, ring: np.ndarray, centre: int, upward: int) -> tuple[np.ndarray, np.ndarray]:
    """Fan of triangles around the ring's mean point; ``upward`` +1 or -1 is the side it faces."""
    x, y = points[ring, 0], points[ring, 1]
    counter_clockwise = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) > 0.0
    first, second = (ring, np.roll(ring, -1)) if counter_clockwise == (upward > 0) else (np.roll(ring, -1), ring)
    return points[ring].mean(axis=0)[None, :], np.column_stack([first, second, np.full(len(ring), centre)])


def _same_rows(first: np.ndarray, second: np.ndarray) -> bool:
    return first.shape == second.shape and bool(np.array_equal(first, second))


def _normals(surface: ClosedSurface) -> np.ndarray:
    """Area vectors (t, 3) [m^2]."""
    first, second, third = np.moveaxis(surface.points[surface.triangles], 1, 0)
    return 0.5 * np.cross(second - first, third - first)


def _disc_area(surface: ClosedSurface, pad: int) -> float:
    return float(np.abs(_normals(surface)[surface.boundary == pad, 2].sum()))


def _contact_angle(surface: ClosedSurface, pad: int) -> float:
    """Mean angle between pad and free surface over the triangles that have an edge on the contact line."""
    on_pad = np.zeros(len(surface.points), dtype=bool)
    on_pad[surface.triangles[surface.boundary == pad]] = True
    at_line = (surface.boundary == FREE) & (on_pad[surface.triangles].sum(axis=1) == 2)
    normals = _normals(surface)[at_line]
    facing = 1.0 if pad == BOARD_PAD else -1.0
    angles = np.arccos(np.clip(facing * normals[:, 2] / np.linalg.norm(normals, axis=1), -1.0, 1.0))
    return float(angles.mean())
