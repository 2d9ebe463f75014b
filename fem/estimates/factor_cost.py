"""What a Cholesky factorisation of a box of nodes costs, by geometric nested dissection. Plain Python."""

from dataclasses import dataclass
from functools import cache

COMPONENTS = 3
LEAF = 3  # layers of nodes that are eliminated at once
# MUMPS orders without knowing that the mesh is a box: operations and entries over those of the dissection. Plates one
# to four layers thick and cubes of 1e3 to 7e4 unknowns needed 1.3 to 2.8 and 1.2 to 1.7 (benchmarks/jedec_oracle.py).
OPERATIONS_FACTOR = 1.7
ENTRIES_FACTOR = 1.45


@dataclass(frozen=True, slots=True)
class FactorSize:
    """Floating point operations of a factorisation, and entries of the factor."""

    operations: float
    entries: float


def box_factor(nodes: tuple[int, int, int]) -> FactorSize:
    """Predict the factor of a linear elastic box, three unknowns a node.

    A box is cut by the smallest section through the middle of its longest side, and so on; the section is eliminated
    after both halves, in a dense front with those earlier sections that border the box: s unknowns with a border of b
    take ((s + b)^3 - b^3) / 3 operations and s^2 / 2 + s b entries (George, SIAM J. Numer. Anal. 10, 1973).

    Args:
        nodes: Nodes along each side.
    """
    operations, entries = _dissect(nodes, (False,) * 6)
    return FactorSize(OPERATIONS_FACTOR * operations, ENTRIES_FACTOR * entries)


@cache
def _dissect(nodes: tuple[int, int, int], bordered: tuple[bool, ...]) -> tuple[float, float]:
    """Return operations and entries of a box; ``bordered``: sides, low and high by axis, with a section behind."""
    section = [nodes[1] * nodes[2], nodes[0] * nodes[2], nodes[0] * nodes[1]]
    border = float(COMPONENTS * sum(section[axis] * sum(bordered[2 * axis : 2 * axis + 2]) for axis in range(3)))
    longest = max(range(3), key=nodes.__getitem__)
    if nodes[longest] <= LEAF:
        return _front(float(COMPONENTS * nodes[0] * nodes[1] * nodes[2]), border)
    operations, entries = _front(float(COMPONENTS * section[longest]), border)
    below = (nodes[longest] - 1) // 2
    for count, side in ((below, 1), (nodes[longest] - 1 - below, 0)):
        half, sides = list(nodes), list(bordered)
        half[longest], sides[2 * longest + side] = count, True
        more = _dissect((half[0], half[1], half[2]), tuple(sides))
        operations, entries = operations + more[0], entries + more[1]
    return operations, entries


def _front(size: float, border: float) -> tuple[float, float]:
    return ((size + border) ** 3 - border**3) / 3.0, 0.5 * size**2 + size * border
