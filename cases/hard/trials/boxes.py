"""Elements of every kind on distorted structured boxes, and linear problems on them; SciPy only."""

from collections.abc import Callable, Sequence

import numpy as np
import scipy.sparse
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh, splu

from reflowshock.cases.hard.trials.elements import Elastic
from reflowshock.cases.hard.trials.grids import Line, grid
from reflowshock.fem.elements.box_step import diagonal_tetrahedra
from reflowshock.fem.elements.element import Elements, element_geometry, element_kind, element_stiffness, lumped_mass
from reflowshock.fem.elements.kind import ElementKind
from reflowshock.fem.elements.tetrahedron import EDGES
from reflowshock.fem.mesh.mesh_file import scaled_jacobians
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.parameters import Isotropic, Material, Orthotropic

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
    """Return points and cells of a box between grid lines; vertices are moved before mid-edge nodes are added."""
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
    """Return elements with materials indexed by ``number``, shape (ne,)."""
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


def solve(elements: Elements, prescribed: np.ndarray, held: np.ndarray, load: np.ndarray | None = None) -> np.ndarray:
    """Return the displacement (n, 3) with components ``held`` (n, 3) equal to ``prescribed`` (n, 3)."""
    stiffness, free = stiffness_matrix(elements), ~held.ravel()
    displacement = np.where(held, prescribed, 0.0).ravel()
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


YOUNG, DENSITY = 10e9, 2000.0  # Young's modulus and density of the bodies [Pa], [kg/m^3]
LARGEST = 1.0  # largest node movement over the edge of a box: inverts any element


def distorted(
    name: str, lines: tuple[Line, Line, Line], quality: float, seed: int, faces: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 3) and cells of a box between grid lines with a given least scaled Jacobian.

    Args:
        name: Kind of element.
        lines: Grid lines along x, y and z.
        quality: Target of the least scaled Jacobian; a grid below it stays unchanged.
        seed: Seed of the random directions.
        faces: Whether nodes on the faces of the box move as well.
    """
    edges = np.array([np.diff(line).min() for line in lines])
    points, _ = grid(*lines)
    noise = np.random.default_rng(seed).uniform(-1.0, 1.0, points.shape) * edges
    if not faces:
        low, high = points.min(axis=0), points.max(axis=0)
        noise[((points == low) | (points == high)).any(axis=1)] = 0.0

    def made(amount: float) -> tuple[np.ndarray, np.ndarray]:
        return box(KINDS[name], *lines, move=lambda points: points + amount * noise)

    def excess(amount: float) -> float:
        points, cells = made(amount)
        return float(scaled_jacobians(points[cells]).min()) - quality

    if excess(0.0) <= 0.0:
        return made(0.0)
    return made(brentq(excess, 0.0, LARGEST, xtol=1e-6))


def laminate(poisson: float, orthotropy: float = 1.0, young: float = YOUNG) -> Material:
    """Return a material with in-plane modulus ``young`` [Pa] and a z modulus smaller by ``orthotropy``."""
    if orthotropy == 1.0:
        return Isotropic(density=DENSITY, young_modulus=young, poisson_ratio=poisson)
    across, shear = young / orthotropy, 0.5 / (1.0 + poisson)
    return Orthotropic(
        density=DENSITY,
        young_modulus_in_plane=young,
        young_modulus_out_of_plane=across,
        poisson_ratio_in_plane=poisson,
        poisson_ratio_out_of_plane=poisson * min(1.0, orthotropy**0.5),
        shear_modulus_in_plane=young * shear,
        shear_modulus_out_of_plane=(young * across) ** 0.5 * shear,
    )


def body_of(parameters: Elastic, material: Material) -> Elements:
    """Return the elements of a trial, boxes 1 mm high."""
    flat = np.linspace(0.0, 1e-3 * parameters.aspect * parameters.cells, parameters.cells + 1)
    lines = (flat, flat, np.linspace(0.0, 1e-3 * parameters.cells, parameters.cells + 1))
    points, cells = distorted(parameters.element, lines, parameters.quality, parameters.seed)
    return elements_of(KINDS[parameters.element], points, cells, [material])
