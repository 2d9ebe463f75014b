"""Rigid board and package, for a reflow in which the package floats but nothing expands or bends."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import element_geometry, lumped_mass
from reflowshock.fem.elements.mesh_elements import elements_of
from reflowshock.fem.mesh.mesh_file import read_mesh
from reflowshock.fem.statics.pads import pad_matrix
from reflowshock.fem.statics.state import Assembly, HeatedState, RigidModes, check_loads
from reflowshock.fem.statics.thermal_tables import connect_board, find_die_corners, thermal_tables
from reflowshock.materials.roles import materials_of_parts


class RigidPlates:
    """Rigid plates as a ``HeatedStructure``; the package floats, or follows the die corners.

    Attributes:
        points: Nodes in the undeformed state, shape (n, 3) [m].
        package: Whether a node belongs to the package, shape (n,).
        rigid_modes: Free rigid-body motions of the package.
    """

    def __init__(self, assembly: Assembly) -> None:
        """Read the mesh.

        Raises:
            MeshError: The mesh does not fit the pads or the materials.
        """
        mesh = connect_board(read_mesh(assembly.mesh))
        tables = thermal_tables(mesh, assembly.pads.centres[:, 1].mean(axis=0))
        _, materials = materials_of_parts(mesh.part_names, assembly.materials)
        elements = elements_of(mesh.points, mesh.cells, mesh.part, materials)
        mass = lumped_mass(elements, element_geometry(mesh.points, mesh.cells).nodal_volume)
        self.points, self.package = mesh.points, tables.package
        self._pads = pad_matrix(mesh, assembly.pads)
        self._moved = assembly.thermal.package == "moved"
        motions = tables.motions[1]
        fields = motions.fields(mesh.points) * tables.package[:, None]
        corners = find_die_corners(mesh) if self._moved else np.empty(0, np.intp)
        at_corners = fields[:, corners, 2]
        held = np.abs(at_corners).max(axis=1, initial=0.0) > 0.0
        weight = -assembly.gravity * fields[:, :, 2] @ mass
        self._free = fields[~held]
        self._held = fields[held]
        self._shares, self._held_weight = np.linalg.pinv(at_corners[held]), weight[held]
        names = tuple(name for name, is_held in zip(motions.names, held, strict=True) if not is_held)
        pad_motion = [self._motion(field) for field in self._free]
        shape = (len(names), len(assembly.pads.names), 2, 6)
        self.rigid_modes = RigidModes(names, np.reshape(pad_motion, shape), weight[~held])

    @cached_property
    def _held_motion(self) -> NDArray[np.float64]:
        """Pad motion for a unit of each package motion fixed by the corners, shape (m, joints, 2, 6)."""
        return np.array([self._motion(field) for field in self._held]).reshape(
            -1, *self.rigid_modes.pad_motion.shape[1:]
        )

    def solve(
        self, temperature: float, corner: float, wrenches: NDArray[np.float64], rigid: NDArray[np.float64]
    ) -> HeatedState:
        """Return the state, see ``HeatedStructure.solve``; the temperature has no effect."""
        check_loads(self.rigid_modes, wrenches, rigid)
        displacement = np.tensordot(rigid, self._free, 1)
        if self._moved:
            displacement[self.package, 2] += corner
        load = self._held_weight + np.tensordot(self._held_motion, wrenches, 3)
        return HeatedState(displacement, self._motion(displacement), -self._shares @ load)

    def _motion(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        return (self._pads @ displacement.ravel()).reshape(-1, 2, 6)
