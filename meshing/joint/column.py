"""Columns of board and substrate under and over a joint: the pad's mesh, extended to a square and swept.

With ``package.imprint`` a fine joint stands in such a column. The lines of the surrounding boxes lie on the edges of
the square (``board.plan``). Copper and column share the nodes of the pad; ``fem`` removes the boxes inside the column
and ties its sides to the surrounding ones. Constant stress passes exactly where the lines of the boxes subdivide those
of the column; elsewhere results change by about 1 %. All columns have the same number of nodes around, so that
neighbours match. Copper with a different mesh (free-form joints, swept joints that needed a finer mesh) is tied to its
column, whose pad has the outline of the copper: forces and layer averages of stress are then 1 % larger than with
shared nodes. ``joint_numerics.pad_layer`` is the thickness over which stress and plastic work are averaged,
``pad_layers`` the number of elements through it.
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
    """Geometry and resolution of the column on one side of a joint.

    Attributes:
        side: Side of the joint.
        part: Prefix of the part name.
        numerics: Resolution of the butterfly mesh of the pad.
        levels: Heights of the layers as drawn, from the face of the pad, shape (k + 1,) [m].
        square: Lower left and upper right corner of the square in plan, as drawn, shape (2, 2) [m].
        rings: Number of element rings between the edge of the pad and the square.
        growth: Ratio of the widths of successive rings, outwards.
        drawn: Map from points in the assembly on the face of the pad, shape (n, 3) [m], to x and y as drawn, (n, 2).
        place: Map from points as drawn to points in the assembly, both of shape (n, 3) [m].
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
    """Hexahedra of a column; new nodes are numbered after the joint, whose foot or head it shares.

    All faces are counter-clockwise seen from outside.

    Attributes:
        points: Coordinates of the new nodes, shape (n, 3) [m].
        cells: Nodes of the hexahedra, shape (c, 8).
        sides: Lateral faces, shape (f, 4).
        end: Face away from the joint, shape (e, 4).
        top: Face towards the joint without the outermost ring, whose nodes may be tied to boxes, shape (t, 4).
    """

    points: np.ndarray
    cells: np.ndarray
    sides: np.ndarray
    end: np.ndarray
    top: np.ndarray


def columns_of(site: PadSite, package: Package, board: Board, side: PackageSide) -> tuple[Column, ...]:
    """Return the square columns of board and package that continue the pads of a joint.

    Args:
        site: Positions and sizes of the pads.
        package: Package, with the parameters of the imprint and the substrate.
        board: Board, with thickness and number of layers.
        side: Displaced underside of the package.

    Returns:
        Geometry and resolution of the column under and of the column over the joint; an empty tuple if the package has
        no imprint.
    """
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
    common = {"numerics": package.joint_numerics, "square": square, "rings": imprint.rings, "growth": imprint.growth}
    return (
        Column("board", "board_column", levels=-foot, drawn=lambda points: points[:, :2], place=np.copy, **common),
        Column(
            "package",
            "substrate_column",
            levels=underside(package) + head,
            drawn=lambda points: side.origin(points[:, 0], points[:, 1]),
            place=side.displaced,
            **common,
        ),
    )


def column_pad(column: Column, outline: np.ndarray, opening: float, beyond: int) -> tuple[np.ndarray, Butterfly]:
    """Mesh a pad of any outline with the butterfly section (core inside rings) of its column.

    Args:
        column: Geometry and resolution of the column of board or substrate that continues the pad.
        outline: Outline of the copper's outer face, counter-clockwise seen from above, shape (r, 3) [m].
        opening: Ratio of the radii of mask opening and copper.
        beyond: Number of element rings between mask opening and edge of the copper.

    Returns:
        Nodes of the pad in the assembly, shape (n, 3) [m], and the section, whose quadrilaterals and outline number
        them.

    Raises:
        ValueError: The outline is not star-shaped about its centre.
    """
    flat, numerics = column.drawn(outline), column.numerics
    section = butterfly(numerics.core, numerics.rings, opening, beyond)
    plan = section_nodes(np.stack([flat, np.roll(flat, -1, axis=0)], axis=1), section)
    return column.place(np.column_stack([plan, np.full(len(plan), column.levels[0])])), section


def grow_column(column: Column, points: np.ndarray, quads: np.ndarray, rim: np.ndarray) -> ColumnMesh:
    """Extend the outer face of a pad to the square of its column and sweep it through board or substrate.

    Args:
        column: Geometry and resolution of the column.
        points: Nodes of the joint in the assembly, shape (n, 3) [m].
        quads: Quadrilaterals of the pad's outer face, counter-clockwise seen from above, shape (q, 4).
        rim: Outline nodes of that face, counter-clockwise from the one nearest to the square's lower left corner,
            shape (4 m,).

    Returns:
        New nodes, which are numbered from n, and the hexahedra and faces of the column in this numbering.
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
    """Return equidistant points around a square, counter-clockwise from its lower left corner, shape (4 count, 2)."""
    (left, low), (right, high) = square
    corners = np.array([[left, low], [right, low], [right, high], [left, high]])
    share = np.arange(count)[:, None] / count
    return np.vstack([a + share * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])
