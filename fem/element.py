"""Hexahedra with materials: stiffness, lumped mass, critical time steps."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem.errors import MeshError
from fem.kernels_hexahedron import geometry, stiffness

CHUNK = 2048  # elements whose 24 x 24 matrices are in memory at a time (9 MiB)


@dataclass(frozen=True, slots=True)
class Elements:
    """Hexahedra and their materials.

    Attributes:
        points: ``(n, 3)`` [m].
        cells: ``(ne, 8)`` int32, tensor order.
        material: ``(ne,)`` int32, index into ``elasticity``.
        elasticity: ``(nm, 6, 6)`` [Pa].
        density: ``(ne,)`` [kg/m^3].
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int32]
    material: NDArray[np.int32]
    elasticity: NDArray[np.float64]
    density: NDArray[np.float64]

    def subset(self, chosen: NDArray[np.bool_] | NDArray[np.integer]) -> "Elements":
        """Return some of the elements on the same points."""
        return Elements(self.points, self.cells[chosen], self.material[chosen], self.elasticity, self.density[chosen])


@dataclass(frozen=True, slots=True)
class Geometry:
    """Integrals over hexahedra: nodal volumes ``(ne, 8)`` [m^3] and mean gradients ``(ne, 8, 3)`` [1/m]."""

    nodal_volume: NDArray[np.float64]
    gradient: NDArray[np.float64]

    @property
    def volume(self) -> NDArray[np.float64]:
        """Return ``(ne,)`` [m^3]."""
        return self.nodal_volume.sum(axis=1)


def element_geometry(points: NDArray[np.float64], cells: NDArray[np.int32]) -> Geometry:
    """Integrate shape functions and gradients over hexahedra.

    Raises:
        MeshError: An element is turned inside out at a Gauss point.
    """
    result = Geometry(np.empty((len(cells), 8)), np.empty((len(cells), 8, 3)))
    lowest = geometry(points[cells], result.nodal_volume, result.gradient)
    if np.any(lowest <= 0.0):
        worst = int(np.argmin(lowest))
        centre = ", ".join(f"{value:.6g}" for value in points[cells[worst]].mean(axis=0))
        raise MeshError(
            f"{np.sum(lowest <= 0.0)} of {len(cells)} hexahedra have a negative Jacobian determinant, the lowest is"
            f" {lowest[worst]:.3e} m^3 near ({centre}) m"
        )
    return result


def element_stiffness(elements: Elements) -> NDArray[np.float64]:
    """Return the condensed stiffness ``(ne, 24, 24)`` [N/m] of each element; see ``kernels_hexahedron.stiffness``."""
    result = np.empty((len(elements.cells), 24, 24))
    stiffness(elements.points[elements.cells], elements.elasticity, elements.material, result)
    return result


def lumped_mass(elements: Elements, nodal_volume: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the row-sum lumped mass ``(n,)`` [kg]."""
    mass = np.zeros(len(elements.points))
    np.add.at(mass, elements.cells, elements.density[:, None] * nodal_volume)
    return mass


def critical_steps(elements: Elements, nodal_volume: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the critical time step of each element on its own: ``(ne,)`` [s], 2 / omega_max of M_e^-1 K_e.

    No assembled model has a smaller one (Irons' bound); this holds for tied nodes too, whose weights are not negative.
    Elements of equal shape and material are computed once.
    """
    first, shape = classes(elements)
    frequency = np.empty(len(first))
    for start in range(0, len(first), CHUNK):
        chosen = first[start : start + CHUNK]
        scale = np.repeat(1.0 / np.sqrt(elements.density[chosen][:, None] * nodal_volume[chosen]), 3, axis=1)
        scaled = scale[:, :, None] * element_stiffness(elements.subset(chosen)) * scale[:, None, :]
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
