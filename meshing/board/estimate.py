"""Element counts and smallest lengths of the meshes, from parameters alone (for ``plan``)."""

from collections.abc import Collection
from dataclasses import dataclass

from reflowshock.meshing.board.pads import has_rim, pad_table
from reflowshock.meshing.board.parameters import Board, JointNumerics, Package, Warpage
from reflowshock.meshing.board.plan import (
    Interval,
    Plan,
    blocks_within,
    board_plan,
    footprint,
    hole_rings,
    package_plan,
    patch,
)

FLAT = Warpage()


@dataclass(frozen=True, slots=True)
class PartEstimate:
    """Number of hexahedra of a part and the edge lengths (x, y, z) of its smallest one [m]."""

    elements: int
    smallest: tuple[float, float, float]


def count_elements(
    package: Package, board: Board, warpage: Warpage = FLAT, fine: int | None = None
) -> dict[str, PartEstimate]:
    """Count the hexahedra of every part; the joints' ``solder`` and ``copper`` are summed over the array.

    Of all joints but ``fine``, where this is given, ``solder_coarse`` has the coarse mesh.

    The counts are exact as long as solder reaches the edge of its pad or mask; lengths of joint elements are those of a
    cylinder of the smallest wetted radius and gap.
    """
    joints = pad_table(package, board, warpage)
    count = len(joints) if fine is None else fine
    gap = min((site.gap for site in joints), default=package.standoff)
    of_joints = _joint_estimates(package, count, gap) | _coarse_estimates(package, len(joints) - count, gap)
    parts = _board_estimates(package, board) | _package_estimates(package, board) | of_joints
    return {name: part for name, part in parts.items() if part.elements}


def _board_estimates(package: Package, board: Board) -> dict[str, PartEstimate]:
    plan, numerics = board_plan(package, board), board.numerics
    patch_cells, all_cells = _cells(plan, patch(plan, package)), _cells(plan, _all_blocks(plan))
    holes = {(i, j) for i in plan.hole_x for j in plan.hole_y}
    around_holes = sum(2 * (plan.x[i].cells + plan.y[j].cells) * hole_rings(board) for i, j in holes)
    all_cells += around_holes - _cells(plan, holes)
    layer = board.thickness / numerics.layers
    size = (_smallest(plan.x), _smallest(plan.y), layer)
    in_patch = patch_cells * numerics.patch_layers
    return {
        "board": PartEstimate(all_cells * numerics.layers - in_patch, size),
        "board_patch": PartEstimate(in_patch, size),
        "copper_board": _plate(package, plan, footprint(plan, package)),
    }


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
    pads, edge = (package.board_pad, package.package_pad), _edge(package, numerics)
    cells = joints * _section(numerics) * numerics.layers
    parts = {"solder": PartEstimate(cells, (edge, edge, gap / numerics.layers))}
    if package.copper.layout == "pads":
        rims = sum(has_rim(0.5 * pad.diameter, pad.wetted_radius) for pad in pads)
        cells = joints * (2 * _section(numerics) + rims * 4 * numerics.core)
        parts["copper"] = PartEstimate(cells, (edge, edge, package.copper.thickness))
    return parts


def _coarse_estimates(package: Package, joints: int, gap: float) -> dict[str, PartEstimate]:
    numerics, edge = package.coarse_joint_numerics, _edge(package, package.coarse_joint_numerics)
    height = gap + 2.0 * package.copper.thickness if package.copper.layout == "pads" else gap
    cells = joints * _section(numerics) * numerics.layers
    return {"solder_coarse": PartEstimate(cells, (edge, edge, height / numerics.layers))}


def _section(numerics: JointNumerics) -> int:
    """Number of quadrilaterals in the cross-section of a joint."""
    return numerics.core**2 + 4 * numerics.core * numerics.rings


def _edge(package: Package, numerics: JointNumerics) -> float:
    """Edge length in the cross-section of a joint [m]."""
    wetted = min(pad.wetted_radius for pad in (package.board_pad, package.package_pad))
    return wetted / (0.5 * numerics.core + numerics.rings)


def _plate(package: Package, plan: Plan, blocks: Collection[tuple[int, int]]) -> PartEstimate:
    cells = _cells(plan, blocks) if package.copper.layout == "plate" else 0
    return PartEstimate(cells, (_smallest(plan.x), _smallest(plan.y), package.copper.thickness))


def _cells(plan: Plan, blocks: Collection[tuple[int, int]]) -> int:
    return sum(plan.x[i].cells * plan.y[j].cells for i, j in blocks)


def _all_blocks(plan: Plan) -> list[tuple[int, int]]:
    return [(i, j) for i in range(len(plan.x)) for j in range(len(plan.y))]


def _smallest(axis: tuple[Interval, ...]) -> float:
    return min(part.smallest() for part in axis)
