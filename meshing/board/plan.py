"""Plan view of board and package: intervals along x and y, shared by the mesh and by its estimate."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from reflowshock.meshing.board.parameters import Board, BoardNumerics, Imprint, Package

MOST_LINES = 100_000
MIDDLE = 1.0e-8  # m: how far the middle of a block may lie from its hole
BESIDE = 0.5  # of the distance of holes that are not in line: what the side of their squares is reckoned from
SAME = 1.0e-6  # of a column: distance of lines that are one
WIDEST_SQUARE = 1.6  # of a hole's distance from the edge: the side of the square around it


@dataclass(frozen=True, slots=True)
class Interval:
    """A piece [start, end] [m] of an axis in ``cells``, each ``ratio`` times as long as the one before."""

    start: float
    end: float
    cells: int
    ratio: float = 1.0

    def smallest(self) -> float:
        """Length of the shortest cell [m]; the lines of more than are ever meshed are not laid out."""
        if self.cells <= MOST_LINES:
            return float(np.diff(self.lines()).min())
        ratio = max(self.ratio, 1.0 / self.ratio)
        share = 1.0 / self.cells if ratio == 1.0 else math.exp(-self.cells * math.log(ratio)) * (ratio - 1.0)
        return (self.end - self.start) * share

    def lines(self) -> np.ndarray:
        """Grid lines from start to end, (cells + 1,) [m]."""
        lengths = self.ratio ** np.arange(self.cells)
        return self.start + (self.end - self.start) * np.concatenate([[0.0], lengths.cumsum()]) / lengths.sum()

    def mirrored(self) -> "Interval":
        """The interval reflected at the origin."""
        return Interval(-self.end, -self.start, self.cells, 1.0 / self.ratio)


@dataclass(frozen=True, slots=True)
class Plan:
    """Intervals along both axes; ``holes`` are the blocks (i, j) that mounting holes occupy."""

    x: tuple[Interval, ...]
    y: tuple[Interval, ...]
    holes: frozenset[tuple[int, int]] = frozenset()


def board_plan(package: Package, board: Board) -> Plan:
    """Cut the board: footprint, margin, graded, coarse, around the holes.

    The footprint of the package lies on grid lines, and the margin of the meso model's patch on the next ones.
    """
    numerics, square = board.numerics, hole_square(board)
    half = (0.5 * package.substrate.length, 0.5 * package.substrate.width)
    axes = []
    for footprint, count, (low, high), holes in zip(half, _joints(package), board.ends, board.hole_lines, strict=True):
        inner = _under_joints(package, count, (footprint,), numerics.element_size)
        axis = _board_axis(inner, high, [place for place in holes if place > 0.0], square, numerics)
        if board.symmetry == "full":
            below = _board_axis(inner, -low, [-place for place in reversed(holes) if place < 0.0], square, numerics)
            axis = [*_both_sides(below, axis)]
        axes.append(tuple(axis))
    return Plan(axes[0], axes[1], blocks_at(board.hole_places, *axes))


def blocks_at(
    places: Iterable[tuple[float, float]], x: tuple[Interval, ...], y: tuple[Interval, ...]
) -> frozenset[tuple[int, int]]:
    """Return the blocks in whose middle places [m] lie; places that are not meshed are in none."""
    columns, rows = ([0.5 * (part.start + part.end) for part in axis] for axis in (x, y))
    return frozenset(
        (i, j)
        for i, a in enumerate(columns)
        for j, b in enumerate(rows)
        if any(math.dist((a, b), place) <= MIDDLE for place in places)
    )


def package_plan(package: Package, board: Board) -> Plan:
    """Cut the package so that the edges of the die lie on grid lines."""
    x, y = package_axes(package)
    return Plan(x, y) if board.symmetry == "quarter" else Plan(_both_sides(x, x), _both_sides(y, y))


def package_axes(package: Package) -> tuple[tuple[Interval, ...], tuple[Interval, ...]]:
    """Cut the positive halves of the package's axes: under the die, and what of the substrate it leaves free."""
    size, die, substrate = package.numerics.element_size, package.die, package.substrate
    edges = (
        _distinct(0.5 * die.length, 0.5 * substrate.length),
        _distinct(0.5 * die.width, 0.5 * substrate.width),
    )
    x, y = (tuple(_under_joints(package, *axis, size)) for axis in zip(_joints(package), edges, strict=True))
    return x, y


def hole_square(board: Board) -> float:
    """Side of the square around a mounting hole that is meshed as an O-grid [m]; alike for all of them."""
    gaps = [math.inf]
    for (low, high), places in zip(board.ends, board.hole_lines, strict=True):
        gaps += [places[0] - low, high - places[-1]] if places else []
        gaps += [BESIDE * (second - first) for first, second in pairwise(places)]
    return square_around(board.holes.diameter, min(gaps))


def square_around(diameter: float, inset: float) -> float:
    """Side of the square around a hole [m]: twice the diameter, if that fits between hole and edge."""
    return min(2.0 * diameter, WIDEST_SQUARE * inset)


def uniform(start: float, end: float, size: float) -> Interval:
    """An interval of equal cells, as near to ``size`` as divides it."""
    return Interval(start, end, max(1, round((end - start) / size)))


