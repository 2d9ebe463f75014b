"""Stiffness and mass of a model as PETSc matrices over its free displacement components: held ones and ties removed."""

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
    """One equation per free displacement component; the lowest rank that holds a node has its equations.

    Attributes:
        comm: Communicator of the model.
        body: The model on this rank.
        number: ``(n, 3)`` int32 equation of each component, numbered over all ranks, -1 where it is held or a slave's.
        own: ``(n, 3)`` whether this rank has the equation.
        total: Equations of all ranks.
    """

    comm: MPI.Comm
    body: Body
    number: NDArray[np.int32]
    own: NDArray[np.bool_]
    total: int

    @classmethod
    def of(cls, comm: MPI.Comm, body: Body) -> "Equations":
        """Number the free components of a model; collective.

        Raises:
            ValueError: No component is free; on every rank.
        """
        own = body.free & body.shared.owned[:, None]
        counts = comm.allgather(int(own.sum()))
        total, first = sum(counts), sum(counts[: comm.rank])
        if not total:
            raise ValueError("the supports hold every node: there is no equation to solve")
        number = np.where(own, first + np.cumsum(own).reshape(own.shape) - 1.0, 0.0)
        body.shared.add(number)
        return cls(comm, body, np.where(body.free, number, -1.0).astype(np.int32), own, total)

    @property
    def layout(self) -> tuple[int, int]:
        """Return the number of this rank's equations and of all."""
        return int(self.own.sum()), self.total

    def vector(self, values: NDArray[np.float64]) -> PETSc.Vec:
        """Return a vector of the free components of ``values (n, 3)``."""
        vector = PETSc.Vec().createMPI(self.layout, comm=self.comm)
        vector.array = values[self.own]
        return vector

    def spread(self, vector: PETSc.Vec, values: NDArray[np.float64]) -> None:
        """Write a vector into ``values (n, 3)``: all copies of its nodes, slaves with their masters, held ones zero."""
        values.fill(0.0)
        values[self.own] = vector.array
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
        known = (row >= 0) & (column >= 0)
        row, column, value = self.to_owners(row[known], column[known], local.data[known])
        rows, first = self.layout[0], int(self.number[self.own].min(initial=self.total))
        mine = scipy.sparse.csr_matrix((value, (row - first, column)), shape=(rows, self.total))
        matrix = PETSc.Mat().createAIJ(
            (self.layout, self.layout), csr=(mine.indptr, mine.indices, mine.data), comm=self.comm
        )
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        return matrix

    def to_owners(
        self, row: NDArray[np.int32], column: NDArray[np.int32], value: NDArray[np.float64]
    ) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float64]]:
        """Send matrix entries to the ranks that have their rows; return those that arrive here, in rank order."""
        ends = np.cumsum(self.comm.allgather(self.layout[0]))
        owner = np.searchsorted(ends, row, side="right")
        mine = owner == self.comm.rank
        others = [(owner == rank) & ~mine for rank in range(self.comm.size)]
        arrived = self.comm.alltoall([(row[part], column[part], value[part]) for part in others])
        arrived[self.comm.rank] = row[mine], column[mine], value[mine]
        rows, columns, values = (np.concatenate(arrays) for arrays in zip(*arrived, strict=True))
        return rows, columns, values


def tied_stiffness(body: Body) -> scipy.sparse.csr_matrix:
    """Return T^T K T of this rank's elements and elastic supports ``(3 n, 3 n)`` [N/m]; zero for slaves."""
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
