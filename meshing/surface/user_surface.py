"""Surfaces of joints from user files, for example X-ray tomography: read, checked, and fitted between their pads."""

from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import lru_cache
from io import StringIO
from pathlib import Path
from typing import Literal

import meshio
import numpy as np

from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.board.pads import PadSite
from reflowshock.meshing.core.facets import pieces
from reflowshock.meshing.surface.closed_surface import (
    BOARD_PAD,
    FREE,
    PACKAGE_PAD,
    ClosedSurface,
    SurfaceError,
    area_vectors,
    check_surface,
    volume_of,
)
from reflowshock.meshing.surface.surface_checks import check_triangulation

Unit = Literal["um", "mm", "m"]
UNITS: dict[Unit, float] = {"um": 1.0e-6, "mm": 1.0e-3, "m": 1.0}
LARGEST = 1.0  # m: largest distance of a vertex from the median of all
MOST_TRIANGLES = 200_000  # which take about ten seconds to check
SUFFIXES = (".stl", ".ply", ".vtu")
CELLS = 1_000_002  # grid cells along the largest extent; vertices in one cell are merged
WELD = 1.0e-6  # of the largest extent: size of these cells
LEVEL = np.cos(np.radians(20.0))  # a pad's triangles face within 20 degrees of its normal
FLAT = 0.02  # of the height: how far from its plane a pad's vertices may lie
FITS = 4
SMALLEST_PAD = 0.3  # of the wetted radius of the site
GAP_RANGE = 0.1  # of the site's gap: largest difference of the surface's height


@dataclass(frozen=True, slots=True)
class _End:
    """Flat end of a surface: outward unit normal, a point of its plane, and row numbers of its triangles."""

    normal: np.ndarray
    point: np.ndarray
    rows: np.ndarray


def load_surface(path: Path, unit: Unit, site: PadSite) -> ClosedSurface:
    """Read a closed surface, find its flat ends and fit it between the pads of its site.

    The z axis of the file points roughly from the board to the package, x and y are the board's. The lower flat end is
    moved to z = 0 with its centre on the axis; heights are stretched so that the upper end lies in the plane of the
    package's pad.

    Args:
        path: STL, PLY or VTU file of triangles.
        unit: Unit of the coordinates in the file.
        site: Positions, radii and gap of the two pads of the joint.

    Returns:
        Vertices, triangles and their labels, in the joint's own frame: board's pad at z = 0.

    Raises:
        SurfaceError: The file is damaged or its triangles do not enclose a joint; the message gives the file, the
            fault, its position in the coordinates of the file, and the allowed range.
    """
    try:
        points, triangles = closed_triangles(path, unit)
        _check_height(points, unit, site)
        return _between_pads(points, triangles, site)
    except SurfaceError as error:
        raise SurfaceError(f"surface of joint {site.name}, {path}: {error}") from error


def file_volume(path: Path, unit: Unit) -> float:
    """Return the volume [m^3] that the surface in a file encloses, before its heights are stretched.

    Args:
        path: STL, PLY or VTU file of triangles.
        unit: Unit of the coordinates in the file.

    Raises:
        SurfaceError: The file is damaged, or its triangles do not enclose a body.
    """
    return volume_of(*closed_triangles(path, unit))


