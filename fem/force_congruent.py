"""Internal force of boxes: one stiffness per shape and material, diagonalised by symmetry.

A box of a material whose axes it shares has three mirror planes. In the Walsh-Hadamard basis of its eight nodes
the 24 x 24 stiffness falls into eight blocks of 3 x 3, one per parity: the modes of component c with parity p have
the index p XOR 2^c. A product costs 216 multiplications and additions instead of 1152, with one small table per shape.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fem.element import Elements, classes, element_stiffness
from fem.energy import Energy, linear_energy
from fem.kernels_force import add_box_force
from fem.mean_strain import MeanStrain

SIGNS = np.array([[(-1.0) ** bin(p & a).count("1") for a in range(8)] for p in range(8)])
UPPER = np.triu_indices(3)
BOX_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True)
class CongruentElements:
    """Boxes that share stiffnesses.

    Attributes:
        cells: ``(ne, 8)`` int32.
        shape: ``(ne,)`` int32, class of each element.
        blocks: ``(ns, 8, 6)`` [N/m], see ``kernels_force.add_box_force``.
        mean: Mean strains of elements with hourglass control.
        history: Empty.
    """

    cells: NDArray[np.int32]
    shape: NDArray[np.int32]
    blocks: NDArray[np.float64]
    mean: MeanStrain | None = None
    history: dict[str, NDArray] = field(default_factory=dict)

    @classmethod
    def build(cls, elements: Elements) -> "CongruentElements":
        """Group boxes (``is_box``) into classes and diagonalise the stiffness of each."""
        turned = aligned(elements)
        first, shape = classes(replace(turned, density=np.zeros(len(turned.cells))))
        blocks = parity_blocks(element_stiffness(turned.subset(first)))
        order = np.argsort(turned.cells.min(axis=1), kind="stable")
        return cls(np.ascontiguousarray(turned.cells[order]), shape[order], blocks, MeanStrain.of(elements))

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract K u from the force."""
        add_box_force(self.cells, self.blocks, self.shape, displacement, force)

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the strain energy."""
        return linear_energy(self, displacement, self.mean)


def is_box(corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which elements ``(ne, k, 3)`` are hexahedral boxes along the axes, whichever way they are numbered."""
    if corners.shape[1] != 8:
        return np.zeros(len(corners), dtype=bool)
    low, high = corners.min(axis=1, keepdims=True), corners.max(axis=1, keepdims=True)
    size = high - low
    upper = corners > 0.5 * (low + high)
    off = np.abs(corners - np.where(upper, high, low)) > BOX_TOLERANCE * size
    position = upper @ np.array([1, 2, 4])
    complete = np.all(np.sort(position, axis=1) == np.arange(8), axis=1)
    return complete & ~off.any(axis=(1, 2))


def aligned(elements: Elements) -> Elements:
    """Return boxes renumbered so that bit d of a local index is the side in coordinate direction d."""
    corners = elements.points[elements.cells]
    upper = corners > 0.5 * (corners.min(axis=1, keepdims=True) + corners.max(axis=1, keepdims=True))
    order = np.argsort(upper @ np.array([1, 2, 4]), axis=1)
    cells = np.take_along_axis(elements.cells, order, axis=1)
    return replace(elements, cells=cells)


def parity_blocks(stiffness: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the 3 x 3 blocks of box stiffnesses ``(ns, 24, 24)`` in symmetric storage, over 8: ``(ns, 8, 6)`` [N/m].

    Raises:
        ValueError: A stiffness lacks the mirror symmetry of a box.
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
