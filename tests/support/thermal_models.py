"""Boards and packages for tests of thermoelasticity: layered strips and plates above a plain board, and their pads."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mpi4py import MPI

from reflowshock.cases.hard.trials.grids import COPPER, GAP, grid, mesh_of, on
from reflowshock.fem.mesh.mesh import MeshData, append
from reflowshock.fem.problem.thermal import Thermal
from reflowshock.fem.statics.pads import Pads
from reflowshock.fem.statics.state import Assembly
from reflowshock.fem.statics.structure import ThermalStructure
from reflowshock.materials.parameters import Isotropic
from reflowshock.materials.roles import ELASTIC, Materials
from tests.support.fem_models import SITES, write_msh, write_small_assembly

LIFT = 1e-3  # height of the lower face of the layers
REFERENCE = 298.15
STIFF = Isotropic(density=2330.0, young_modulus=130e9, poisson_ratio=0.0, thermal_expansion=2e-6)
SOFT = Isotropic(density=1900.0, young_modulus=25e9, poisson_ratio=0.0, thermal_expansion=16e-6)


@dataclass(frozen=True, slots=True)
class Layers:
    """Quarter of a plate [m]: substrate below, die above, ``cells`` along x, y and through either layer."""

    length: float
    width: float
    thickness: tuple[float, float]
    cells: tuple[int, int, int, int]

    def mesh(self, planes: Sequence[str] = ("symmetry_x", "symmetry_y")) -> MeshData:
        """Return board and package; the board is one cell of the same size with its top at z = 0."""
        x = np.linspace(0.0, 0.5 * self.length, self.cells[0] + 1)
        y = np.linspace(0.0, 0.5 * self.width, self.cells[1] + 1)
        lower = np.linspace(0.0, self.thickness[0], self.cells[2] + 1)
        upper = self.thickness[0] + np.linspace(0.0, self.thickness[1], self.cells[3] + 1)
        sides = {name: on(axis, 0.0) for axis, name in enumerate(("symmetry_x", "symmetry_y")) if name in planes}
        points, cells = grid(x, y, LIFT + np.concatenate([lower, upper[1:]]))
        height = points[cells].mean(axis=1)[:, 2] - LIFT
        part = np.where(height > self.thickness[0], "die", "substrate")
        package = mesh_of(points, cells, part, sides | {"package_side": on(2, LIFT)})
        board = mesh_of(*grid(x[[0, -1]], y[[0, -1]], [-1e-3, 0.0]), "board", sides | {"board_side": on(2, 0.0)})
        return append([board, package])


def structure_of(
    mesh: MeshData, folder: Path, pads: Pads, materials: Mapping, thermal: Mapping | None = None
) -> ThermalStructure:
    """Return the thermoelastic structure of a mesh, which is written to a folder.

    Args:
        mesh: Mesh of board and package.
        folder: Folder of the mesh file.
        pads: Names, positions and radii of the pads.
        materials: Role -> material or its name, as in a case.
        thermal: Parameters of the heating; None for the defaults.
    """
    path = folder / "assembly.msh"
    write_msh(mesh, path)
    materials_of_roles = Materials.model_validate(dict(materials))
    assembly = Assembly(path, pads, materials_of_roles, Thermal.model_validate(dict(thermal or {})), gravity=0.0)
    return ThermalStructure.build(MPI.COMM_SELF, assembly)


def pads_at(places: Sequence[tuple[float, float]], radius: float) -> Pads:
    """Return pads without copper, on the board at z = 0 and under the substrate, named J0, J1, ...

    Args:
        places: Coordinates x and y of the pads [m].
        radius: Wetted radius of all pads [m].
    """
    flat = np.array(places, float)
    centres = np.stack([np.column_stack([flat, np.full(len(flat), height)]) for height in (0.0, LIFT)], axis=1)
    return Pads([f"J{number}" for number in range(len(flat))], centres, np.full((len(flat), 2), radius))


def small_pads(radius: float = 0.2e-3) -> Pads:
    """Return the pads of ``fem_models.small_assembly``, on copper, with a wetted radius [m]."""
    centres = [[(x, y, COPPER), (x, y, COPPER + GAP)] for x, y in SITES.values()]
    return Pads(tuple(SITES), np.array(centres), np.full((len(SITES), 2), radius))


def small_structure(folder: Path, gravity: float = 9.81, **thermal) -> Assembly:
    """Write the mesh of the quarter package on its board and return the input of its heating.

    Args:
        folder: Folder of the mesh.
        gravity: Acceleration of gravity [m/s^2].
        thermal: Fields of ``Thermal``, the parameters of the heating.
    """
    mesh = write_small_assembly(folder)[0]
    return Assembly(mesh, small_pads(), ELASTIC, Thermal.model_validate(thermal), gravity)
