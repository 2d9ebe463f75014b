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
    """Elements of one kind and their materials.

    Attributes:
        points: Nodes, shape (n, 3) [m].
        cells: Nodes of each element, shape (ne, k) int32; order as in DOLFINx, tensor order for hexahedra.
        material: Index of each element into ``elasticity``, shape (ne,) int32.
        elasticity: Elasticity of each material, shape (nm, 6, 6) [Pa].
        density: Density of each element, shape (ne,) [kg/m^3].
        kind: Kind of element.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int32]
    material: NDArray[np.int32]
    elasticity: NDArray[np.float64]
    density: NDArray[np.float64]
    kind: ElementKind = HEXAHEDRON

    def subset(self, chosen: NDArray[np.bool_] | NDArray[np.integer]) -> "Elements":
        """Return some of the elements, by mask or indices, with the same points."""
        return replace(self, cells=self.cells[chosen], material=self.material[chosen], density=self.density[chosen])


def element_kind(nodes: int, formulation: str = HEXAHEDRON.name) -> ElementKind:
    """Return the kind of element, with its integrals and stiffness, by number of nodes and formulation.

    Args:
        nodes: 4 or 10 for tetrahedra, 8 for hexahedra.
        formulation: ``incompatible_modes`` or ``one_point`` for hexahedra; not used for tetrahedra.

    Raises:
        KeyError: No element has that number of nodes or that formulation.
    """
    if nodes == HEXAHEDRON.nodes:
        return {kind.name: kind for kind in (HEXAHEDRON, ONE_POINT)}[formulation]
    return {kind.nodes: kind for kind in (TETRAHEDRON, TETRAHEDRON_QUADRATIC)}[nodes]


def element_geometry(points: NDArray[np.float64], cells: NDArray[np.int32]) -> Geometry:
    """Return nodal volumes, mean gradients and lowest Jacobian determinants of elements; formulations share them.

    Args:
        points: Nodes, shape (n, 3) [m].
        cells: Nodes of each element, shape (ne, k), k = 4, 8 or 10.

    Returns:
        Volume of each node in each element, shape (ne, k) [m^3]; volume average of the gradient of each shape function,
        shape (ne, k, 3) [1/m]; smallest Jacobian determinant at the integration points, shape (ne,) [m^3].

    Raises:
        MeshError: The Jacobian determinant of an element is not positive at an integration point.
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
    """Return the linear elastic stiffness of each element, node by node, shape (ne, 3k, 3k) [N/m].

    Args:
        elements: Elements of one kind with k nodes, and their materials.
    """
    return elements.kind.stiffness(elements.points[elements.cells], elements.elasticity, elements.material)


def lumped_mass(elements: Elements, nodal_volume: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lumped mass of each node, shape (n,) [kg]; not summed over ranks.

    Args:
        elements: Elements of this rank, with density, at n points.
        nodal_volume: Volume of each node in each element, shape (ne, k) [m^3].
    """
    mass = np.zeros(len(elements.points))
    np.add.at(mass, elements.cells, elements.density[:, None] * nodal_volume)
    return mass


def critical_steps(
    elements: Elements,
    nodal_volume: NDArray[np.float64],
    stiffness: Callable[[Elements], NDArray[np.float64]] = element_stiffness,
) -> NDArray[np.float64]:
    """Return the critical step of central differences of each single element, shape (ne,) [s].

    It is 2 / omega_max, with omega_max^2 the largest eigenvalue of M_e^-1 K_e.

    Their minimum bounds the critical step of an assembled model from below (Irons' bound), also with tied nodes, whose
    weights are not negative. Elements of equal shape and material are computed once.

    Args:
        elements: Elements of one kind.
        nodal_volume: Volume of each node in each element, shape (ne, k) [m^3].
        stiffness: Function of some of the elements that returns their stiffness, shape (ne, 3k, 3k) [N/m].
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
    """Group elements that are translations of each other, with equal material and density.

    Args:
        elements: Elements of one kind.

    Returns:
        Index of one element of each class, shape (nc,), and class 0 to nc - 1 of each element, shape (ne,) int32.
        Shapes count as equal within 1e-12 of the extent of the model.
    """
    corners = elements.points[elements.cells]
    extent = float(np.ptp(elements.points, axis=0).max())
    shape = np.round((corners[:, 1:] - corners[:, :1]) / (1e-12 * extent)).astype(np.int64).reshape(len(corners), -1)
    density = np.ascontiguousarray(elements.density).view(np.int64)
    keys = np.ascontiguousarray(np.column_stack([shape, elements.material, density]))
    rows = keys.view([("", keys.dtype)] * keys.shape[1]).reshape(-1)
    _, first, label = np.unique(rows, return_index=True, return_inverse=True)
    return first, label.reshape(-1).astype(np.int32)
