"""The cube of 40 x 40 x 40 hexahedra on which all force benchmarks are run, as boxes or distorted."""

import numpy as np

from fem.element import Elements
from fem.material_parameters import Isotropic
from fem.materials import elasticity_matrix
from fem.mesh import MeshData
from tests.support.fem_models import grid, mesh_of

EDGE = 40
LENGTH = 0.04  # [m]
STEEL = Isotropic(density=7850.0, young_modulus=210e9, poisson_ratio=0.3)
SHAKE = 0.2  # of an edge: inner nodes of the distorted cube


def cube(distorted: bool = False, edge: int = EDGE) -> MeshData:
    """Return the mesh, of one part ``board``."""
    line = np.linspace(0.0, LENGTH, edge + 1)
    points, cells = grid(line, line, line)
    if distorted:
        inner = np.all((points > 1e-9) & (points < LENGTH - 1e-9), axis=1)
        moves = np.random.default_rng(0).uniform(-1.0, 1.0, (int(inner.sum()), 3))
        points[inner] += SHAKE * LENGTH / edge * moves
    return mesh_of(points, cells, "board", {})


def elements_of(mesh: MeshData) -> Elements:
    """Return the elements of a mesh of steel."""
    density = np.full(len(mesh.cells), STEEL.density)
    return Elements(mesh.points, mesh.cells, mesh.part, elasticity_matrix(STEEL)[None], density)


def random_displacement(mesh: MeshData) -> np.ndarray:
    """Return displacements ``(n, 3)`` [m] that strain the elements by about 1e-4."""
    return np.random.default_rng(1).uniform(-1.0, 1.0, mesh.points.shape) * 1e-7
