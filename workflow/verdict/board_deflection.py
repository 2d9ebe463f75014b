"""Deflection of the board by Steinberg's rule of thumb, for a shock.

In inches, a component survives 20 million cycles of vibration if the 3-sigma deflection of the board's centre is below
Z = 0.00022 B / (C h r sqrt(L)), and a shock if its peak is below 6 Z. B is the edge of the board along the component,
L the component's length along this edge, h the thickness of the board, C a constant of the component's type, and r the
first mode's shape at the component: 1 at the centre, 0.707 or 0.5 at the quarter points of one or both axes.

The deflection is the peak relative to the drop table, to which the supports are fixed. A deflection recorded below the
component already contains the mode's shape, so r = 1 there; r < 1 only compares another component with the deflection
of the board's centre.
"""

import math
from dataclasses import dataclass

import numpy as np

from reflowshock.fem.output.ranking import Arrays
from reflowshock.fem.problem.failure import Component
from reflowshock.meshing.board.parameters import Board
from reflowshock.workflow.board_drop.duration import bending_axis
from reflowshock.workflow.board_drop.fittings import spans
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.report.histories import peaks_late
from reflowshock.workflow.verdict.criterion import Criterion, JudgedDrop, Judgement, length_text, margin_text

INCH = 0.0254  # [m]
SHOCK = 6.0  # 3 for the number of cycles, 2 without stress concentration
CONSTANTS: dict[Component, float] = {
    "axial": 0.75, "dip": 1.0, "pga": 1.0, "pga_two_rows": 1.26, "side_brazed": 1.26, "bga": 1.75, "leadless": 2.25,
}  # fmt: skip
EDGES = ("length", "width")
CENTRED = 0.01  # offset of a package that counts as centred, over the distance between holes
SOURCE = (
    "D. S. Steinberg, Vibration Analysis for Electronic Equipment, 3rd edition (Wiley, 2000), equation 11.23; formula"
    " and constants checked in T. Irvine's toolbox (github.com/nkatsinas/vibrationdata_matlab, circuit_board_fatigue.m)"
    " and in reading notes of the book (github.com/natecostello/python-test-repo, steinberg.ipynb)"
)


@dataclass(frozen=True, slots=True)
class Seat:
    """Component on a board.

    Attributes:
        name: Name in messages.
        sides: Length along x and along y [m].
        factor: Position factor r of the deflection that it is compared with.
    """

    name: str
    sides: tuple[float, float]
    factor: float = 1.0


def allowed_deflection(board: Board, seat: Seat, axis: int, constant: float) -> float:
    """Return the peak deflection [m] of the board that a component survives in a shock, by Steinberg's rule.

    Args:
        board: Board with its edges and thickness.
        seat: Component with its sides [m] and its position factor.
        axis: Axis of the edge B and of the length L, 0 for x or 1 for y.
        constant: Constant C of the type of component.
    """
    edge = (board.length, board.width)[axis]
    root = math.sqrt(seat.sides[axis] / INCH)
    return SHOCK * 0.00022 * INCH * edge / (constant * board.thickness * seat.factor * root)


def position_factor(board: Board, at: tuple[float, float]) -> float | None:
    """Return Steinberg's factor r = sin(pi x / a) sin(pi y / b) at a position between the outermost mounting holes.

    a and b are the distances of these holes along x and y, and x and y are measured from the first of them.

    Args:
        board: Board with its mounting holes.
        at: Coordinates (x, y) of the component on the board [m].

    Returns:
        Factor, at most 1; None for a position that is not between the holes.
    """
    shares = [
        (place - lines[0]) / span for place, lines, span in zip(at, board.hole_lines, spans(board), strict=True) if span
    ]
    if len(shares) < 2 or not all(0.0 < share < 1.0 for share in shares):
        return None
    return math.prod(math.sin(math.pi * share) for share in shares)


def deflection(history: Arrays) -> np.ndarray:
    """Return the deflection of the board below the package since the start, without sign, shape (times,) [m].

    Args:
        history: Arrays of ``history.npz``; ``board_centre``, shape (times, 3) [m] relative to the drop table, is read.
    """
    height = history["board_centre"][:, 2]
    return np.abs(height - height[0])


