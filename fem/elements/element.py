"""Elements of one kind with materials: stiffness, lumped mass, critical time steps."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.hexahedron import HEXAHEDRON
from reflowshock.fem.elements.kind import ElementKind, Geometry
from reflowshock.fem.elements.one_point import ONE_POINT
from reflowshock.fem.elements.tetrahedron import TETRAHEDRON, TETRAHEDRON_QUADRATIC
from reflowshock.fem.errors import MeshError

CHUNK = 2048  # elements whose matrices are in memory at a time (hexahedra: 9 MiB)


@dataclass(frozen=True, slots=True)
class Elements:
    """Elements and their materials.

    Attributes:
        points: ``(n, 3)`` [m].
        cells: ``(ne, k)`` int32; node order as in DOLFINx, tensor order for hexahedra.
        material: ``(ne,)`` int32, index into ``elasticity``.
        elasticity: ``(nm, 6, 6)`` [Pa].
        density: ``(ne,)`` [kg/m^3].
        kind: What the elements are.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int32]
    material: NDArray[np.int32]
    elasticity: NDArray[np.float64]
    density: NDArray[np.float64]
    kind: ElementKind = HEXAHEDRON

    def subset(self, chosen: NDArray[np.bool_] | NDArray[np.integer]) -> "Elements":
        """Return some of the elements on the same points."""
        return replace(self, cells=self.cells[chosen], material=self.material[chosen], density=self.density[chosen])


def element_kind(nodes: int, formulation: str = HEXAHEDRON.name) -> ElementKind:
    """Return the kind of elements with so many nodes; only hexahedra have more than one formulation."""
    if nodes == HEXAHEDRON.nodes:
        return {kind.name: kind for kind in (HEXAHEDRON, ONE_POINT)}[formulation]
    return {kind.nodes: kind for kind in (TETRAHEDRON, TETRAHEDRON_QUADRATIC)}[nodes]


def element_geometry(points: NDArray[np.float64], cells: NDArray[np.int32]) -> Geometry:
    """Integrate over elements; all formulations with the same nodes have the same integrals.

    Raises:
        MeshError: An element is turned inside out.
    """
    result = element_kind(cells.shape[1]).geometry(points[cells])
    lowest = result.lowest
    if np.any(lowest <= 0.0):
        worst = int(np.argmin(lowest))
        centre = ", ".join(f"{value:.6g}" for value in points[cells[worst]].mean(axis=0))
        raise MeshError(
            f"{np.sum(lowest <= 0.0)} of {len(cells)} elements have a zero or negative Jacobian determinant, the"
            f" lowest is {lowest[worst]:.3e} m^3 of element {worst} near ({centre}) m"
        )
    return result


def element_stiffness(elements: Elements) -> NDArray[np.float64]:
    """Return the stiffness ``(ne, 3k, 3k)`` [N/m] of each element."""
    return elements.kind.stiffness(elements.points[elements.cells], elements.elasticity, elements.material)


def lumped_mass(elements: Elements, nodal_volume: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lumped mass ``(n,)`` [kg] from the nodes' shares ``(ne, k)`` [m^3] in the volumes."""
    mass = np.zeros(len(elements.points))
    np.add.at(mass, elements.cells, elements.density[:, None] * nodal_volume)
    return mass


def critical_steps(
    elements: Elements,
    nodal_volume: NDArray[np.float64],
    stiffness: Callable[[Elements], NDArray[np.float64]] = element_stiffness,
) -> NDArray[np.float64]:
    """Return the critical time step of each element on its own: ``(ne,)`` [s], 2 / omega_max of M_e^-1 K_e.

    No assembled model has a smaller one (Irons' bound); this holds for tied nodes too, whose weights are not negative.
    Elements of equal shape and material are computed once.

    Args:
        elements: The elements.
        nodal_volume: ``(ne, k)`` [m^3] shares of the nodes.
        stiffness: Returns the stiffness ``(ne, 3k, 3k)`` [N/m] of elements.
    """
    first, shape = classes(elements)
    frequency = np.empty(len(first))
    for start in range(0, len(first), CHUNK):
        chosen = first[start : start + CHUNK]
        scale = np.repeat(1.0 / np.sqrt(elements.density[chosen][:, None] * nodal_volume[chosen]), 3, axis=1)
        scaled = scale[:, :, None] * stiffness(elements.subset(chosen)) * scale[:, None, :]
        frequency[start : start + CHUNK] = np.sqrt(np.linalg.eigvalsh(scaled)[:, -1])
    return (2.0 / frequency)[shape]


def classes(elements: Elements) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Group elements that are translations of each other, of one material and density.

    Returns:
        One element of each class, and the class of each element ``(ne,)`` int32. Shapes are equal within 1e-12 of the
        model's extent.
    """
    corners = elements.points[elements.cells]
    extent = float(np.ptp(elements.points, axis=0).max())
    shape = np.round((corners[:, 1:] - corners[:, :1]) / (1e-12 * extent)).astype(np.int64).reshape(len(corners), -1)
    density = np.ascontiguousarray(elements.density).view(np.int64)
    keys = np.ascontiguousarray(np.column_stack([shape, elements.material, density]))
    rows = keys.view([("", keys.dtype)] * keys.shape[1]).reshape(-1)
    _, first, label = np.unique(rows, return_index=True, return_inverse=True)
    return first, label.reshape(-1).astype(np.int32)
