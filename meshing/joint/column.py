"""Columns of board and substrate that continue a joint's pads: rings out to a square, swept through their layers.

With ``package.imprint`` a fine joint stands in such a column. The boxes beside have lines on the square's edges
(``board.plan``). Copper and column share the pad's nodes; ``fem`` takes out the boxes and ties the column's sides to
those beside it. Where the boxes' lines divide the column's, constant stress passes; where they do not, measures change
by about 1 %. All columns have as many nodes around, so neighbours fit. Where copper has another mesh (free-form joints,
swept ones that had to be finer), it is tied to that column, whose pad has the copper's outline: forces and layer
averages of stress are 1 % above those of shared nodes. ``joint_numerics.pad_layer`` is the thickness over which stress
and plastic work are averaged, ``pad_layers`` the elements through it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from reflowshock.meshing.board.package_side import PackageSide, underside
from reflowshock.meshing.board.pads import PadSite
from reflowshock.meshing.board.parameters import Board, JointNumerics, Package
from reflowshock.meshing.board.plan import column_levels
from reflowshock.meshing.joint.butterfly import Butterfly, butterfly
from reflowshock.meshing.joint.solder import Side
from reflowshock.meshing.joint.swept import section_nodes


@dataclass(frozen=True, slots=True)
class Column:
    """The column on one side of a joint.

    Attributes:
        side: of the joint.
        part: begins the name of its part.
        numerics: of the butterfly that its pad has.
        levels: heights as drawn, from the pad's face (k + 1,) [m].
        square: (2, 2) lower and upper corner in plan, as drawn [m].
        rings: of elements between the pad's edge and the square.
        growth: width of each ring over that of the one inside it.
        drawn: x and y (n, 2) as drawn of points (n, 3) on the pad's face [m].
        place: where points (n, 3) as drawn are in the assembly (n, 3) [m].
    """

    side: Side
    part: str
    numerics: JointNumerics
    levels: np.ndarray
    square: np.ndarray
    rings: int
    growth: float
    drawn: Callable[[np.ndarray], np.ndarray]
    place: Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, slots=True)
class ColumnMesh:
    """A column's hexahedra; its nodes are numbered after those of the joint, whose foot or head it shares.

    Attributes:
        points: its own (n, 3) [m].
        cells: (c, 8).
        sides: (f, 4) its lateral faces, from outside counter-clockwise.
        end: (e, 4) its face away from the joint, likewise.
        top: (t, 4) its face towards the joint but for the outermost ring, whose nodes boxes may hold, likewise.
    """

    points: np.ndarray
    cells: np.ndarray
    sides: np.ndarray
    end: np.ndarray
    top: np.ndarray


def columns_of(site: PadSite, package: Package, board: Board, side: PackageSide) -> tuple[Column, ...]:
    """Return the columns under and over a joint; none where pads are not imprinted."""
    size, imprint = package.column_size, package.imprint
    if size is None or imprint is None:
        return ()
    square = np.array([[site.x, site.y]]) + 0.5 * size * np.array([[-1.0, -1.0], [1.0, 1.0]])
    foot, head = (
        column_levels(layer, count, imprint)
        for layer, count in (
            (board.thickness, board.numerics.layers),
            (package.substrate.thickness, package.substrate.elements),
        )
    )
    alike = {"numerics": package.joint_numerics, "square": square, "rings": imprint.rings, "growth": imprint.growth}
    return (
        Column("board", "board_column", levels=-foot, drawn=lambda points: points[:, :2], place=np.copy, **alike),
        Column(
            "package",
            "substrate_column",
            levels=underside(package) + head,
            drawn=lambda points: side.origin(points[:, 0], points[:, 1]),
            place=side.displaced,
            **alike,
        ),
    )


def column_pad(column: Column, outline: np.ndarray, opening: float, beyond: int) -> tuple[np.ndarray, Butterfly]:
    """Mesh a pad of any outline as a column has it.

    Args:
        column: whose pad it is.
        outline: (r, 3) nodes of the copper's outer face in their place, counter-clockwise seen from above [m].
        opening: radius of the mask's opening over that of the copper.
        beyond: rings of elements between both.

    Returns:
        Its nodes in their place (n, 3) [m], and how they make up the pad.

    Raises:
        ValueError: the outline is not star-shaped about its centre.
    """
    flat, numerics = column.drawn(outline), column.numerics
    section = butterfly(numerics.core, numerics.rings, opening, beyond)
    plan = section_nodes(np.stack([flat, np.roll(flat, -1, axis=0)], axis=1), section)
    return column.place(np.column_stack([plan, np.full(len(plan), column.levels[0])])), section


def grow_column(column: Column, points: np.ndarray, quads: np.ndarray, rim: np.ndarray) -> ColumnMesh:
    """Continue a pad's outer face into board or substrate.

    Args:
        column: what it is to be.
        points: (n, 3) of the joint in its place [m].
        quads: (q, 4) of that face, counter-clockwise seen from above.
        rim: (4 m,) nodes of its outline, counter-clockwise from the one nearest to the square's lower left corner.
    """
    inner, local = np.unique(quads, return_inverse=True)
    flat = column.drawn(points[inner])
    edge = np.searchsorted(inner, rim)
    outline = _outline(column.square, len(rim) // 4)
    shares = np.cumsum(column.growth ** np.arange(column.rings))
    plan = np.vstack([flat, *(flat[edge] + share * (outline - flat[edge]) for share in shares / shares[-1])])
    ids = [edge, *(len(flat) + len(edge) * ring + np.arange(len(edge)) for ring in range(column.rings))]
    rings = [np.column_stack([low, high, np.roll(high, -1), np.roll(low, -1)]) for low, high in pairwise(ids)]
    section = np.vstack([local.reshape(quads.shape), *rings])
    drawn = np.column_stack([np.tile(plan, (len(column.levels), 1)), np.repeat(column.levels, len(plan))])
    first = len(points) - len(flat)
    number = first + np.arange(len(drawn)).reshape(len(column.levels), -1)
    number[0, : len(flat)] = inner
    rising = column.side == "package"
    pairs = list(pairwise(number)) if rising else [(upper, lower) for lower, upper in pairwise(number)]
    cells = np.vstack([np.hstack([lower[section], upper[section]]) for lower, upper in pairs])
    corner, following = ids[-1], np.roll(ids[-1], -1)
    sides = [np.column_stack([low[corner], low[following], up[following], up[corner]]) for low, up in pairs]
    end, top = number[-1][section], number[0][section[: -len(edge)]]
    end, top = (end, top[:, ::-1]) if rising else (end[:, ::-1], top)
    return ColumnMesh(column.place(drawn[len(flat) :]), cells, np.vstack(sides), end, top)


def _outline(square: np.ndarray, count: int) -> np.ndarray:
    """Return points (4 count, 2) around a square, counter-clockwise from its lower left corner."""
    (left, low), (right, high) = square
    corners = np.array([[left, low], [right, low], [right, high], [left, high]])
    share = np.arange(count)[:, None] / count
    return np.vstack([a + share * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])
