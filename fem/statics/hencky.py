"""Hexahedra with Hencky's deformation plasticity: forces, tangents and point values at a displacement."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import CHUNK, Elements
from reflowshock.fem.elements.kind import strain_matrix
from reflowshock.fem.elements.one_point import hourglass_control, transform_modes
from reflowshock.fem.errors import MeshError, ModesError
from reflowshock.fem.forces.force_assembled import AssembledElements, upper_pattern
from reflowshock.fem.kernels.force import assemble_upper_blocks
from reflowshock.fem.kernels.hencky import ElementState, Shape, hexahedra, hourglass_share, one_point
from reflowshock.materials.parameters import Material
from reflowshock.materials.plasticity import plastic_constants


@dataclass(frozen=True, slots=True)
class Points:
    """State of elements at their integration points.

    Attributes:
        stress: Stress, shape (ne, m, 6) [Pa].
        plastic_strain: Equivalent plastic strain, shape (ne, m).
        stretched: Elastic part of the hourglass amplitudes, shape (ne, 12) [m]; (ne, 0) without hourglass control.
        hourglass_energy: Energy of this part, shape (ne,) [J].
    """

    stress: NDArray[np.float64]
    plastic_strain: NDArray[np.float64]
    stretched: NDArray[np.float64]
    hourglass_energy: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ElementResponse:
    """Point values of elements, nodal forces, shape (ne, 24) [N], and tangents, shape (ne, 24, 24) [N/m]."""

    points: Points
    force: NDArray[np.float64]
    tangent: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class HenckyElements:
    """Elastic and elastic-plastic hexahedra under thermal expansion.

    Free expansion is a linear displacement field in each element; only the difference from it causes stress.

    Attributes:
        elements: Elements with their elasticity.
        laws: Plastic constants of each material, rows of ``materials.plasticity.plastic_constants``, shape (nm, 6).
        expansion: Free thermal strain of each material along x, y, z, shape (nm, 3).
    """

    elements: Elements
    laws: NDArray[np.float64]
    expansion: NDArray[np.float64]

    @classmethod
    def build(
        cls, elements: Elements, materials: Sequence[Material], expansion: NDArray[np.float64]
    ) -> "HenckyElements":
        """Build from elements and the material of each index.

        Raises:
            MeshError: The elements are not hexahedra.
        """
        if len(elements.cells) and elements.kind.nodes != 8:
            raise MeshError(f"residual stress of plastic elements is available for hexahedra, not {elements.kind.name}")
        return cls(elements, np.array([plastic_constants(material) for material in materials]), expansion)

    def straining(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the nodal displacements of each element minus its free expansion, shape (ne, 24) [m]."""
        elements = self.elements
        free = self.expansion[elements.material][:, None] * elements.points[elements.cells]
        return (displacement[elements.cells] - free).reshape(len(elements.cells), -1)

    def linearised(self, displacement: NDArray[np.float64]) -> tuple[NDArray[np.float64], AssembledElements]:
        """Return internal force, shape (n, 3) [N], and tangent at a displacement, shape (n, 3) [m]."""
        pointer, columns = upper_pattern(self.elements.cells, len(self.elements.points))
        blocks, force = np.zeros((len(columns), 3, 3)), np.zeros_like(displacement)
        for chunk in self._chunks():
            response = chunk.respond(displacement)
            np.add.at(force, chunk.elements.cells, response.force.reshape(-1, 8, 3))
            assemble_upper_blocks(chunk.elements.cells, response.tangent, pointer, columns, blocks)
        return force, AssembledElements(pointer, columns, blocks)

    def points(self, displacement: NDArray[np.float64]) -> Points:
        """Return the state of the integration points at a displacement, shape (n, 3) [m]."""
        parts = [chunk.respond(displacement).points for chunk in self._chunks()]
        names = ("stress", "plastic_strain", "stretched", "hourglass_energy")
        return Points(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def respond(self, displacement: NDArray[np.float64]) -> ElementResponse:
        """Return point values, forces and tangents at a displacement, shape (n, 3) [m].

        Raises:
            ModesError: The iteration for the incompatible modes of an element does not converge.
        """
        return self._one_point(displacement) if self.elements.kind.hourglass else self._fully_integrated(displacement)

    def _chunks(self) -> Iterator["HenckyElements"]:
        for start in range(0, len(self.elements.cells), CHUNK):
            chosen = np.arange(start, min(start + CHUNK, len(self.elements.cells)))
            yield HenckyElements(self.elements.subset(chosen), self.laws, self.expansion)

    def _empty(self, points: int) -> ElementState:
        count = len(self.elements.cells)
        return ElementState(np.empty((count, points, 7)), np.empty((count, 24)), np.empty((count, 24, 24)))

    @property
    def _materials(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int32]]:
        return self.elements.elasticity, self.laws, self.elements.material

    def _fully_integrated(self, displacement: NDArray[np.float64]) -> ElementResponse:
        elements, state = self.elements, self._empty(8)
        corners, count = elements.points[elements.cells], len(elements.cells)
        failed = hexahedra(corners, self.straining(displacement), self._materials, state)
        if failed < count:
            centre = ", ".join(f"{value:.6g}" for value in corners[failed].mean(axis=0))
            raise ModesError(f"the incompatible modes of the element near ({centre}) m did not converge")
        points = Points(state.points[:, :, :6], state.points[:, :, 6], np.empty((count, 0)), np.zeros(count))
        return ElementResponse(points, state.force, state.tangent)

    def _one_point(self, displacement: NDArray[np.float64]) -> ElementResponse:
        elements, state, values = self.elements, self._empty(1), self.straining(displacement)
        corners, count = elements.points[elements.cells], len(elements.cells)
        geometry = elements.kind.geometry(corners)
        volume = geometry.volume
        one_point(Shape(strain_matrix(geometry.gradient)[:, None], volume[:, None]), values, self._materials, state)
        gamma, stiffness = hourglass_control(corners, elements.elasticity, elements.material)
        amplitude = np.einsum("eak,eai->eki", gamma, values.reshape(-1, 8, 3)).reshape(count, 12)
        elastic = np.einsum("eij,ej->ei", stiffness, amplitude)
        energy = np.maximum(0.5 * np.sum(amplitude * elastic, axis=1), 0.0)
        share = self._share(state.points, energy / volume)
        nodal = np.einsum("eak,eki->eai", gamma, (share[:, None] * elastic).reshape(-1, 4, 3))
        along = np.where(share < 1.0, share / np.where(energy > 0.0, 2.0 * energy, 1.0), 0.0)[:, None, None]
        stiffness = share[:, None, None] * stiffness - along * elastic[:, :, None] * elastic[:, None]
        points = Points(state.points[:, :, :6], state.points[:, :, 6], share[:, None] * amplitude, share**2 * energy)
        tangent = state.tangent + transform_modes(gamma, stiffness)
        return ElementResponse(points, state.force + nodal.reshape(count, 24), tangent)

    def _share(self, points: NDArray[np.float64], density: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the carried fraction of elastic hourglass forces, shape (ne,), for their energy density [J/m^3]."""
        elements, share = self.elements, np.empty(len(density))
        young = (1.0 / np.linalg.inv(elements.elasticity)[:, 0, 0])[elements.material]
        hourglass_share(points, np.sqrt(2.0 * young * density), self.laws[elements.material], share)
        return share


def free_expansion(materials: Sequence[Material], change: float) -> NDArray[np.float64]:
    """Return the free thermal strain of materials along their axes x, y, z, shape (nm, 3).

    Args:
        materials: Materials, nm of them.
        change: Temperature change [K].

    Raises:
        ValueError: A material has no thermal expansion.
    """
    return change * np.array([material.expansion for material in materials])