def closed_triangles(path: Path, unit: Unit) -> tuple[np.ndarray, np.ndarray]:
    """Read and check the surface in a file.

    Args:
        path: STL, PLY or VTU file of triangles.
        unit: Unit of the coordinates in the file.

    Returns:
        Vertices, shape (n, 3) [m], and triangles, shape (t, 3).

    Raises:
        SurfaceError: The file is damaged, or its triangles do not enclose a body.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise SurfaceError(f"suffix {path.suffix or 'none'}, allowed {', '.join(SUFFIXES)}")
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        raise SurfaceError("no such file") from error
    result = _read_version(path, unit, (status.st_mtime_ns, status.st_size, status.st_ino))
    if isinstance(result, SurfaceError):
        raise result
    return result


@lru_cache(maxsize=8)
def _read_version(
    path: Path, unit: Unit, version: tuple[int, int, int]
) -> tuple[np.ndarray, np.ndarray] | SurfaceError:
    """Read and check one version of a file, cached because several joints may use it; return an error as a value."""
    try:
        points, triangles = _welded(*_read(path, UNITS[unit]))
        check_triangulation(points, triangles, UNITS[unit])
        return points, triangles
    except SurfaceError as error:
        return error


def _read(path: Path, scale: float) -> tuple[np.ndarray, np.ndarray]:
    try:
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()), np.errstate(all="ignore"):  # meshio prints
            mesh = meshio.read(path)
    except (Exception, SystemExit) as error:  # readers of meshio raise any type for a damaged file
        kind = path.suffix[1:].upper()
        raise SurfaceError(f"cannot be read as {kind}: it is damaged, cut off, or of another format") from error
    others = sorted({block.type for block in mesh.cells} - {"triangle", "vertex", "line"})
    if others or not len(mesh.cells_dict.get("triangle", ())):
        raise SurfaceError(f"contains {', '.join(others) or 'no facets'}, allowed triangles")
    points, triangles = np.asarray(mesh.points, float), mesh.cells_dict["triangle"].astype(np.int64)
    _check_numbers(points, triangles)
    _check_extent(scale * points[:, :3])
    return scale * points[:, :3], triangles


def _check_numbers(points: np.ndarray, triangles: np.ndarray) -> None:
    """Raise SurfaceError for vertices that are not finite points and triangles whose vertices do not exist."""
    if points.ndim != 2 or points.shape[1] < 3:
        raise SurfaceError("has vertices without three coordinates")
    if len(triangles) > MOST_TRIANGLES:
        raise SurfaceError(f"has {len(triangles)} triangles, allowed up to {MOST_TRIANGLES}")
    wrong = ((triangles < 0) | (triangles >= len(points))).any(axis=1)
    if wrong.any():
        row = int(np.argmax(wrong))
        vertices = ", ".join(map(str, triangles[row]))
        raise SurfaceError(f"triangle {row} has the vertices {vertices}, allowed 0 to {len(points) - 1}")
    finite = np.isfinite(points[:, :3]).all(axis=1)
    if not finite.all():
        raise SurfaceError(f"vertex {int(np.argmin(finite))} has coordinates that are not numbers")


def _check_extent(points: np.ndarray) -> None:
    """Raise SurfaceError if a vertex (n, 3) [m] is so far away that all others would be merged into one point."""
    distance = np.abs(points - np.median(points, axis=0)).max(axis=1)
    if distance.max() > LARGEST:
        message = f"vertex {int(distance.argmax())} lies {distance.max():.3g} m away from the others"
        raise SurfaceError(f"{message}, allowed up to {LARGEST:g} m")


def _welded(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Merge vertices in the same grid cell and drop triangles that vanish thereby."""
    extent = float(np.ptp(points[np.unique(triangles)], axis=0).max())
    if extent == 0.0:
        raise SurfaceError("all its vertices are one point")
    cells = np.round((points - points[np.unique(triangles)].min(axis=0)) / (WELD * extent)).clip(-1, CELLS - 1)
    cell = (cells.astype(np.int64) + 1) @ np.array([(CELLS + 1) ** 2, CELLS + 1, 1])
    _, first, number = np.unique(cell, return_index=True, return_inverse=True)
    merged = number[triangles]
    whole = (merged != np.roll(merged, 1, axis=1)).all(axis=1)
    if not whole.any():
        raise SurfaceError(f"all its triangles are smaller than {WELD * extent:.3g} m, {WELD:g} of its extent")
    used, compact = np.unique(merged[whole], return_inverse=True)
    return points[first][used], compact.reshape(-1, 3)


def _check_height(points: np.ndarray, unit: Unit, site: PadSite) -> None:
    """Raise SurfaceError if the height is implausible in this unit, and suggest a unit in which it would fit."""
    height, (least, most) = float(np.ptp(points[:, 2])), (0.5 * site.gap, 2.0 * site.gap)
    if least < height < most:
        return
    message = f"height {height:.4g} m with lengths in {unit}, allowed {least:.4g} to {most:.4g} m"
    better = [name for name, value in UNITS.items() if least < height * value / UNITS[unit] < most]
    raise SurfaceError(message + (f"; is it in {better[0]}?" if better else ""))


