"""Global stiffness and mass of a model in PETSc, over its free displacement components (supports and ties removed)."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from reflowshock.fem.forces.bedding import BeddedFacets
from reflowshock.fem.forces.force_assembled import AssembledElements
from reflowshock.fem.model.body import Body


@dataclass(frozen=True, slots=True)
class Equations:
    """Numbering of the free displacement components; the lowest rank that has a node owns its equations.

    Attributes:
        comm: Communicator of the model.
        body: Model on this rank.
        number: Global equation of each component, -1 if it is fixed or a slave's, shape (n, 3) int32.
        owned: Whether this rank owns the equation, shape (n, 3).
        total: Number of equations on all ranks.
    """

    comm: MPI.Comm
    body: Body
    number: NDArray[np.int32]
    owned: NDArray[np.bool_]
    total: int

    @classmethod
    def of(cls, comm: MPI.Comm, body: Body) -> "Equations":
        """Assign equation numbers to the free components of a model; collective.

        Raises:
            ValueError: No component is free; on every rank.
        """
        owned = body.free & body.shared.owned[:, None]
        counts = comm.allgather(int(owned.sum()))
        total, first = sum(counts), sum(counts[: comm.rank])
        if not total:
            raise ValueError("the supports fix every node, so there is no equation to solve; remove a support")
        number = np.where(owned, first + np.cumsum(owned).reshape(owned.shape) - 1.0, 0.0)
        body.shared.add(number)
        return cls(comm, body, np.where(body.free, number, -1.0).astype(np.int32), owned, total)

    @property
    def layout(self) -> tuple[int, int]:
        """Number of equations on this rank and on all ranks."""
        return int(self.owned.sum()), self.total

    def vector(self, values: NDArray[np.float64]) -> PETSc.Vec:
        """Return the PETSc vector of the free components of nodal values, shape (n, 3)."""
        vector = PETSc.Vec().createMPI(self.layout, comm=self.comm)
        vector.array = values[self.owned]
        return vector

    def spread(self, vector: PETSc.Vec, values: NDArray[np.float64]) -> None:
        """Write a PETSc vector into nodal values, shape (n, 3), with slaves; fixed components become zero."""
        values.fill(0.0)
        values[self.owned] = vector.array
        self.body.shared.add(values)
        self.body.tie.spread(values)

    def mass(self) -> PETSc.Vec:
        """Return the diagonal of the lumped mass matrix [kg]."""
        return self.vector(np.repeat(self.body.mass[:, None], 3, axis=1))

    def stiffness(self) -> PETSc.Mat:
        """Return the stiffness T^T K T [N/m] of the linear elastic elements, T the tie; collective."""
        local = tied_stiffness(self.body).tocoo()
        number = self.number.ravel()
        row, column = number[local.row], number[local.col]
        is_free = (row >= 0) & (column >= 0)
        row, column, value = self.to_owners(row[is_free], column[is_free], local.data[is_free])
        rows, first = self.layout[0], int(self.number[self.owned].min(initial=self.total))
        mine = scipy.sparse.csr_matrix((value, (row - first, column)), shape=(rows, self.total))
        matrix = PETSc.Mat().createAIJ(
            (self.layout, self.layout), csr=(mine.indptr, mine.indices, mine.data), comm=self.comm
        )
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        return matrix

    def to_owners(
        self, row: NDArray[np.int32], column: NDArray[np.int32], value: NDArray[np.float64]
    ) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float64]]:
        """Send matrix entries to the ranks that own their rows, and return the received ones in rank order."""
        ends = np.cumsum(self.comm.allgather(self.layout[0]))
        owner = np.searchsorted(ends, row, side="right")
        mine = owner == self.comm.rank
        others = [(owner == rank) & ~mine for rank in range(self.comm.size)]
        arrived = self.comm.alltoall([(row[part], column[part], value[part]) for part in others])
        arrived[self.comm.rank] = row[mine], column[mine], value[mine]
        rows, columns, values = (np.concatenate(arrays) for arrays in zip(*arrived, strict=True))
        return rows, columns, values


def tied_stiffness(body: Body) -> scipy.sparse.csr_matrix:
    """Return the stiffness T^T K T of this rank's linear elements and elastic supports; not collective.

    T expresses the displacement of tied slaves by their masters.

    Args:
        body: Model on this rank, with n nodes.

    Returns:
        Sparse matrix, node by node in local numbers, shape (3 n, 3 n) [N/m]; rows and columns of slaves are zero.
    """
    upper = AssembledElements.build(body.elements)
    size = 3 * len(body.mass)
    half = scipy.sparse.bsr_matrix((upper.blocks, upper.columns, upper.pointer), shape=(size, size))
    for term in body.terms:
        if isinstance(term, BeddedFacets):
            half = half + 0.5 * term.stiffness_matrix(len(body.mass))
    if len(body.tie.slave):
        tie = scipy.sparse.kron(body.tie.matrix(len(body.mass)), scipy.sparse.identity(3), format="csr")
        half = tie.T @ half @ tie
    half = half.tocsr()
    return (half + half.T).tocsr()