class BoardDeflection(Criterion):
    """Peak deflection of the board in its first mode; a rule of thumb for rectangular boards."""

    name = "board_deflection"
    words = "board deflection"
    formula = "peak deflection <= 6 x 0.00022 B / (C h r sqrt(L)) in inches"
    valid = "rectangular boards on rigid supports in their first mode"
    label = "Steinberg 2000"

    def judge(self, drop: JudgedDrop) -> Judgement:
        """Judge the component with the smallest margin: the package, or a further package at its position."""
        parameters, swing = drop.failure.board_deflection, deflection(drop.history)
        value = float(swing.max())
        axis = bending_axis(drop.case) if parameters.along == "auto" else EDGES.index(parameters.along)
        constant, board = CONSTANTS[parameters.component], drop.case.board
        by_seat = {seat: allowed_deflection(board, seat, axis, constant) for seat in seats(drop.case)}
        seat, limit = min(by_seat.items(), key=lambda item: item[1])
        if why := self._excluded(drop, swing, value > limit):
            return Judgement(self.name, value=value, unit="m", why=why)
        across = allowed_deflection(board, seat, 1 - axis, constant) / value if value > 0.0 else None
        numbers = (
            _numbers(drop.case, seat, axis) + f", C = {constant:g} ({parameters.component}), r = {seat.factor:.3g}"
        )
        return Judgement(self.name, SOURCE, value, limit, "m", numbers + _across(drop.case, axis, across))

    def _excluded(self, drop: JudgedDrop, swing: np.ndarray, exceeds: bool) -> str:
        """Return why the criterion does not apply; empty if it does."""
        switch = drop.failure.board_deflection.apply
        if switch == "off":
            return "shock.failure.board_deflection.apply = off"
        if switch == "on":
            return ""
        if any(support.bedding or "z" not in support.hold for support in drop.case.supports.values()):
            return "a support lets the board move as a whole along z; the rule is for boards on rigid supports"
        if peaks_late(swing) and not exceeds:
            end = 1e3 * float(drop.history["time"][-1])
            return f"the deflection, {length_text(float(swing.max()))}, still grows at the end of the run, {end:.3g} ms"
        return ""


def seats(case: BoardDropCase) -> list[Seat]:
    """Return the components whose survival can be judged by the deflection of the board below the package.

    These are the package and the further packages. Their position factors need the deflection of the board's centre, so
    the others are compared only if the package is there, and only between the holes.

    Args:
        case: Case of a board drop.

    Returns:
        Name, sides along x and y [m] and position factor of each component, the package first.
    """
    substrate, board = case.package.substrate, case.board
    judged = [Seat("the package", (substrate.length, substrate.width))]
    offsets = (abs(offset) / span for offset, span in zip(board.centre, spans(board), strict=True) if span)
    if any(offset > CENTRED for offset in offsets):
        return judged
    for name, item in case.packages.items():
        factor = position_factor(board, item.at)
        if factor is not None:
            judged.append(Seat(f"packages.{name}", (item.substrate[0], item.substrate[1]), factor))
    return judged


def _numbers(case: BoardDropCase, seat: Seat, axis: int) -> str:
    """Return the lengths of the formula in words."""
    board, chosen = case.board, case.shock.failure.board_deflection.along != "auto"
    edge = f"{length_text((board.length, board.width)[axis])}, the board's {EDGES[axis]}"
    reason = "" if chosen else " (holes farther apart)"
    length, thickness = length_text(seat.sides[axis]), length_text(board.thickness)
    return f"{seat.name}: B = {edge}{reason}, L = {length}, h = {thickness}"


def _across(case: BoardDropCase, axis: int, margin: float | None) -> str:
    """Return the margin with the other edge of the board as B, in words; empty without deflection."""
    if margin is None:
        return ""
    edge = (case.board.length, case.board.width)[1 - axis]
    return f"; margin {margin_text(margin)} with B = {length_text(edge)}, the board's {EDGES[1 - axis]}"
