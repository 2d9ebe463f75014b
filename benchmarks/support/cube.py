"""Cube of 40 x 40 x 40 hexahedra of the force benchmarks, as boxes or distorted."""

import numpy as np

from reflowshock.cases.hard.trials.boxes import KINDS, with_middles
from reflowshock.cases.hard.trials.boxes import elements_of as material_elements
from reflowshock.cases.hard.trials.grids import grid, mesh_of
from reflowshock.fem.elements.box_step import diagonal_tetrahedra
from reflowshock.fem.elements.element import Elements
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.materials.parameters import Isotropic, JohnsonCook, Material

EDGE = 40
LENGTH = 0.04  # [m]
STEEL = Isotropic(density=7850.0, young_modulus=210e9, poisson_ratio=0.3)
SOLDER = Isotropic(
    density=7400.0,
    young_modulus=50e9,
    poisson_ratio=0.36,
    plasticity=JohnsonCook(A=38e6, B=275e6, n=0.71, C=0.0713, reference_rate=1e-3),
)
SHAKE = 0.2  # largest move of inner nodes of the distorted cube, over the edge


def cube(distorted: bool = False, edge: int = EDGE) -> MeshData:
    """Return the mesh of a cube of hexahedra, all of the part ``board``.

    Args:
        distorted: Whether inner nodes are moved at random, so that no element is a box.
        edge: Number of elements along an edge.
    """
    line = np.linspace(0.0, LENGTH, edge + 1)
    points, cells = grid(line, line, line)
    if distorted:
        inner = np.all((points > 1e-9) & (points < LENGTH - 1e-9), axis=1)
        moves = np.random.default_rng(0).uniform(-1.0, 1.0, (int(inner.sum()), 3))
        points[inner] += SHAKE * LENGTH / edge * moves
    return mesh_of(points, cells, "board", {})


def elements_of(mesh: MeshData, kind: str = "incompatible_modes", material: Material = STEEL) -> Elements:
    """Return the elements of a mesh of hexahedra, with one material.

    Args:
        mesh: Mesh of hexahedra.
        kind: Kind of element; for tetrahedral kinds each hexahedron is cut into six tetrahedra.
        material: Material of all elements.
    """
    points, cells = mesh.points, mesh.cells
    if KINDS[kind].nodes != 8:
        cells = cells[:, diagonal_tetrahedra()[1]].reshape(-1, 4)
    if KINDS[kind].nodes == 10:
        points, cells = with_middles(points, cells)
    return material_elements(KINDS[kind], points, cells, [material])


def random_displacement(points: np.ndarray, strain: float = 1e-4) -> np.ndarray:
    """Return displacements that differ at random between neighbours, by about a strain times an edge, shape (n, 3) [m].

    Args:
        points: Nodes of the cube, shape (n, 3) [m].
        strain: Size of the strain.
    """
    return np.random.default_rng(1).uniform(-0.5, 0.5, points.shape) * strain * LENGTH / EDGE
