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
    """The bedding of the facets of this rank's elements; a ``force.ForceTerm``.

    Attributes:
        name: Of the support.
        stiffness: ``(3,)`` [N/m^3] along x, y, z.
        cells: ``(nf,)`` local cell of each facet.
        facets: ``(nf, m)`` local nodes.
        nodes: ``(k,)`` local nodes of all of them.
        matrix: ``(k, k)`` [m^2] integral of products of their shape functions.
        history: Empty: the force follows from the displacement.
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
        cls, name: str, local: LocalMesh, found: OutwardFacets, stiffness: tuple[float, float, float]
    ) -> "BeddedFacets":
        """Take the facets of this rank's elements; ``stiffness`` [N/m^3] along x, y, z."""
        cells = local.locate_cells(found.cells)
        here = cells >= 0
        facets = local.locate(found.facets[here].ravel()).reshape(-1, found.facets.shape[1]).astype(np.int32)
        blocks = bedding_matrices(local.points[facets])
        nodes, place = np.unique(facets, return_inverse=True)
        place = place.reshape(facets.shape)
        row, column = np.broadcast_to(place[:, :, None], blocks.shape), np.broadcast_to(place[:, None], blocks.shape)
        size = len(nodes), len(nodes)
        matrix = scipy.sparse.coo_matrix((blocks.ravel(), (row.ravel(), column.ravel())), shape=size).tocsr()
        return cls(name, np.array(stiffness), cells[here], facets, nodes, matrix)

    def force(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the forces ``(k, 3)`` [N] on its nodes at a displacement ``(n, 3)`` [m] of all nodes."""
        return -(self.matrix @ displacement[self.nodes]) * self.stiffness

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Add them to ``force (n, 3)`` [N]."""
        force[self.nodes] += self.force(displacement)

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the strain energy of the springs."""
        return Energy(strain=-0.5 * float(np.vdot(displacement[self.nodes], self.force(displacement))))

    def stiffness_matrix(self, count: int) -> scipy.sparse.csr_matrix:
        """Return K ``(3 n, 3 n)`` [N/m] for ``n = count`` nodes."""
        spread = scipy.sparse.csr_matrix(
            (np.ones(len(self.nodes)), (self.nodes, np.arange(len(self.nodes)))), shape=(count, len(self.nodes))
        )
        return scipy.sparse.kron(spread @ self.matrix @ spread.T, scipy.sparse.diags(self.stiffness), format="csr")
