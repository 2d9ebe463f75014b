"""Plan view of board and package: intervals along x and y, used by the mesh and by its estimate."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from reflowshock.meshing.board.parameters import Board, BoardNumerics, Imprint, Package

MOST_LINES = 100_000
MIDDLE = 1.0e-8  # m: largest distance between a hole and the centre of its block
HALF_DISTANCE = 0.5  # of two holes that are not in line: room for the square around each
SAME = 1.0e-6  # of a column: lines at a smaller distance coincide
WIDEST_SQUARE = 1.6  # largest side of the square around a hole, over the hole's distance from the edge


@dataclass(frozen=True, slots=True)
class Interval:
    """Interval of an axis with geometrically graded cells.

    Attributes:
        start: Start of the interval [m].
        end: End of the interval [m].
        cells: Number of cells.
        ratio: Ratio of the lengths of successive cells.
    """

    start: float
    end: float
    cells: int
    ratio: float = 1.0

    def smallest(self) -> float:
        """Return the length of the shortest cell [m], by a formula if there are more cells than are ever meshed."""
        if self.cells <= MOST_LINES:
            return float(np.diff(self.lines()).min())
        ratio = max(self.ratio, 1.0 / self.ratio)
        share = 1.0 / self.cells if ratio == 1.0 else math.exp(-self.cells * math.log(ratio)) * (ratio - 1.0)
        return (self.end - self.start) * share

    def lines(self) -> np.ndarray:
        """Return the grid lines from start to end, shape (cells + 1,) [m]."""
        lengths = self.ratio ** np.arange(self.cells)
        return self.start + (self.end - self.start) * np.concatenate([[0.0], lengths.cumsum()]) / lengths.sum()

    def mirrored(self) -> "Interval":
        """Return the interval reflected at the origin."""
        return Interval(-self.end, -self.start, self.cells, 1.0 / self.ratio)


@dataclass(frozen=True, slots=True)
class Plan:
    """Intervals along both axes, which divide the plan into blocks (i, j); ``holes`` are the blocks with a hole."""

    x: tuple[Interval, ...]
    y: tuple[Interval, ...]
    holes: frozenset[tuple[int, int]] = frozenset()


def board_plan(package: Package, board: Board) -> Plan:
    """Divide the board into footprint, margin, graded and coarse intervals along x and y, and squares around the holes.

    Blocks (i, j) are formed by interval i along x and j along y. Grid lines follow the footprint of the package and the
    margin of the meso model's patch. With quarter symmetry only the positive halves of the axes are divided.

    Args:
        package: Sizes of substrate and die, which give the footprint, and element size.
        board: Sizes, holes, symmetry, element sizes and margin.

    Returns:
        Intervals along x and y, and the blocks with a mounting hole.
    """
    numerics, square = board.numerics, hole_square(board)
    half = (0.5 * package.substrate.length, 0.5 * package.substrate.width)
    axes = []
    for footprint, count, (low, high), holes in zip(half, _joints(package), board.ends, board.hole_lines, strict=True):
        inner = _under_joints(package, count, (footprint,), numerics.element_size)
        axis = _board_axis(inner, high, [hole for hole in holes if hole > 0.0], square, numerics)
        if board.symmetry == "full":
            below = _board_axis(inner, -low, [-hole for hole in reversed(holes) if hole < 0.0], square, numerics)
            axis = [*_both_sides(below, axis)]
        axes.append(tuple(axis))
    return Plan(axes[0], axes[1], blocks_at(board.hole_places, *axes))


def blocks_at(
    centres: Iterable[tuple[float, float]], x: tuple[Interval, ...], y: tuple[Interval, ...]
) -> frozenset[tuple[int, int]]:
    """Return the blocks whose centres are among given points; points outside the mesh are ignored.

    Args:
        centres: Points (x, y) [m].
        x: Intervals along x.
        y: Intervals along y.

    Returns:
        Indices (i, j) of the blocks: interval i along x and interval j along y.
    """
    columns, rows = ([0.5 * (part.start + part.end) for part in axis] for axis in (x, y))
    return frozenset(
        (i, j)
        for i, a in enumerate(columns)
        for j, b in enumerate(rows)
        if any(math.dist((a, b), centre) <= MIDDLE for centre in centres)
    )


def package_plan(package: Package, board: Board) -> Plan:
    """Divide the package into intervals along x and y, with the edges of the die on grid lines.

    With a quarter model of the board only the positive halves are returned. The plan has no holes.

    Args:
        package: Substrate, die and sizes of the elements.
        board: Board, whose symmetry (full or quarter) is used.
    """
    x, y = package_axes(package)
    return Plan(x, y) if board.symmetry == "quarter" else Plan(_both_sides(x, x), _both_sides(y, y))


def package_axes(package: Package) -> tuple[tuple[Interval, ...], tuple[Interval, ...]]:
    """Divide the positive halves of the package's axes at the edges of the die, if it is smaller than the substrate.

    Args:
        package: Substrate, die and sizes of the elements.

    Returns:
        Intervals with graded cells along x and along y, from the centre to the edge of the substrate.
    """
    size, die, substrate = package.numerics.element_size, package.die, package.substrate
    edges = (
        _distinct(0.5 * die.length, 0.5 * substrate.length),
        _distinct(0.5 * die.width, 0.5 * substrate.width),
    )
    x, y = (tuple(_under_joints(package, *axis, size)) for axis in zip(_joints(package), edges, strict=True))
    return x, y


def hole_square(board: Board) -> float:
    """Return the side of the squares around mounting holes that are meshed as O-grids, equal for all holes [m].

    Args:
        board: Diameter of the holes, and their distance from the nearest edge, which limits the squares.
    """
    gaps = [math.inf]
    for (low, high), places in zip(board.ends, board.hole_lines, strict=True):
        gaps += [places[0] - low, high - places[-1]] if places else []
        gaps += [HALF_DISTANCE * (second - first) for first, second in pairwise(places)]
    return square_around(board.holes.diameter, min(gaps))


def square_around(diameter: float, inset: float) -> float:
    """Return the side of the square around a hole [m]: twice the diameter, or less if the edge is near.

    Args:
        diameter: Diameter of the hole [m].
        inset: Distance from the centre of the hole to the nearest edge [m].
    """
    return min(2.0 * diameter, WIDEST_SQUARE * inset)


def uniform(start: float, end: float, size: float) -> Interval:
    """Return an interval of an axis that is divided into equal cells, for a plan of blocks.

    Args:
        start: Start of the interval [m].
        end: End of the interval [m].
        size: Target length of a cell [m]; the number of cells is rounded and at least one.
    """
    return Interval(start, end, max(1, round((end - start) / size)))


def hole_rings(board: Board) -> int:
    """Return the number of cells, in radial direction, between a mounting hole and the edge of its square.

    Args:
        board: Diameter of the holes, their squares and the element size.
    """
    ring = 0.5 * (hole_square(board) - board.holes.diameter)
    return max(1, round(ring / board.numerics.coarse_size))


def column_levels(thickness: float, boxes: int, imprint: Imprint) -> np.ndarray:
    """Return the depths of the layers of the column below or above an imprinted pad, shape (layers + 1,) [m].

    The depths from the pad's face begin with 0 and end with the thickness; they include the planes between the boxes of
    the surrounding mesh. A layer at depth z has the height h = first_layer + (growth - 1) z, reduced so that a whole
    number of layers fits into each box.

    Args:
        thickness: Thickness of board or substrate [m].
        boxes: Number of boxes through that thickness.
        imprint: Parameters of the column: height of its first layer [m] and growth of the others.
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
    """Return the blocks of a plan that lie inside a rectangle centred at the origin.

    Args:
        plan: Intervals along x and y.
        length: Size of the rectangle along x [m].
        width: Size of the rectangle along y [m].

    Returns:
        Indices (i, j) of the blocks along x and y.
    """
    columns = _within(plan.x, 0.5 * length)
    rows = _within(plan.y, 0.5 * width)
    return {(i, j) for i in columns for j in rows}


