"""Element counts and smallest edge lengths of the meshes, estimated from parameters without a mesh (for ``plan``)."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from reflowshock.meshing.board.pads import has_rim, pad_table
from reflowshock.meshing.board.parameters import Board, JointNumerics, Package, Pad, Warpage
from reflowshock.meshing.board.plan import (
    MOST_LINES,
    Interval,
    Plan,
    blocks_within,
    board_plan,
    column_levels,
    footprint,
    hole_rings,
    hole_square,
    package_plan,
    patch,
)

FLAT = Warpage()


Edges = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True)
class PartEstimate:
    """Number and sizes of the hexahedra of a part.

    Attributes:
        elements: Number of elements.
        smallest: Edge lengths along x, y and z of the smallest box-shaped element [m].
        rows: Number of rows of equal boxes; 0 if they are not counted.
        around_holes: Number of elements around mounting holes, which are not boxes.
        shapes: Edge vectors at the centre of each distinct element around a mounting hole, three per element [m].
    """

    elements: int
    smallest: tuple[float, float, float]
    rows: int = 0
    around_holes: int = 0
    shapes: tuple[Edges, ...] = ()


def count_elements(
    package: Package, board: Board, warpage: Warpage = FLAT, fine: int | None = None
) -> dict[str, PartEstimate]:
    """Count the hexahedra of every part of an assembly without meshing it; joints are summed over the array.

    Counts are exact if the solder wets its pads up to the edge of pad or mask; element lengths in joints follow from a
    cylinder with the smallest wetted radius and gap.

    Args:
        package: Array, pads and layers of the package.
        board: Sizes, holes and symmetry of the board.
        warpage: Prescribed warpage of the package.
        fine: Number of joints with a fine mesh; the others are coarse (``solder_coarse``). None: all are fine.

    Returns:
        Part name -> number of its elements, and edge lengths along x, y and z of the smallest box [m]; parts without
        elements are omitted.
    """
    joints = pad_table(package, board, warpage)
    count = len(joints) if fine is None else fine
    gap = min((site.gap for site in joints), default=package.standoff)
    of_joints = _joint_estimates(package, count, gap) | _coarse_estimates(package, len(joints) - count, gap)
    parts = _board_estimates(package, board) | _package_estimates(package, board) | of_joints
    parts |= _column_estimates(package, board, parts, count)
    return {name: part for name, part in parts.items() if part.elements}


def _board_estimates(package: Package, board: Board) -> dict[str, PartEstimate]:
    plan, numerics = board_plan(package, board), board.numerics
    patch_cells, all_cells = _cells(plan, patch(plan, package)), _cells(plan, _all_blocks(plan))
    around_holes = sum(2 * (plan.x[i].cells + plan.y[j].cells) * hole_rings(board) for i, j in plan.holes)
    all_cells += around_holes - _cells(plan, plan.holes)
    layer = board.thickness / numerics.layers
    size = (_smallest(plan.x), _smallest(plan.y), layer)
    in_patch = patch_cells * numerics.patch_layers
    of_holes = around_holes * numerics.layers, _shapes_around_holes(plan, board)
    return {
        "board": PartEstimate(all_cells * numerics.layers - in_patch, size, _rows(plan) * numerics.layers, *of_holes),
        "board_patch": PartEstimate(in_patch, size),
        "copper_board": _plate(package, plan, footprint(plan, package)),
    }


def _rows(plan: Plan) -> int:
    """Count the rows of equal cells of one layer along the axis with fewer rows; each graded cell is a row."""
    pieces, cells = zip(*(_pieces(axis) for axis in (plan.x, plan.y)), strict=True)
    return min(pieces[0] * cells[1], cells[0] * pieces[1])


def _pieces(axis: tuple[Interval, ...]) -> tuple[int, int]:
    """Return the number of runs of equal cells of an axis, and of its cells."""
    return sum(1 if part.ratio == 1.0 else part.cells for part in axis), sum(part.cells for part in axis)


def _shapes_around_holes(plan: Plan, board: Board) -> tuple[Edges, ...]:
    """Return the edge vectors of each distinct element between a round hole and the square around it.

    Straight lines connect equidistant points of an arc to points of the square's side. The result is empty if there
    are more cells than are ever meshed.
    """
    rings, square, radius = hole_rings(board), hole_square(board), 0.5 * board.holes.diameter
    height = (0.0, 0.0, board.thickness / board.numerics.layers)
    shapes = []
    for cells in sorted(
        {axis[k].cells for block in plan.holes for axis, k in zip((plan.x, plan.y), block, strict=True)}
    ):
        if cells * rings > MOST_LINES:
            return ()
        along = np.linspace(-1.0, 1.0, cells + 1)
        arc = radius * np.column_stack([np.sin(0.25 * np.pi * along), np.cos(0.25 * np.pi * along)])
        side = 0.5 * square * np.column_stack([along, np.ones(cells + 1)])
        outward = np.linspace(0.0, 1.0, rings + 1)[:, None, None]
        points = (1.0 - outward) * arc + outward * side
        between = 0.5 * (np.diff(points, axis=1)[1:] + np.diff(points, axis=1)[:-1])
        spokes = 0.5 * (np.diff(points, axis=0)[:, 1:] + np.diff(points, axis=0)[:, :-1])
        pairs = zip(between.reshape(-1, 2).tolist(), spokes.reshape(-1, 2).tolist(), strict=True)
        for (x, y), (u, v) in pairs:
            shapes += [((x, y, 0.0), (u, v, 0.0), height), ((-y, x, 0.0), (-v, u, 0.0), height)]
    return tuple(shapes)


def _package_estimates(package: Package, board: Board) -> dict[str, PartEstimate]:
    plan = package_plan(package, board)
    substrate, die = package.substrate, package.die
    blocks, size = _all_blocks(plan), (_smallest(plan.x), _smallest(plan.y))
    under_die = blocks_within(plan, die.length, die.width)
    return {
        "copper_package": _plate(package, plan, blocks),
        "substrate": PartEstimate(
            _cells(plan, blocks) * substrate.elements, (*size, substrate.thickness / substrate.elements)
        ),
        "die": PartEstimate(_cells(plan, under_die) * die.elements, (*size, die.thickness / die.elements)),
    }


def _joint_estimates(package: Package, joints: int, gap: float) -> dict[str, PartEstimate]:
    numerics = package.joint_numerics
    pads, edge = (package.board_pad, package.package_pad), element_edge(package, numerics)
    cells = joints * _section(numerics) * numerics.layers
    lowest = gap / numerics.layers if numerics.pad_layer is None else numerics.pad_layer / numerics.pad_layers
    parts = {"solder": PartEstimate(cells, (edge, edge, lowest))}
    if package.copper.layout == "pads":
        rims, layers = sum(rim_count(pad, edge) for pad in pads), numerics.copper_layers
        cells = joints * (2 * _section(numerics) + rims * 4 * numerics.core) * layers
        parts["copper"] = PartEstimate(cells, (edge, edge, package.copper.thickness / layers))
    return parts


def _column_estimates(
    package: Package, board: Board, parts: dict[str, PartEstimate], joints: int
) -> dict[str, PartEstimate]:
    """Count the elements of the columns of fine joints, and the remaining boxes."""
    imprint, numerics = package.imprint, package.joint_numerics
    if imprint is None or package.column_size is None:
        return {}
    edge = element_edge(package, numerics)
    layers = {
        "board": (board.thickness, board.numerics.layers, board_plan(package, board), package.board_pad),
        "substrate": (
            package.substrate.thickness,
            package.substrate.elements,
            package_plan(package, board),
            package.package_pad,
        ),
    }
    estimates = {}
    for name, (thickness, boxes, plan, pad) in layers.items():
        levels = column_levels(thickness, boxes, imprint)
        section = _section(numerics) + 4 * numerics.core * (rim_count(pad, edge) + imprint.rings)
        cells = joints * section * (len(levels) - 1)
        beyond = 0.5 * (package.column_size - pad.diameter)  # from the pad's edge to the nearest side
        ring = beyond / float(np.sum(imprint.growth ** np.arange(imprint.rings)))
        estimates[f"{name}_column"] = PartEstimate(cells, (edge, min(edge, ring), float(np.diff(levels).min())))
        site = pad_table(package, board, FLAT)[0]
        replaced = [_cells_between(axis, at, package.column_size) for axis, at in ((plan.x, site.x), (plan.y, site.y))]
        taken = joints * replaced[0] * replaced[1] * boxes
        patch_layers = min(boxes, board.numerics.patch_layers)
        upper = taken * patch_layers // boxes if name == "board" else 0
        estimates[name] = replace(parts[name], elements=parts[name].elements - taken + upper)
        if name == "board":
            board_patch = parts["board_patch"]
            estimates["board_patch"] = replace(board_patch, elements=board_patch.elements - upper)
    return estimates


def _cells_between(axis: tuple[Interval, ...], centre: float, size: float) -> int:
    """Return the number of cells of an axis inside the column of a joint."""
    return sum(part.cells for part in axis if abs(0.5 * (part.start + part.end) - centre) < 0.5 * size)


def _coarse_estimates(package: Package, joints: int, gap: float) -> dict[str, PartEstimate]:
    numerics, edge = package.coarse_joint_numerics, element_edge(package, package.coarse_joint_numerics)
    height = gap + 2.0 * package.copper.thickness if package.copper.layout == "pads" else gap
    cells = joints * _section(numerics) * numerics.layers
    return {"solder_coarse": PartEstimate(cells, (edge, edge, height / numerics.layers))}


def _section(numerics: JointNumerics) -> int:
    """Return the number of quadrilaterals in the cross-section of a joint."""
    return numerics.core**2 + 4 * numerics.core * numerics.rings


def element_edge(package: Package, numerics: JointNumerics) -> float:
    """Return the typical edge length in the cross-section of a joint [m].

    Args:
        package: Package, whose smaller wetted radius counts.
        numerics: Resolution of the section: elements of the core and rings around it.
    """
    wetted = min(pad.wetted_radius for pad in (package.board_pad, package.package_pad))
    return wetted / (0.5 * numerics.core + numerics.rings)


def rim_count(pad: Pad, edge: float) -> int:
    """Return the number of element rings of copper beyond the wetted disc of a pad, each about ``edge`` [m] wide.

    Args:
        pad: Radii of copper and wetted disc; 0 rings if they differ too little.
        edge: Target width of a ring [m].
    """
    if not has_rim(0.5 * pad.diameter, pad.wetted_radius):
        return 0
    return max(1, round((0.5 * pad.diameter - pad.wetted_radius) / edge))


def _plate(package: Package, plan: Plan, blocks: Collection[tuple[int, int]]) -> PartEstimate:
    cells = _cells(plan, blocks) if package.copper.layout == "plate" else 0
    return PartEstimate(cells, (_smallest(plan.x), _smallest(plan.y), package.copper.thickness))


def _cells(plan: Plan, blocks: Collection[tuple[int, int]]) -> int:
    return sum(plan.x[i].cells * plan.y[j].cells for i, j in blocks)


def _all_blocks(plan: Plan) -> list[tuple[int, int]]:
    return [(i, j) for i in range(len(plan.x)) for j in range(len(plan.y))]


def _smallest(axis: tuple[Interval, ...]) -> float:
    return min(part.smallest() for part in axis)
