"""Elastic supports: springs per area of a facet set, from the body to the frame of the drop table."""

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from reflowshock.fem.forces.energy import Energy
from reflowshock.fem.mesh.facet import bedding_matrices
from reflowshock.fem.mesh.facet_areas import OutwardFacets
from reflowshock.fem.parallel.local_mesh import LocalMesh


@dataclass(frozen=True, slots=True)
class BeddedFacets:
    """Elastic support of the facets of this rank's elements, as a ``force.ForceTerm``.

    Attributes:
        name: Name of the support.
        stiffness: Stiffness per area along x, y, z, shape (3,) [N/m^3].
        cells: Local cell of each facet, shape (nf,).
        facets: Local nodes of each facet, shape (nf, m).
        nodes: Local nodes of all facets, shape (k,).
        matrix: Integrals of products of their shape functions, shape (k, k) [m^2].
        history: Empty, because the force follows from the displacement.
    """

    name: str
    stiffness: NDArray[np.float64]
    cells: NDArray[np.integer]
    facets: NDArray[np.int32]
    nodes: NDArray[np.int32]
    matrix: scipy.sparse.csr_matrix
    history: dict[str, NDArray] = field(default_factory=dict)

    @classmethod
    def build(
        cls, name: str, local: LocalMesh, outward: OutwardFacets, stiffness: tuple[float, float, float]
    ) -> "BeddedFacets":
        """Return the support of those facets that belong to this rank; ``stiffness`` [N/m^3] along x, y, z."""
        cells = local.locate_cells(outward.cells)
        here = cells >= 0
        facets = local.locate(outward.facets[here].ravel()).reshape(-1, outward.facets.shape[1]).astype(np.int32)
        blocks = bedding_matrices(local.points[facets])
        nodes, index = np.unique(facets, return_inverse=True)
        index = index.reshape(facets.shape)
        row, column = np.broadcast_to(index[:, :, None], blocks.shape), np.broadcast_to(index[:, None], blocks.shape)
        size = len(nodes), len(nodes)
        matrix = scipy.sparse.coo_matrix((blocks.ravel(), (row.ravel(), column.ravel())), shape=size).tocsr()
        return cls(name, np.array(stiffness), cells[here], facets, nodes, matrix)

    def force(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the forces ``(k, 3)`` [N] of the springs on ``nodes`` at a displacement ``(n, 3)`` [m]."""
        return -(self.matrix @ displacement[self.nodes]) * self.stiffness

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Add the forces of the springs at a displacement ``(n, 3)`` [m] to ``force (n, 3)`` [N]."""
        force[self.nodes] += self.force(displacement)

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the strain energy of the springs."""
        return Energy(strain=-0.5 * float(np.vdot(displacement[self.nodes], self.force(displacement))))

    def stiffness_matrix(self, count: int) -> scipy.sparse.csr_matrix:
        """Return the stiffness matrix ``(3 n, 3 n)`` [N/m] of a mesh with ``n = count`` nodes."""
        spread = scipy.sparse.csr_matrix(
            (np.ones(len(self.nodes)), (self.nodes, np.arange(len(self.nodes)))), shape=(count, len(self.nodes))
        )
        return scipy.sparse.kron(spread @ self.matrix @ spread.T, scipy.sparse.diags(self.stiffness), format="csr")
