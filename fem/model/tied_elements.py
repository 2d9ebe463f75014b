"""Force terms of linear elements whose slaves are eliminated: no substep has to move them with their masters."""

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from reflowshock.fem.elements.element import Elements
from reflowshock.fem.forces.energy import InternalForce
from reflowshock.fem.forces.force_assembled import AssembledElements
from reflowshock.fem.forces.force_congruent import CongruentElements, in_rows
from reflowshock.fem.mesh.tie import Tie


def tied_terms(elements: Elements, tie: Tie) -> list[InternalForce]:
    """Return the force terms of linear elements at all nodes but the slaves, which must be the last ones.

    Boxes with a slave share no stiffness with others any more: they are assembled.
    """
    box = in_rows(elements) & ~np.isin(elements.cells, tie.slave).any(axis=1)
    terms: list[InternalForce] = []
    if box.any():
        terms.append(CongruentElements.build(elements.subset(box)))
    if not box.all():
        terms.append(without_slaves(AssembledElements.build(elements.subset(~box)), tie))
    return terms


def without_slaves(assembled: AssembledElements, tie: Tie) -> AssembledElements:
    """Return T^T K T of an assembled stiffness at all nodes but the slaves, T the tie."""
    if not len(tie.slave):
        return assembled
    count = len(assembled.pointer) - 1
    size = 3 * count
    half = scipy.sparse.bsr_matrix((assembled.blocks, assembled.columns, assembled.pointer), shape=(size, size))
    matrix = scipy.sparse.kron(tie.matrix(count), scipy.sparse.identity(3), format="csr")
    half = matrix.T @ half @ matrix
    both = (half + half.T).tocsr()
    both.eliminate_zeros()
    whole = both.tobsr((3, 3))
    whole.sort_indices()
    return upper_blocks(whole, count - len(tie.slave))


def upper_blocks(matrix: scipy.sparse.bsr_matrix, count: int) -> AssembledElements:
    """Return the first ``count`` block rows of a symmetric matrix: upper blocks, diagonal ones halved."""
    row = np.repeat(np.arange(matrix.shape[0] // 3), np.diff(matrix.indptr))
    kept = (row <= matrix.indices) & (row < count)
    columns = matrix.indices[kept].astype(np.int32)
    blocks: NDArray[np.float64] = matrix.data[kept]
    blocks[columns == row[kept]] *= 0.5
    pointer = np.concatenate([[0], np.cumsum(np.bincount(row[kept], minlength=count))]).astype(np.int32)
    return AssembledElements(pointer, columns, blocks)