def footprint(plan: Plan, package: Package) -> set[tuple[int, int]]:
    """Return the blocks of the board's plan under the package, as indices of intervals (i along x, j along y).

    Args:
        plan: Intervals of the board along x and y, as ``board_plan`` returns them.
        package: Package, whose substrate covers the blocks.
    """
    return blocks_within(plan, package.substrate.length, package.substrate.width)


def patch(plan: Plan, package: Package) -> set[tuple[int, int]]:
    """Return the blocks of the board's plan under the package or in the margin around it, the patch of the meso model.

    Args:
        plan: Intervals of the board along x and y, as ``board_plan`` returns them.
        package: Package, whose substrate covers the blocks.

    Returns:
        Indices (i along x, j along y) of the blocks.
    """
    inside = footprint(plan, package)
    columns, rows = ({block[axis] for block in inside} for axis in (0, 1))
    return {(i, j) for i in _widened(columns) for j in _widened(rows)}


def _within(axis: tuple[Interval, ...], limit: float) -> set[int]:
    return {index for index, part in enumerate(axis) if max(abs(part.start), abs(part.end)) <= limit * (1.0 + 1e-9)}


def _widened(indices: set[int]) -> range:
    return range(max(min(indices) - 1, 0), max(indices) + 2)


def _distinct(die: float, substrate: float) -> tuple[float, ...]:
    """Return the edges of die and substrate, as one edge if they differ only by rounding."""
    return (substrate,) if math.isclose(die, substrate, rel_tol=1.0e-9) else (die, substrate)


def _joints(package: Package) -> tuple[int, int]:
    return package.columns, package.rows


def _under_joints(package: Package, count: int, edges: tuple[float, ...], size: float) -> list[Interval]:
    """Divide the positive half of an axis at the edges of parts and of the columns of its ``count`` joints, if any."""
    breaks, column = {0.0, *edges}, package.column_size
    if column is not None:
        centres = package.pitch * (np.arange(count) - 0.5 * (count - 1))
        sides = np.concatenate([centres - 0.5 * column, centres + 0.5 * column])
        for side in sides[(sides > 0.0) & (sides < edges[-1])].tolist():
            if min(abs(side - other) for other in breaks) > SAME * column:
                breaks.add(side)
    return [uniform(start, end, size) for start, end in pairwise(sorted(breaks))]


def _board_axis(
    inner: list[Interval], end: float, holes: list[float], square: float, numerics: BoardNumerics
) -> list[Interval]:
    """Divide an axis from the origin to an end of the board [m], with squares around holes at given coordinates [m]."""
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
    """Divide an interval into cells that grow from ``size`` [m] to the coarse size, which the rest keeps."""
    coarse, ratio = numerics.coarse_size, numerics.growth
    cells = max(1, math.ceil(math.log(coarse / size) / math.log(ratio)))
    grown = size * sum(ratio**k for k in range(1, cells + 1))
    if start + grown >= end - coarse:
        fitting = max(1, math.floor(math.log(1.0 + (end - start) * (ratio - 1.0) / (size * ratio)) / math.log(ratio)))
        return [Interval(start, end, fitting, ratio)]
    return [Interval(start, start + grown, cells, ratio), uniform(start + grown, end, coarse)]


def _both_sides(below: Sequence[Interval], above: Sequence[Interval]) -> tuple[Interval, ...]:
    """Join two axes that begin at the origin, the first reflected at the origin."""
    return (*(part.mirrored() for part in reversed(below)), *above)