def hole_rings(board: Board) -> int:
    """Number of cells between a mounting hole and the edge of its square."""
    ring = 0.5 * (hole_square(board) - board.holes.diameter)
    return max(1, round(ring / board.numerics.coarse_size))


def column_levels(thickness: float, boxes: int, imprint: Imprint) -> np.ndarray:
    """Return depths (layers + 1,) [m] from a pad's face at which a column's layers meet, with the planes of the boxes.

    The height h of a layer at depth z is first_layer + (growth - 1) z, less what makes the layers of a box fit.
    """
    slope = imprint.growth - 1.0
    depths = [0.0]
    for low, high in pairwise((thickness * np.arange(boxes + 1) / boxes).tolist()):
        start, end = (math.log(imprint.first_layer + slope * depth) for depth in (low, high))
        count = max(1, math.ceil((end - start) / slope - SAME))
        inner = np.exp(start + (end - start) * np.arange(1, count) / count)
        depths += [*((inner - imprint.first_layer) / slope).tolist(), high]
    return np.array(depths)


def blocks_within(plan: Plan, length: float, width: float) -> set[tuple[int, int]]:
    """Blocks (i, j) of the plan that lie inside a centred rectangle [m]."""
    columns = _within(plan.x, 0.5 * length)
    rows = _within(plan.y, 0.5 * width)
    return {(i, j) for i in columns for j in rows}


def footprint(plan: Plan, package: Package) -> set[tuple[int, int]]:
    """Blocks of the board's plan that lie under the package."""
    return blocks_within(plan, package.substrate.length, package.substrate.width)


def patch(plan: Plan, package: Package) -> set[tuple[int, int]]:
    """Blocks of the board's plan that lie under the package or in the margin around it."""
    inside = footprint(plan, package)
    columns, rows = ({block[axis] for block in inside} for axis in (0, 1))
    return {(i, j) for i in _widened(columns) for j in _widened(rows)}


def _within(axis: tuple[Interval, ...], limit: float) -> set[int]:
    return {index for index, part in enumerate(axis) if max(abs(part.start), abs(part.end)) <= limit * (1.0 + 1e-9)}


def _widened(indices: set[int]) -> range:
    return range(max(min(indices) - 1, 0), max(indices) + 2)


def _distinct(die: float, substrate: float) -> tuple[float, ...]:
    """Return the edges of die and substrate; what rounding leaves between them is no block."""
    return (substrate,) if math.isclose(die, substrate, rel_tol=1.0e-9) else (die, substrate)


def _joints(package: Package) -> tuple[int, int]:
    return package.columns, package.rows


def _under_joints(package: Package, count: int, edges: tuple[float, ...], size: float) -> list[Interval]:
    """Cut the positive half of an axis at the edges of parts, and of the columns of its ``count`` joints, if any."""
    breaks, column = {0.0, *edges}, package.column_size
    if column is not None:
        centres = package.pitch * (np.arange(count) - 0.5 * (count - 1))
        beside = np.concatenate([centres - 0.5 * column, centres + 0.5 * column])
        for place in beside[(beside > 0.0) & (beside < edges[-1])].tolist():
            if min(abs(place - other) for other in breaks) > SAME * column:
                breaks.add(place)
    return [uniform(start, end, size) for start, end in pairwise(sorted(breaks))]


def _board_axis(
    inner: list[Interval], end: float, holes: list[float], square: float, numerics: BoardNumerics
) -> list[Interval]:
    """Cut an axis from the origin to an end of the board [m], with squares around holes at places [m]."""
    last, footprint = inner[-1], inner[-1].end
    size = (last.end - last.start) / last.cells
    margin = Interval(footprint, footprint + numerics.patch_margin * size, numerics.patch_margin)
    axis = [*inner, margin]
    for hole in holes:
        low, high = hole - 0.5 * square, hole + 0.5 * square
        axis += (
            _outward(axis[-1].end, low, size, numerics) if axis[-1] is margin else _coarse(axis[-1].end, low, numerics)
        )
        axis += _coarse(low, high, numerics)
        axis[-1] = replace(axis[-1], cells=max(2, axis[-1].cells))
    return axis + (_coarse(axis[-1].end, end, numerics) if holes else _outward(margin.end, end, size, numerics))


def _coarse(start: float, end: float, numerics: BoardNumerics) -> list[Interval]:
    return [uniform(start, end, numerics.coarse_size)]


def _outward(start: float, end: float, size: float, numerics: BoardNumerics) -> list[Interval]:
    """Grow the cells from ``size`` to the coarse size, then keep it."""
    coarse, ratio = numerics.coarse_size, numerics.growth
    cells = max(1, math.ceil(math.log(coarse / size) / math.log(ratio)))
    grown = size * sum(ratio**k for k in range(1, cells + 1))
    if start + grown >= end - coarse:
        fitting = max(1, math.floor(math.log(1.0 + (end - start) * (ratio - 1.0) / (size * ratio)) / math.log(ratio)))
        return [Interval(start, end, fitting, ratio)]
    return [Interval(start, start + grown, cells, ratio), uniform(start + grown, end, coarse)]


def _both_sides(below: Sequence[Interval], above: Sequence[Interval]) -> tuple[Interval, ...]:
    """Join two axes that begin at the origin, the first one reflected at it."""
    return (*(part.mirrored() for part in reversed(below)), *above)