def _between_pads(points: np.ndarray, triangles: np.ndarray, site: PadSite) -> ClosedSurface:
    """Rotate the lower end into z = 0, flatten both ends and stretch heights to the plane of the package's pad."""
    lower = _flat_end(points, triangles, -1.0, site.wetted_radius_board)
    points = (points - lower.point) @ _upright(-lower.normal).T
    upper = _flat_end(points, triangles, 1.0, site.wetted_radius_package)
    boundary = np.full(len(triangles), FREE, dtype=np.int32)
    boundary[lower.rows], boundary[upper.rows] = BOARD_PAD, PACKAGE_PAD
    planes = PadPlanes.fit(points, triangles[upper.rows])
    if abs(planes.gap / site.gap - 1.0) > GAP_RANGE:
        allowed = f"{(1.0 - GAP_RANGE) * site.gap:.4g} to {(1.0 + GAP_RANGE) * site.gap:.4g} m"
        raise SurfaceError(f"its flat ends are {planes.gap:.4g} m apart, allowed {allowed}")
    points[np.unique(triangles[lower.rows]), 2] = 0.0
    top = np.unique(triangles[upper.rows])
    points[top, 2] = planes.height(points[top, 0], points[top, 1])
    target = PadPlanes(site.gap, np.array(site.offset), site_slope(site))
    stretch = target.height(points[:, 0], points[:, 1]) / planes.height(points[:, 0], points[:, 1])
    points[:, 2] *= stretch
    surface = ClosedSurface(points, triangles.astype(np.int32), boundary)
    check_surface(surface)
    return surface


def site_slope(site: PadSite) -> np.ndarray:
    """Return the slopes dz/dx and dz/dy of the package's pad of a joint, shape (2,).

    Args:
        site: Positions of the pads, with the rotations of the package's pad about x and y [rad].
    """
    turn_x, turn_y = site.tilt
    angle = float(np.hypot(turn_x, turn_y))
    steep = np.tan(angle) / angle if angle else 1.0
    return steep * np.array([-turn_y, turn_x])


def _flat_end(points: np.ndarray, triangles: np.ndarray, upward: float, wetted_radius: float) -> _End:
    """Find the flat end that faces up (1) or down (-1).

    A plane is fitted to the triangles near the end that face this way, then repeatedly to the triangles in that plane;
    the largest connected piece of these is the flat end.
    """
    areas = area_vectors(points, triangles)
    sizes = np.linalg.norm(areas, axis=1)
    normals, centres = areas / sizes[:, None], points[triangles].mean(axis=1)
    height = float(np.ptp(points[:, 2]))
    end = upward * (upward * points[:, 2]).max()
    rows = np.flatnonzero((np.abs(centres[:, 2] - end) < 5.0 * FLAT * height) & (upward * normals[:, 2] > LEVEL))
    for _ in range(FITS):
        if not len(rows):
            break
        normal = areas[rows].sum(axis=0) / np.linalg.norm(areas[rows].sum(axis=0))
        point = sizes[rows] @ centres[rows] / sizes[rows].sum()
        off = np.abs((points[triangles] - point) @ normal).max(axis=1)
        flat = np.flatnonzero((off < FLAT * height) & (normals @ normal > LEVEL))
        rows = flat[pieces(triangles[flat])[0]] if len(flat) else flat
    radius = float(np.sqrt(sizes[rows].sum() / np.pi)) if len(rows) else 0.0
    if radius < SMALLEST_PAD * wetted_radius:
        side = "upper" if upward > 0.0 else "lower"
        allowed = f"allowed >= {SMALLEST_PAD * wetted_radius:.4g} m"
        raise SurfaceError(
            f"its {side} end, z = {end:.4g} m, is flat on a disc of radius {radius:.4g} m only, {allowed}"
        )
    return _End(normal, point, rows)


def _upright(normal: np.ndarray) -> np.ndarray:
    """Return the smallest rotation (3, 3) that takes a unit vector to the z axis (Rodrigues)."""
    axis, cosine = np.cross(normal, [0.0, 0.0, 1.0]), normal[2]
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + cross + cross @ cross / (1.0 + cosine)
