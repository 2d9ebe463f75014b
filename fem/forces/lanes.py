"""Order of elements in blocks of a few lanes, such that blocks of equal shapes share their constants.

A lane is the place of one element in a block; a SIMD instruction works on all lanes of a block.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import Elements, classes


@dataclass(frozen=True, slots=True)
class Lanes:
    """Order of elements in blocks of a few lanes.

    Attributes:
        element: Element of each lane, shape (nb, width); lanes after the last element of a group repeat it.
        filled: Number of elements of each block, shape (nb,) int32.
        pattern: Pattern of each block, shape (nb,) int32; blocks of equal shapes share one.
        shape: One element of each distinct shape, shape (ns,).
        pattern_shapes: Index into ``shape`` of each lane of a pattern, shape (np, width).
    """

    element: NDArray[np.int64]
    filled: NDArray[np.int32]
    pattern: NDArray[np.int32]
    shape: NDArray[np.int64]
    pattern_shapes: NDArray[np.int64]

    @property
    def width(self) -> int:
        """Number of lanes of a block."""
        return self.element.shape[1]

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Whether each lane holds an element of its own instead of a repeated one, shape (nb, width)."""
        return np.arange(self.width) < self.filled[:, None]

    def spread(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return values of each lane of the patterns from values of the distinct shapes.

        Args:
            values: Values of each shape, shape (ns, m, k), any unit.

        Returns:
            Shape (np, m, width k), lanes innermost: entry i of lane e at ``width i + e``.
        """
        moved = values[self.pattern_shapes].transpose(0, 2, 3, 1)
        return np.ascontiguousarray(moved).reshape(*moved.shape[:2], -1)

    def view(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a view, not a copy, of values with the lanes as second axis.

        Args:
            values: Values with the lanes innermost, shape (n, ..., width k).

        Returns:
            Shape (n, width, ..., k).
        """
        return np.moveaxis(values.reshape(*values.shape[:-1], -1, self.width), -1, 1)

    def nodes(self, elements: Elements) -> NDArray[np.int32]:
        """Return the nodes of the elements of each block, lanes innermost, shape (nb, k, width) int32.

        Args:
            elements: Elements that were arranged, k nodes each.
        """
        return np.ascontiguousarray(elements.cells[self.element].transpose(0, 2, 1), dtype=np.int32)


def arrange(elements: Elements, group: NDArray[np.integer], width: int) -> Lanes:
    """Sort elements into blocks, each within one group, so that few patterns of shapes serve many blocks.

    Elements of one shape fill blocks by themselves. Of the rest, shapes that are left equally often stand side by side,
    and their copies follow in the next blocks.

    Args:
        elements: Elements of one kind, at least one: points, cells, materials.
        group: Group of each element, such as its material, shape (ne,), not negative.
        width: Number of lanes of a block.

    Returns:
        ``Lanes``, the order of the elements: element of each lane (nb, width), elements per block, and the shapes that
        blocks share.
    """
    first, shape = classes(replace(elements, density=np.zeros(len(elements.cells))))
    node = elements.cells.min(axis=1)
    blocks = [block for k in np.unique(group) for block in _blocks_of(np.flatnonzero(group == k), shape, node, width)]
    filled = np.array([len(block) for block in blocks], dtype=np.int32)
    element = np.array([[*block, *[block[-1]] * (width - len(block))] for block in blocks])
    pattern_shapes, start, pattern = np.unique(shape[element], axis=0, return_index=True, return_inverse=True)
    order = np.lexsort((node[element[:, 0]], start[pattern.reshape(-1)]))
    return Lanes(element[order], filled[order], pattern.reshape(-1)[order].astype(np.int32), first, pattern_shapes)


def _blocks_of(
    chosen: NDArray[np.int64], shape: NDArray[np.int32], node: NDArray[np.integer], width: int
) -> list[list[int]]:
    """Return the blocks of some elements, lists of at most ``width`` element numbers, see ``arrange``.

    Args:
        chosen: Numbers of the elements, shape (k,).
        shape: Shape of each element, shape (ne,).
        node: Lowest node of each element, shape (ne,).
        width: Number of lanes of a block.
    """
    members: dict[int, list[int]] = {}
    for element in chosen[np.argsort(node[chosen], kind="stable")].tolist():
        members.setdefault(int(shape[element]), []).append(element)
    blocks: list[list[int]] = []
    remaining: dict[int, list[list[int]]] = {count: [] for count in range(1, width)}
    for copies in members.values():
        whole = len(copies) - len(copies) % width
        blocks += _split(copies[:whole], width)
        if whole < len(copies):
            remaining[len(copies) - whole].append(copies[whole:])
    last: list[int] = []
    for shapes in remaining.values():
        together = len(shapes) - len(shapes) % width
        for some in _split(shapes[:together], width):
            blocks += [list(copies) for copies in zip(*some, strict=True)]
        last += [element for copies in shapes[together:] for element in copies]
    return blocks + _split(last, width)


def _split(items: list, width: int) -> list[list]:
    """Split a list into lists of ``width`` items, the last of which may be shorter."""
    return [items[start : start + width] for start in range(0, len(items), width)]
