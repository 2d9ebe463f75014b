"""Every kind of element on structured boxes, and the linear problems they are judged by; SciPy only."""

from collections.abc import Callable, Sequence

import numpy as np
import scipy.sparse
from scipy.sparse.linalg import eigsh, splu

from reflowshock.fem.elements.box_step import diagonal_tetrahedra
from reflowshock.fem.elements.element import Elements, element_geometry, element_kind, element_stiffness, lumped_mass
from reflowshock.fem.elements.kind import ElementKind
from reflowshock.fem.elements.tetrahedron import EDGES
from reflowshock.fem.materials.elasticity import elasticity_matrix
from reflowshock.fem.materials.parameters import Material
from reflowshock.fem.trials.grids import Line, grid

KINDS = {
    "incompatible_modes": element_kind(8),
    "one_point": element_kind(8, "one_point"),
    "tetrahedron": element_kind(4),
    "tetrahedron_quadratic": element_kind(10),
}


def with_middles(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return points and 10-node tetrahedra with nodes at the middles of the edges."""
    edges, number = np.unique(np.sort(cells[:, EDGES].reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    middles = number.reshape(len(cells), 6) + len(points)
    return np.vstack([points, points[edges].mean(axis=1)]), np.hstack([cells, middles]).astype(np.int32)


def box(kind: ElementKind, *lines: Line, move: Callable = lambda x: x) -> tuple[np.ndarray, np.ndarray]:
    """Return points and cells of a box between the lines of a grid, vertices moved before middles are placed."""
    points, cells = grid(*lines)
    points = move(points)
    if kind.nodes == 8:
        return points, cells
    tetrahedra = cells[:, diagonal_tetrahedra()[1]].reshape(-1, 4)
    return (points, tetrahedra) if kind.nodes == 4 else with_middles(points, tetrahedra)


def elements_of(
    kind: ElementKind,
    points: np.ndarray,
    cells: np.ndarray,
    materials: Sequence[Material],
    number: np.ndarray | int = 0,
) -> Elements:
    """Return elements of materials, (ne,) ``number`` among them."""
    number = np.broadcast_to(np.asarray(number, np.int32), len(cells))
    density = np.array([material.density for material in materials])[number]
    elasticity = np.array([elasticity_matrix(material) for material in materials])
    return Elements(np.ascontiguousarray(points), cells, np.ascontiguousarray(number), elasticity, density, kind)


def stiffness_matrix(elements: Elements) -> scipy.sparse.csr_matrix:
    """Return the assembled stiffness, (3n, 3n)."""
    dofs = (3 * elements.cells[:, :, None] + np.arange(3)).reshape(len(elements.cells), -1)
    rows = np.repeat(dofs, dofs.shape[1], axis=1)
    columns = np.tile(dofs, (1, dofs.shape[1]))
    size = 3 * len(elements.points)
    values = element_stiffness(elements).ravel()
    return scipy.sparse.csr_matrix((values, (rows.ravel(), columns.ravel())), shape=(size, size))


def mass_of(elements: Elements) -> np.ndarray:
    """Return the lumped mass, (n,)."""
    return lumped_mass(elements, element_geometry(elements.points, elements.cells).nodal_volume)


def solve(elements: Elements, given: np.ndarray, held: np.ndarray, load: np.ndarray | None = None) -> np.ndarray:
    """Return the displacement (n, 3) where components ``held (n, 3)`` take the values ``given (n, 3)``."""
    stiffness, free = stiffness_matrix(elements), ~held.ravel()
    displacement = np.where(held, given, 0.0).ravel()
    right = (0.0 if load is None else load.ravel()) - stiffness @ displacement
    displacement[free] = splu(stiffness[free][:, free].tocsc()).solve(right[free])
    return displacement.reshape(-1, 3)


def frequencies(elements: Elements, held: np.ndarray, count: int) -> np.ndarray:
    """Return the lowest natural frequencies [Hz] with the lumped mass."""
    free = ~held.ravel()
    stiffness = stiffness_matrix(elements)[free][:, free]
    root = scipy.sparse.diags(1.0 / np.sqrt(np.repeat(mass_of(elements), 3)[free]))
    squared = eigsh((root @ stiffness @ root).tocsc(), count, sigma=0.0, return_eigenvectors=False)
    return np.sqrt(np.sort(squared)) / (2 * np.pi)
