"""What of a layout is fitted to the board of a case: mounting holes that can be meshed, other components as masses."""

import math
import re
from dataclasses import dataclass

from reflowshock.meshing.board.checks import problems
from reflowshock.meshing.board.parameters import Board, Package, Warpage
from reflowshock.units import from_si
from reflowshock.workflow.ecad.layout import Component, EcadError, Hole, Layout, Point, box_around, in_mm

BODY_HEIGHT, BODY_DENSITY = 1.0e-3, 2000.0  # of components whose mass nobody gave: m, kg/m^3
LEAST_MASS = 5.0e-5  # kg: lighter components are left out
MOST_HOLES = 24
SYMMETRIC = 1.0e-6  # m


@dataclass(frozen=True, slots=True)
class Mass:
    """A component as a lumped mass: its name in the case, its value in the file, mass, place and sides in m."""

    name: str
    value: str
    mass: str
    at: tuple[float, float, float]
    footprint: Point


def board_table(board: Layout, thickness: float, holes: list[Hole]) -> dict:
    """Return the table of the board in SI."""
    (x0, y0), (x1, y1) = board.low, board.high
    centre = tuple(0.0 if abs(value) < SYMMETRIC else value for value in (0.5 * (x0 + x1), 0.5 * (y0 + y1)))
    return {
        "length": x1 - x0, "width": y1 - y0, "thickness": thickness, "centre": centre, "symmetry": "full",
        "holes": {"diameter": holes[0].diameter if holes else 1e-3, "at": [hole.at for hole in holes]},
    }  # fmt: skip


def mounting_holes(board: Layout, package: Package, thickness: float, least: float) -> tuple[list[Hole], list[str]]:
    """Return the mounting holes that can be meshed, of the diameter that most of them have, and notes on the others."""
    wide = [hole for hole in board.holes if hole.diameter >= least]
    sizes = [round(hole.diameter, 7) for hole in wide]
    if not sizes:
        message = f"has no hole of {in_mm(least)} or more to mount it by"
        raise EcadError(board.path, f"{message}; --holes gives another smallest diameter")
    usual = max(set(sizes), key=lambda size: (sizes.count(size), size))
    taken: list[Hole] = []
    for hole in sorted(wide, key=lambda hole: -math.hypot(*hole.at)):
        if (
            round(hole.diameter, 7) == usual
            and len(taken) < MOST_HOLES
            and _can_be(taken, hole, board, package, thickness)
        ):
            taken.append(hole)
    if len(taken) < 2 or math.dist(taken[0].at, taken[-1].at) == 0.0:
        message = f"has no two mounting holes of {in_mm(usual)} beside the package along both axes"
        raise EcadError(board.path, f"{message}; --holes gives another smallest diameter")
    others = [hole for hole in wide if hole not in taken]
    told = ", ".join(f"{in_mm(hole.diameter)} at ({in_mm(hole.at[0])}, {in_mm(hole.at[1])})" for hole in others[:8])
    more = f" and {len(others) - 8} more" if len(others) > 8 else ""
    note = f"holes that are left out, of another diameter, beside the package or too near to others: {told}{more}"
    return sorted(taken, key=lambda hole: hole.at), [note] if others else []


def _can_be(taken: list[Hole], hole: Hole, board: Layout, package: Package, thickness: float) -> bool:
    """Whether a hole can be meshed beside those that are taken; one alone is not enough, but no reason."""
    trial = Board.model_validate(board_table(board, thickness, [*taken, hole]))
    found = [problem for problem in problems(package, trial, Warpage()) if problem.key.startswith("board.holes")]
    return all("turn about" in problem.message for problem in found)


def masses_of(board: Layout, package: str, thickness: float) -> tuple[list[Mass], list[str]]:
    """Return the other components as lumped masses, and notes on those that are left out."""
    found: list[Mass] = []
    light = []
    for name, item in board.components.items():
        sides = _size(item)
        mass = BODY_DENSITY * BODY_HEIGHT * sides[0] * sides[1]
        if name == package or mass == 0.0:
            continue
        inside = all(low + 0.5 * side < at < high - 0.5 * side for low, at, high, side in zip(
            board.low, item.centre, board.high, sides, strict=True))  # fmt: skip
        if mass < LEAST_MASS or not inside:
            light.append(mass)
            continue
        at = (*item.centre, 0.0 if item.side == "top" else -thickness)
        found.append(Mass(_table_name(name), item.value, from_si(mass, "g", 3), at, sides))
    total = from_si(sum(light), "g", 3)
    note = f"{len(light)} components that are light or reach beyond the board are left out (together about {total})"
    return found, [note] if light else []


def _size(item: Component) -> Point:
    """Return length and width [m] of a component: of its body, else of the box around its pads."""
    if item.body is not None:
        return item.body
    (x0, y0), (x1, y1) = box_around([pad.at for pad in item.pads])
    widest = max(pad.diameter for pad in item.pads)
    return x1 - x0 + widest, y1 - y0 + widest


def _table_name(reference: str) -> str:
    """Return a reference as the name of a table."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", reference)
    return name if name[:1].isalpha() else f"part{name}"
