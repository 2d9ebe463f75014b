"""Board of a case from a layout: dimensions, mounting holes that can be meshed, components as lumped masses."""

import math
import re
from dataclasses import dataclass

from reflowshock.meshing.board.checks import hole_problems
from reflowshock.meshing.board.parameters import Board, Package
from reflowshock.units import from_si
from reflowshock.workflow.ecad.layout import Component, EcadError, Hole, Layout, Point, box_around, in_mm

BODY_HEIGHT, BODY_DENSITY = 1.0e-3, 2000.0  # m, kg/m^3: assumed for components
MIN_MASS = 5.0e-5  # kg: lighter components are left out
MAX_HOLES = 24
CENTRE_TOLERANCE = 1.0e-6  # m: a smaller offset of the board's centre counts as zero


@dataclass(frozen=True, slots=True)
class Mass:
    """Lumped mass that stands for a component.

    Attributes:
        name: Name of the table in the case.
        value: Value of the component in the file.
        mass: Mass with its unit.
        position: Coordinates, shape (3,) [m].
        footprint: Length and width [m].
    """

    name: str
    value: str
    mass: str
    position: tuple[float, float, float]
    footprint: Point


def board_table(board: Layout, thickness: float, holes: list[Hole]) -> dict:
    """Return the table ``[board]`` of a case file in SI units, without symmetry.

    Args:
        board: Board in the frame of the package.
        thickness: Thickness of the board [m].
        holes: Mounting holes.

    Returns:
        Keys of the table: ``length``, ``width``, ``thickness``, ``centre``, ``symmetry`` ("full") and ``holes``.
    """
    (x0, y0), (x1, y1) = board.low, board.high
    centre = tuple(0.0 if abs(value) < CENTRE_TOLERANCE else value for value in (0.5 * (x0 + x1), 0.5 * (y0 + y1)))
    return {
        "length": x1 - x0, "width": y1 - y0, "thickness": thickness, "centre": centre, "symmetry": "full",
        "holes": {"diameter": holes[0].diameter if holes else 1e-3, "at": [hole.at for hole in holes]},
    }  # fmt: skip


def mounting_holes(board: Layout, package: Package, thickness: float, least: float) -> tuple[list[Hole], list[str]]:
    """Select the mounting holes: the most frequent diameter, as far as they can be meshed.

    Args:
        board: Board in the frame of the package.
        package: Package that the holes must not touch.
        thickness: Thickness of the board [m].
        least: Smallest diameter of a mounting hole [m].

    Returns:
        Mounting holes, sorted by position, and notes on the holes that are left out.

    Raises:
        EcadError: Fewer than two holes remain.
    """
    wide = [hole for hole in board.holes if hole.diameter >= least]
    sizes = [round(hole.diameter, 7) for hole in wide]
    if not sizes:
        message = f"the board has no hole of {in_mm(least)} or more to mount it"
        raise EcadError(board.path, f"{message}; try another smallest diameter with --holes")
    usual = max(set(sizes), key=lambda size: (sizes.count(size), size))
    chosen: list[Hole] = []
    for hole in sorted(wide, key=lambda hole: -math.hypot(*hole.at)):
        if (
            round(hole.diameter, 7) == usual
            and len(chosen) < MAX_HOLES
            and _can_be_meshed(chosen, hole, board, package, thickness)
        ):
            chosen.append(hole)
    if len(chosen) < 2 or math.dist(chosen[0].at, chosen[-1].at) == 0.0:
        message = f"the board has no two mounting holes of {in_mm(usual)} outside the package along both axes"
        raise EcadError(board.path, f"{message}; try another smallest diameter with --holes")
    left_out = [hole for hole in wide if hole not in chosen]
    listed = ", ".join(f"{in_mm(hole.diameter)} at ({in_mm(hole.at[0])}, {in_mm(hole.at[1])})" for hole in left_out[:8])
    more = f" and {len(left_out) - 8} more" if len(left_out) > 8 else ""
    note = f"holes left out (other diameter, under the package, or too close to others): {listed}{more}"
    return sorted(chosen, key=lambda hole: hole.at), [note] if left_out else []


def _can_be_meshed(chosen: list[Hole], hole: Hole, board: Layout, package: Package, thickness: float) -> bool:
    """Return whether a hole can be meshed with the chosen ones; the board may still rotate about them."""
    trial = Board.model_validate(board_table(board, thickness, [*chosen, hole]))
    return not any(hole_problems(package, trial))


def lumped_masses(board: Layout, package: str, thickness: float) -> tuple[list[Mass], list[str]]:
    """Return all components except the package as lumped masses, and a note on those that are left out.

    Args:
        board: Board in the frame of the package.
        package: Reference of the package.
        thickness: Thickness of the board [m].

    Returns:
        Masses with names that are valid in TOML, and a list of at most one note.
    """
    masses: list[Mass] = []
    left_out = []
    for name, item in board.components.items():
        sides = _body_size(item)
        mass = BODY_DENSITY * BODY_HEIGHT * sides[0] * sides[1]
        if name == package or mass == 0.0:
            continue
        inside = all(low + 0.5 * side < at < high - 0.5 * side for low, at, high, side in zip(
            board.low, item.centre, board.high, sides, strict=True))  # fmt: skip
        if mass < MIN_MASS or not inside:
            left_out.append(mass)
            continue
        at = (*item.centre, 0.0 if item.side == "top" else -thickness)
        masses.append(Mass(_table_name(name), item.value, from_si(mass, "g", 3), at, sides))
    total = from_si(sum(left_out), "g", 3)
    note = f"{len(left_out)} components that are light or overhang the board are left out (about {total} in total)"
    return masses, [note] if left_out else []


def _body_size(item: Component) -> Point:
    """Return length and width of the body of a component, or else of the box around its pads [m]."""
    if item.body is not None:
        return item.body
    (x0, y0), (x1, y1) = box_around([pad.at for pad in item.pads])
    widest = max(pad.diameter for pad in item.pads)
    return x1 - x0 + widest, y1 - y0 + widest


def _table_name(reference: str) -> str:
    """Return a component reference as a valid name of a TOML table."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", reference)
    return name if name[:1].isalpha() else f"part{name}"
