"""Pad table: position, wettable radii and gap of every joint."""

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
SMALLEST_RIM = 1.02  # ratio of pad and wetted radius; slivers of a thinner rim would limit the time step

Length = TypeVar("Length", float, np.ndarray)


@dataclass(frozen=True, slots=True)
class PadSite:
    """Positions and sizes of the two pads of a joint.

    Attributes:
        name: JEDEC name.
        row: Row, counted from 0.
        column: Column, counted from 0.
        x: Coordinate x of the centre of the pad on the board [m].
        y: Coordinate y of the centre of the pad on the board [m].
        gap: Height between the centres of both pads, copper to copper [m].
        wetted_radius_board: Radius that solder can wet on the board [m].
        wetted_radius_package: Radius that solder can wet on the package [m].
        pad_radius_board: Radius of the copper on the board [m].
        pad_radius_package: Radius of the copper on the package [m].
        z_board: Height of the copper's upper face above the board [m].
        offset: Centre of the package's pad in plan, relative to the board's [m].
        tilt: Rotation of the package's pad about the x and y axes through its centre [rad].
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
    """Return the JEDEC letters of a row of joints, counted from 0: A ... Y, AA ... AY, BA ..."""
    count = len(ROW_LETTERS)
    prefix = "" if row < count else ROW_LETTERS[row // count - 1]
    return prefix + ROW_LETTERS[row % count]


def joint_name(row: int, column: int) -> str:
    """Return the ball name of a row and column counted from 0, e.g. A1."""
    return f"{row_name(row)}{column + 1}"


def corner_axis(package: Package) -> tuple[float, float]:
    """Return the coordinates (x, y) of the axis of the joint at the array's corner, the largest ones [m].

    Args:
        package: Numbers of rows and columns, and pitch.
    """
    return 0.5 * (package.columns - 1) * package.pitch, 0.5 * (package.rows - 1) * package.pitch


def pad_table(package: Package, board: Board, warpage: Warpage) -> list[PadSite]:
    """List the joints of the array, row by row.

    Args:
        package: Array, pads and standoff of the package.
        board: Board; of a quarter model only joints at x > 0 and y > 0 are listed.
        warpage: Prescribed warpage of the package, which changes each gap and tilts the upper pads.

    Returns:
        Name, position, sizes, gap and tilt of each joint; depopulated joints are omitted.
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
    return lift_pads(sites, package, warpage)


def lift_pads(sites: Iterable[PadSite], package: Package, warpage: Warpage) -> list[PadSite]:
    """Return copies of pad sites with the gaps and tilts under a warpage of the package.

    Args:
        sites: Sites of undeformed joints; the warpage is added to their gaps and replaces their tilts.
        package: Package, whose outermost joints define the warpage.
        warpage: Prescribed warpage.
    """
    return [
        replace(
            site,
            gap=site.gap + float(lift(package, warpage, site.x, site.y)),
            tilt=_tilt(package, warpage, site.x, site.y),
        )
        for site in sites
    ]


def _tilt(package: Package, warpage: Warpage, x: float, y: float) -> tuple[float, float]:
    """Return the rotation vector (x, y) [rad] of a pad in the tangent plane of the lift w(x, y).

    It is the smallest rotation that turns the z axis into the surface normal (-w_x, -w_y, 1).
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
    """Return whether a copper pad is wide enough for a ring of elements beyond its wetted disc.

    Args:
        pad_radius: Radius of the copper [m].
        wetted_radius: Radius of the disc that solder wets [m].
    """
    return pad_radius > SMALLEST_RIM * wetted_radius


def lift(package: Package, warpage: Warpage, x: Length, y: Length) -> Length:
    """Return the lift of the package by warpage at (x, y), upwards positive; 0 for a single joint.

    Args:
        package: Package, whose outermost joints define the warpage.
        warpage: Prescribed warpage.
        x: First coordinate in plan, a scalar or an array [m].
        y: Second coordinate in plan, shaped as ``x`` [m].

    Returns:
        Lift, shaped as ``x`` [m].
    """
    corner_x, corner_y = corner_axis(package)
    if corner_x == corner_y == 0.0:
        return 0.0 * x
    return warpage.height(x, y, corner_x, corner_y)


def write_pads(path: Path, sites: Iterable[PadSite]) -> None:
    """Write pad sites as a JSON list with one object of all fields for each site, in SI units.

    Args:
        path: File to write; replaced if it exists.
        sites: Positions and sizes of the two pads of each joint.
    """
    path.write_text(json.dumps([asdict(site) for site in sites], indent=1) + "\n", encoding="utf-8")


def read_pads(path: Path) -> list[PadSite]:
    """Read the pad sites that ``write_pads`` wrote, in the order of the file.

    Returns:
        Name, row and column, position of both pads, gap, radii [m] and tilt of each joint.
    """
    pairs = ("offset", "tilt")
    return [
        PadSite(**record | {key: tuple(record[key]) for key in pairs})
        for record in json.loads(path.read_text(encoding="utf-8"))
    ]
