"""Internal force of elements of any kind and shape: one assembled matrix of 3 x 3 blocks."""

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from reflowshock.fem.elements.element import CHUNK, Elements, element_stiffness
from reflowshock.fem.elements.mean_strain import MeanStrain
from reflowshock.fem.forces.energy import Energy, linear_energy
from reflowshock.fem.kernels.force import add_block_force, assemble_upper_blocks


@dataclass(frozen=True, slots=True)
class AssembledElements:
    """Upper triangle of a stiffness in block rows, as a ``force.ForceTerm``.

    Attributes:
        pointer: Start of each block row, shape (n + 1,) int32.
        columns: Column of each block, shape (nz,) int32.
        blocks: Blocks of the upper triangle, shape (nz, 3, 3) [N/m].
        mean: Mean strains of elements with hourglass control, otherwise None.
        history: Empty, because the force follows from the displacement.
    """

    pointer: NDArray[np.int32]
    columns: NDArray[np.int32]
    blocks: NDArray[np.float64]
    mean: MeanStrain | None = None
    history: dict[str, NDArray] = field(default_factory=dict)

    @classmethod
    def build(cls, elements: Elements) -> "AssembledElements":
        """Assemble the stiffness of the elements."""
        pointer, columns = upper_pattern(elements.cells, len(elements.points))
        blocks = np.zeros((len(columns), 3, 3))
        for start in range(0, len(elements.cells), CHUNK):
            some = elements.subset(np.arange(start, min(start + CHUNK, len(elements.cells))))
            assemble_upper_blocks(some.cells, element_stiffness(some), pointer, columns, blocks)
        return cls(pointer, columns, blocks, MeanStrain.of(elements))

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract K u at a displacement ``(n, 3)`` [m] from ``force (n, 3)`` [N]."""
        add_block_force(self.pointer, self.columns, self.blocks, displacement, force)

    @property
    def arrays(self) -> dict[str, tuple[NDArray, ...]]:
        """Entry of ``kernels.levels.ForceArrays`` by name."""
        return {"assembled": (self.pointer, self.columns, self.blocks)}

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the strain energy."""
        return linear_energy(self, displacement, self.mean)


def upper_pattern(cells: NDArray[np.int32], count: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the sparsity pattern of the upper triangle (with diagonal) of a matrix over nodes, in compressed rows.

    Args:
        cells: Nodes of each element, shape (ne, k); nodes of an element are coupled with each other.
        count: Number of nodes.

    Returns:
        First entry of each row, and the number of entries, shape (count + 1,); columns, ascending in a row, (nb,).
    """
    membership = scipy.sparse.csr_matrix(
        (np.ones(cells.size, np.int32), (cells.ravel(), np.repeat(np.arange(len(cells)), cells.shape[1]))),
        shape=(count, len(cells)),
    )
    graph = scipy.sparse.triu(membership @ membership.T, format="csr")
    graph.sort_indices()
    return graph.indptr.astype(np.int32), graph.indices.astype(np.int32)
