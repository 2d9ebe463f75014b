"""One model on one rank: elements, masses, force terms, tie. All that a substep needs."""

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
    """One model on one rank, ready to move.

    Attributes:
        local: The rank's mesh.
        elements: Its elements with their density, mass scaling included.
        geometry: Their volumes and mean gradients.
        terms: Force terms.
        paces: In how many steps of the model each of the first terms acts once, by impulses (``path_levels``); the
            others act in each step.
        schedule: The paces of the model's terms on all ranks.
        element_paces: ``(ne,)`` those of the elements; empty where all act in each step.
        tie: Slaves and masters, local numbers.
        shared: Nodes that several ranks hold.
        interface: ``(nc,)`` local number of each interface node, -1 where another rank has it.
        mass: ``(n,)`` [kg] lumped mass, of slaves moved to their masters.
        free: ``(n, 3)`` whether a displacement component follows from forces.
        initial_stress: ``(ne, 6)`` [Pa] mean stress of linear elements at no displacement; None where there is none.
        lumped: Lumped masses at the nodes that this rank counts [kg].
        begin: Gives elements with a path, on the nodes of the body, the stress in which it begins.
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
        """Return the terms, each with its pace."""
        return list(zip(self.terms, (*self.paces, *(1,) * (len(self.terms) - len(self.paces))), strict=True))

    @property
    def node_paces(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Return the smallest pace of the elements of each slave ``(ns,)`` and of each node ``(n,)``."""
        return paces_of_nodes(self.elements.cells, self.element_paces, self.tie, len(self.mass), max(self.schedule))

    @property
    def turns(self) -> bool:
        """Return whether rotations of elements on this rank are more than small."""
        return any(
            isinstance(term, Corotational) or (isinstance(term, NonlinearElements) and term.finite)
            for term in self.terms
        )


def paces_of_nodes(
    cells: NDArray[np.integer], paces: NDArray[np.int32], tie: Tie, count: int, largest: int
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the smallest pace of the elements of each slave ``(ns,)`` and of each of ``count`` nodes.

    Args:
        cells: ``(ne, k)`` nodes.
        paces: ``(ne,)`` of the elements, or none.
        tie: Elements of slaves act on their masters, too.
        count: Number of nodes.
        largest: What nodes without elements have.
    """
    node = np.full(count, largest, np.int32)
    if len(paces):
        np.minimum.at(node, cells, paces[:, None])
    slave = node[tie.slave]
    np.minimum.at(node, tie.master, slave[:, None])
    return slave, node
