"""The pad table: where every joint sits, what solder can wet, and the gap that it bridges."""

import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from reflowshock.meshing.board.parameters import Board, Package, Warpage

# JEDEC JEP95 design guide 4.5: row letters skip those that look like digits or other letters.
ROW_LETTERS = "ABCDEFGHJKLMNPRTUVWY"
SMALLEST_RIM = 1.02  # pad over wetted radius; a thinner rim counts as wetted, its slivers would rule the time step

Length = TypeVar("Length", float, np.ndarray)


@dataclass(frozen=True, slots=True)
class PadSite:
    """One joint's place: its pads, the package's relative to the board's; in metres, row and column from 0.

    Attributes:
        name: JEDEC name.
        x, y: centre of the pad on the board.
        gap: height of the centre of the package's pad over that of the board's, copper to copper.
        z_board: height of the board's copper over the board.
        offset: x and y of the centre of the package's pad, seen from the board's.
        tilt: rotation vector of the package's pad about its centre: turns about the x and the y axis [rad].
    """

    name: str
    row: int
    column: int
    x: float
    y: float
    gap: float
    wetted_radius_board: float
    wetted_radius_package: float
    pad_radius_board: float
    pad_radius_package: float
    z_board: float
    offset: tuple[float, float] = (0.0, 0.0)
    tilt: tuple[float, float] = (0.0, 0.0)


def row_name(row: int) -> str:
    """Return the JEDEC letters of a row counted from 0: A ... Y, AA ... AY, BA ..."""
    count = len(ROW_LETTERS)
    prefix = "" if row < count else ROW_LETTERS[row // count - 1]
    return prefix + ROW_LETTERS[row % count]


def joint_name(row: int, column: int) -> str:
    """Return the ball name of a row and column counted from 0, e.g. A1."""
    return f"{row_name(row)}{column + 1}"


def corner_axis(package: Package) -> tuple[float, float]:
    """Return (x, y) of the outermost joint axis [m]."""
    return 0.5 * (package.columns - 1) * package.pitch, 0.5 * (package.rows - 1) * package.pitch


def pad_table(package: Package, board: Board, warpage: Warpage) -> list[PadSite]:
    """List the joints of the array, row by row.

    Args:
        package: array, pads, standoff.
        board: its symmetry decides whether only x > 0, y > 0 is kept.
        warpage: lift of the package, which widens or narrows each gap and tilts the pads above it.
    """
    corner = corner_axis(package)
    sites = []
    for row in range(package.rows):
        for column in range(package.columns):
            x = column * package.pitch - corner[0]
            y = corner[1] - row * package.pitch
            name = joint_name(row, column)
            if name in package.depopulated or (board.symmetry == "quarter" and (x < 0 or y < 0)):
                continue
            sites.append(PadSite(name, row, column, x, y, package.standoff, *_pad_sizes(package)))
    return lifted(sites, package, warpage)


def lifted(sites: Iterable[PadSite], package: Package, warpage: Warpage) -> list[PadSite]:
    """Return joints that are as drawn with the gaps and tilts that a warpage of the package gives them."""
    return [
        replace(
            site,
            gap=site.gap + float(lift(package, warpage, site.x, site.y)),
            tilt=_tilt(package, warpage, site.x, site.y),
        )
        for site in sites
    ]


def _tilt(package: Package, warpage: Warpage, x: float, y: float) -> tuple[float, float]:
    """Return the rotation vector (x, y) [rad] that lays a pad into the tangent plane of the lift w(x, y).

    Its normal is that of the surface, (-w_x, -w_y, 1), reached from the z axis by the smallest turn.
    """
    corner = corner_axis(package)
    if corner == (0.0, 0.0):
        return 0.0, 0.0
    slope_x, slope_y = warpage.slope(x, y, *corner)
    steepness = math.hypot(slope_x, slope_y)
    turn = math.atan(steepness) / steepness if steepness else 1.0
    return turn * slope_y, -turn * slope_x


def _pad_sizes(package: Package) -> tuple[float, float, float, float, float]:
    """Return wetted radii, radii of the copper (each board, package) and height of the board's copper [m]."""
    board, upper = package.board_pad, package.package_pad
    wetted = board.wetted_radius, upper.wetted_radius
    return *wetted, 0.5 * board.diameter, 0.5 * upper.diameter, package.copper.thickness


def has_rim(pad_radius: float, wetted_radius: float) -> bool:
    """Whether a copper pad is wide enough beyond the wetted disc for a ring of elements of its own."""
    return pad_radius > SMALLEST_RIM * wetted_radius


def lift(package: Package, warpage: Warpage, x: Length, y: Length) -> Length:
    """Return the warpage of the package at (x, y), scalars or arrays [m]; a single joint has none."""
    corner_x, corner_y = corner_axis(package)
    if corner_x == corner_y == 0.0:
        return 0.0 * x
    return warpage.height(x, y, corner_x, corner_y)


def write_pads(path: Path, sites: Iterable[PadSite]) -> None:
    """Write the pad table as JSON."""
    path.write_text(json.dumps([asdict(site) for site in sites], indent=1) + "\n", encoding="utf-8")


def read_pads(path: Path) -> list[PadSite]:
    """Read a pad table written by ``write_pads``."""
    pairs = ("offset", "tilt")
    return [
        PadSite(**record | {key: tuple(record[key]) for key in pairs})
        for record in json.loads(path.read_text(encoding="utf-8"))
    ]
