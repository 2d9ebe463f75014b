"""Internal force of boxes: one stiffness per shape and material, diagonalised by symmetry.

A box along the axes of its material has three mirror planes. In the Walsh-Hadamard basis of its eight nodes the 24 x 24
stiffness splits into eight blocks of 3 x 3, one per parity: the modes of component c with parity p have the index
p XOR 2^c. A product takes 216 multiplications and additions instead of 1152, with one small table per shape, and
neighbours in a row of boxes share half of them (``box_rows``, ``kernels.box_rows``).
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import Elements, classes, element_stiffness
from reflowshock.fem.elements.mean_strain import MeanStrain
from reflowshock.fem.forces.box_rows import BoxRows
from reflowshock.fem.forces.energy import Energy, linear_energy
from reflowshock.fem.kernels.box_rows import PAD, add_row_forces, read_lines, subtract_lines

SIGNS = np.array([[(-1.0) ** bin(p & a).count("1") for a in range(8)] for p in range(8)])
UPPER = np.triu_indices(3)
VOIGT = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
TURNS = ((0, 1, 2), (1, 2, 0), (2, 0, 1))  # proper rotations that bring each axis to the front
BOX_TOLERANCE = 1e-9
FEW = 64  # number of boxes up to which assembled matrices cost no more than the calls of a separate term


@dataclass(frozen=True, slots=True)
class CongruentElements:
    """Boxes that share stiffnesses, in rows along the axis with the longest rows.

    Attributes:
        axes: Coordinate directions in the order of the frame of the rows, shape (3,).
        nodes: Node at each position of the lines, shape (p,) int32.
        rows: Rows of boxes, see ``kernels.box_rows.add_row_forces``, shape (nr, 6) int32.
        blocks: Parity blocks of each shape in the frame of the rows, shape (ns, 8, 6) [N/m].
        lines: Work space for displacements [m] and forces [N] at the positions, shape (2, 3, p + PAD).
        mean: Mean strains of elements with hourglass control, otherwise None.
        history: Empty, because the force follows from the displacement.
    """

    axes: NDArray[np.int64]
    nodes: NDArray[np.int32]
    rows: NDArray[np.int32]
    blocks: NDArray[np.float64]
    lines: NDArray[np.float64]
    mean: MeanStrain | None = None
    history: dict[str, NDArray] = field(default_factory=dict)

    @classmethod
    def build(cls, elements: Elements) -> "CongruentElements":
        """Group boxes (``is_box``) into classes and rows, and diagonalise the stiffness of each class."""
        ahead, axes, box_rows, first = arrange_in_rows(elements)
        blocks = parity_blocks(element_stiffness(ahead.subset(first)))
        lines = np.zeros((2, 3, len(box_rows.nodes) + PAD))
        return cls(np.array(axes), box_rows.nodes, box_rows.rows, blocks, lines, MeanStrain.of(elements))

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract K u at a displacement ``(n, 3)`` [m] from ``force (n, 3)`` [N]."""
        read_lines(self.nodes, self.axes, displacement, self.lines[0])
        add_row_forces(self.rows, self.blocks, self.lines[0], self.lines[1])
        subtract_lines(self.nodes, self.axes, self.lines[1], force)

    @property
    def arrays(self) -> dict[str, tuple[NDArray, ...]]:
        """Entry of ``kernels.levels.ForceArrays`` by name."""
        return {"congruent": (self.nodes, self.axes, self.rows, self.blocks, self.lines)}

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the strain energy."""
        return linear_energy(self, displacement, self.mean)


def arrange_in_rows(elements: Elements) -> tuple[Elements, tuple[int, int, int], BoxRows, NDArray[np.int64]]:
    """Arrange boxes in rows along the axis that gives the fewest rows.

    Args:
        elements: Hexahedra that are boxes along the axes (``is_box``).

    Returns:
        Boxes in the frame of the rows (components of nodes and elasticity permuted, nodes in tensor order); coordinate
        directions 0 to 2 in the order of that frame; rows; number of one box of each shape and material, shape (ns,).
    """
    first, shape = classes(replace(align_boxes(elements), density=np.zeros(len(elements.cells))))
    candidates = []
    for axes in TURNS:
        ahead = align_boxes(_turn_elements(elements, axes))
        candidates.append((ahead, axes, BoxRows.find(ahead.points, ahead.cells, shape)))
    return *min(candidates, key=lambda candidate: len(candidate[2].rows)), first


def _turn_elements(elements: Elements, axes: tuple[int, int, int]) -> Elements:
    """Return elements in a frame whose directions are the coordinate directions ``axes``."""
    voigt = [VOIGT.index((min(axes[i], axes[j]), max(axes[i], axes[j]))) for i, j in VOIGT]
    elasticity = np.ascontiguousarray(elements.elasticity[:, voigt][:, :, voigt])
    return replace(elements, points=np.ascontiguousarray(elements.points[:, axes]), elasticity=elasticity)


def is_box(corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which elements are boxes with edges along the axes, in any node order, shape (ne,).

    Args:
        corners: Node positions of each element, shape (ne, k, 3) [m]; only hexahedra (k = 8) can be boxes.
    """
    if corners.shape[1] != 8:
        return np.zeros(len(corners), dtype=bool)
    low, high = corners.min(axis=1, keepdims=True), corners.max(axis=1, keepdims=True)
    size = high - low
    upper = corners > 0.5 * (low + high)
    off = np.abs(corners - np.where(upper, high, low)) > BOX_TOLERANCE * size
    position = upper @ np.array([1, 2, 4])
    complete = np.all(np.sort(position, axis=1) == np.arange(8), axis=1)
    return complete & ~off.any(axis=(1, 2))


