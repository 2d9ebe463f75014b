"""One model on one rank: elements, masses, force terms and tie, everything that a time step needs."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import Elements
from reflowshock.fem.elements.kind import Geometry
from reflowshock.fem.forces.force import ForceTerm
from reflowshock.fem.forces.force_corotational import Corotational
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.mesh.tie import Tie
from reflowshock.fem.parallel.exchange import SharedNodes
from reflowshock.fem.parallel.local_mesh import LocalMesh


@dataclass(frozen=True, slots=True)
class Body:
    """One model on one rank, ready for time integration.

    Attributes:
        local: Mesh of the rank.
        elements: Elements with their density, mass scaling included.
        geometry: Volumes and mean gradients of the elements.
        terms: Force terms.
        paces: Number of steps in which each of the first terms acts once by an impulse (``path_levels``); the other
            terms act in every step.
        schedule: Paces of the model's terms on all ranks.
        element_paces: Pace of each element, shape (ne,); empty if all elements act in every step.
        tie: Slaves and masters in local numbers.
        shared: Nodes shared with other ranks.
        interface: Local number of each interface node, -1 on another rank, shape (nc,).
        mass: Lumped mass, with the mass of slaves moved to their masters, shape (n,) [kg].
        free: Whether a displacement component follows from forces, shape (n, 3).
        initial_stress: Mean stress of linear elements at zero displacement, shape (ne, 6) [Pa], or None.
        lumped: Sum of the attached masses at the nodes that this rank owns [kg].
        begin: Function that sets the initial stress of path-dependent elements on the nodes of the body, or None.
    """

    local: LocalMesh
    elements: Elements
    geometry: Geometry
    terms: list[ForceTerm]
    tie: Tie
    shared: SharedNodes
    interface: NDArray[np.int32]
    mass: NDArray[np.float64]
    free: NDArray[np.bool_]
    initial_stress: NDArray[np.float64] | None = None
    lumped: float = 0.0
    begin: Callable[[NonlinearElements], None] | None = None
    paces: tuple[int, ...] = ()
    schedule: tuple[int, ...] = (1,)
    element_paces: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, np.int32))

    @property
    def paced(self) -> list[tuple[ForceTerm, int]]:
        """Force terms, each with its pace."""
        return list(zip(self.terms, (*self.paces, *(1,) * (len(self.terms) - len(self.paces))), strict=True))

    @property
    def node_paces(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Smallest pace of the elements at each slave, shape (ns,), and at each node, shape (n,)."""
        return paces_of_nodes(self.elements.cells, self.element_paces, self.tie, len(self.mass), max(self.schedule))

    @property
    def turns(self) -> bool:
        """Whether an element on this rank has finite rotations."""
        return any(
            isinstance(term, Corotational) or (isinstance(term, NonlinearElements) and term.finite)
            for term in self.terms
        )


def paces_of_nodes(
    cells: NDArray[np.integer], paces: NDArray[np.int32], tie: Tie, count: int, largest: int
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the smallest pace of the elements at each slave, shape (ns,), and at each node, shape (count,).

    A pace is the number of steps in which an element's force acts once.

    Args:
        cells: Nodes of each element, shape (ne, k).
        paces: Pace of each element, shape (ne,); empty if all elements act in every step, then all results are
            ``largest``.
        tie: Slaves, masters and weights of the model; elements of slaves also act on the masters.
        count: Number of nodes.
        largest: Pace of nodes without elements.
    """
    node = np.full(count, largest, np.int32)
    if len(paces):
        np.minimum.at(node, cells, paces[:, None])
    slave = node[tie.slave]
    np.minimum.at(node, tie.master, slave[:, None])
    return slave, node
