"""Hexahedra that yield, by deformation plasticity: their forces, tangents and integration points at a displacement."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import CHUNK, Elements
from reflowshock.fem.elements.kind import strain_matrix
from reflowshock.fem.elements.one_point import hourglass_control, transformed
from reflowshock.fem.errors import MeshError, ModesError
from reflowshock.fem.forces.force_assembled import AssembledElements, upper_pattern
from reflowshock.fem.kernels.force import assemble_upper_blocks
from reflowshock.fem.kernels.hencky import ElementState, Shape, hexahedra, hourglass_share, one_point
from reflowshock.materials.parameters import Material
from reflowshock.materials.plasticity import plastic_constants


@dataclass(frozen=True, slots=True)
class Points:
    """The state of elements at their integration points.

    Attributes:
        stress: ``(ne, m, 6)`` [Pa].
        plastic_strain: ``(ne, m)`` equivalent plastic strain.
        stretched: ``(ne, 12)`` [m] elastic part of the amplitudes of hourglass modes; no columns for other elements.
        hourglass_energy: ``(ne,)`` [J] of that part.
    """

    stress: NDArray[np.float64]
    plastic_strain: NDArray[np.float64]
    stretched: NDArray[np.float64]
    hourglass_energy: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ElementResponse:
    """Points of elements, forces ``(ne, 24)`` [N] of their nodes, tangents ``(ne, 24, 24)`` [N/m]."""

    points: Points
    force: NDArray[np.float64]
    tangent: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class HenckyElements:
    """Hexahedra, elastic ones among them or not.

    Free expansion is a linear field in each element: its nodes' displacement less that field is what strains it.

    Attributes:
        elements: The elements.
        laws: ``(nm, 6)`` rows of ``materials.plasticity.plastic_constants``.
        expansion: ``(nm, 3)`` strain along x, y, z at which each material is free of stress.
    """

    elements: Elements
    laws: NDArray[np.float64]
    expansion: NDArray[np.float64]

    @classmethod
    def build(
        cls, elements: Elements, materials: Sequence[Material], expansion: NDArray[np.float64]
    ) -> "HenckyElements":
        """Take elements with the material of each index.

        Raises:
            MeshError: They are no hexahedra.
        """
        if len(elements.cells) and elements.kind.nodes != 8:
            raise MeshError(f"residual stress of elements that yield needs hexahedra, not {elements.kind.name}")
        return cls(elements, np.array([plastic_constants(material) for material in materials]), expansion)

    def straining(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement ``(ne, 24)`` [m] of each element's nodes less its free expansion."""
        elements = self.elements
        free = self.expansion[elements.material][:, None] * elements.points[elements.cells]
        return (displacement[elements.cells] - free).reshape(len(elements.cells), -1)

    def linearised(self, displacement: NDArray[np.float64]) -> tuple[NDArray[np.float64], AssembledElements]:
        """Return the internal force ``(n, 3)`` [N] at a displacement ``(n, 3)`` [m], and the tangent there."""
        pointer, columns = upper_pattern(self.elements.cells, len(self.elements.points))
        blocks, force = np.zeros((len(columns), 3, 3)), np.zeros_like(displacement)
        for some in self._chunks():
            response = some.respond(displacement)
            np.add.at(force, some.elements.cells, response.force.reshape(-1, 8, 3))
            assemble_upper_blocks(some.elements.cells, response.tangent, pointer, columns, blocks)
        return force, AssembledElements(pointer, columns, blocks)

    def points(self, displacement: NDArray[np.float64]) -> Points:
        """Return the state at a displacement ``(n, 3)`` [m]."""
        found = [some.respond(displacement).points for some in self._chunks()]
        names = ("stress", "plastic_strain", "stretched", "hourglass_energy")
        return Points(*(np.concatenate([getattr(item, name) for item in found]) for name in names))

    def respond(self, displacement: NDArray[np.float64]) -> ElementResponse:
        """Return points, forces and tangents at a displacement ``(n, 3)`` [m].

        Raises:
            ModesError: Incompatible modes found no equilibrium.
        """
        return self._one_point(displacement) if self.elements.kind.hourglass else self._fully(displacement)

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

    def _fully(self, displacement: NDArray[np.float64]) -> ElementResponse:
        elements, found = self.elements, self._empty(8)
        corners, count = elements.points[elements.cells], len(elements.cells)
        failed = hexahedra(corners, self.straining(displacement), self._materials, found)
        if failed < count:
            place = ", ".join(f"{value:.6g}" for value in corners[failed].mean(axis=0))
            raise ModesError(f"the incompatible modes of the element near ({place}) m found no equilibrium")
        state = Points(found.points[:, :, :6], found.points[:, :, 6], np.empty((count, 0)), np.zeros(count))
        return ElementResponse(state, found.force, found.tangent)

    def _one_point(self, displacement: NDArray[np.float64]) -> ElementResponse:
        elements, found, values = self.elements, self._empty(1), self.straining(displacement)
        corners, count = elements.points[elements.cells], len(elements.cells)
        geometry = elements.kind.geometry(corners)
        volume = geometry.volume
        one_point(Shape(strain_matrix(geometry.gradient)[:, None], volume[:, None]), values, self._materials, found)
        gamma, stiffness = hourglass_control(corners, elements.elasticity, elements.material)
        amplitude = np.einsum("eak,eai->eki", gamma, values.reshape(-1, 8, 3)).reshape(count, 12)
        elastic = np.einsum("eij,ej->ei", stiffness, amplitude)
        energy = np.maximum(0.5 * np.sum(amplitude * elastic, axis=1), 0.0)
        share = self._share(found.points, energy / volume)
        nodal = np.einsum("eak,eki->eai", gamma, (share[:, None] * elastic).reshape(-1, 4, 3))
        along = np.where(share < 1.0, share / np.where(energy > 0.0, 2.0 * energy, 1.0), 0.0)[:, None, None]
        stiffness = share[:, None, None] * stiffness - along * elastic[:, :, None] * elastic[:, None]
        state = Points(found.points[:, :, :6], found.points[:, :, 6], share[:, None] * amplitude, share**2 * energy)
        tangent = found.tangent + transformed(gamma, stiffness)
        return ElementResponse(state, found.force + nodal.reshape(count, 24), tangent)

    def _share(self, points: NDArray[np.float64], density: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the share ``(ne,)`` of elastic hourglass forces of an energy density [J/m^3] that sections carry."""
        elements, share = self.elements, np.empty(len(density))
        young = (1.0 / np.linalg.inv(elements.elasticity)[:, 0, 0])[elements.material]
        hourglass_share(points, np.sqrt(2.0 * young * density), self.laws[elements.material], share)
        return share


def free_expansion(materials: Sequence[Material], change: float) -> NDArray[np.float64]:
    """Return the free strain ``(nm, 3)`` along x, y, z of materials at a change of temperature [K].

    Raises:
        ValueError: A material's expansion is not given.
    """
    return change * np.array([material.expansion for material in materials])