def in_rows(elements: Elements) -> NDArray[np.bool_]:
    """Return which elements are computed as rows of boxes, shape (ne,).

    All boxes are, but none if there are fewer than ``FEW`` (64) of them among elements of other shapes.

    Args:
        elements: Elements of one kind; may be empty.
    """
    box = is_box(elements.points[elements.cells])
    return box if box.all() or np.sum(box) >= FEW else np.zeros_like(box)


def align_boxes(elements: Elements) -> Elements:
    """Return a copy of boxes with their nodes in tensor order: bit d of a local index is the side in direction d.

    Args:
        elements: Hexahedra that are boxes along the axes (``is_box``), in any node order.
    """
    corners = elements.points[elements.cells]
    upper = corners > 0.5 * (corners.min(axis=1, keepdims=True) + corners.max(axis=1, keepdims=True))
    order = np.argsort(upper @ np.array([1, 2, 4]), axis=1)
    cells = np.take_along_axis(elements.cells, order, axis=1)
    return replace(elements, cells=cells)


def parity_blocks(stiffness: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the parity blocks of box stiffnesses.

    Args:
        stiffness: Stiffness of each shape, nodes in tensor order, shape (ns, 24, 24) [N/m].

    Returns:
        The 3 x 3 block of each parity (bit d: odd along direction d) divided by 8, entries 00 01 02 11 12 22, shape
        (ns, 8, 6) [N/m]. Component c of the block of parity p belongs to the mode of parity p XOR 2^c.

    Raises:
        ValueError: A stiffness lacks the three mirror planes of a box.
    """
    tensor = stiffness.reshape(-1, 8, 3, 8, 3)
    modes = np.einsum("pa,saibj,qb->spiqj", SIGNS, tensor, SIGNS, optimize=True) / 8.0
    parity, axes = np.arange(8)[:, None], np.arange(3)
    index = parity ^ (1 << axes)
    blocks = modes[:, index[:, :, None], axes[None, :, None], index[:, None, :], axes[None, None, :]]
    lost = np.sqrt(np.maximum(np.sum(modes**2, axis=(1, 2, 3, 4)) - np.sum(blocks**2, axis=(1, 2, 3)), 0.0))
    if np.any(lost > 1e-6 * np.sqrt(np.sum(modes**2, axis=(1, 2, 3, 4)))):
        raise ValueError("a stiffness without the mirror symmetry of a box cannot be split into parity blocks")
    return np.ascontiguousarray(blocks[:, :, UPPER[0], UPPER[1]] / 8.0)
