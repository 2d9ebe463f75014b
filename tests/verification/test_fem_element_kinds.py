"""Each element type: patch tests, order in h, Irons' bound, pressures of nearly incompressible bodies."""

import numpy as np
import pytest
import scipy.sparse
from scipy.sparse.linalg import eigsh

from reflowshock.cases.hard.trials.beams import orders_in_h
from reflowshock.cases.hard.trials.boxes import KINDS, box, elements_of, mass_of, solve, stiffness_matrix
from reflowshock.cases.hard.trials.grids import CYCLIC
from reflowshock.fem.elements.element import Elements, critical_steps, element_geometry
from reflowshock.fem.elements.stress import element_stress, mean_strain
from reflowshock.fem.forces.force import linear_terms
from reflowshock.fem.mesh.facet import area_vectors
from reflowshock.fem.mesh.mesh import boundary_facets
from reflowshock.fem.mesh.mesh_file import scaled_jacobians
from reflowshock.materials.library import FR4, SAC405
from reflowshock.materials.parameters import Isotropic

RANDOM = np.random.default_rng(3)
LINE = np.linspace(0, 1, 4)
every_kind = pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)


def inside(points: np.ndarray) -> np.ndarray:
    """Return whether points are inside the unit cube, shape (n,)."""
    return np.all((points > 1e-9) & (points < 1 - 1e-9), axis=1)


def shaken(points: np.ndarray) -> np.ndarray:
    """Return points of the unit cube with inner ones moved at random, shape (n, 3)."""
    return points + inside(points)[:, None] * RANDOM.uniform(-0.08, 0.08, points.shape)


def skewed(points: np.ndarray) -> np.ndarray:
    """Return points sheared along x in proportion to y, shape (n, 3)."""
    return points + 4.9 * points[:, 1:2] * [1.0, 0.0, 0.0]


def internal_force(elements: Elements, displacement: np.ndarray) -> np.ndarray:
    """Return the internal force of elements at a displacement, shape (n, 3) [N]."""
    force = np.zeros_like(displacement)
    for term in linear_terms(elements):
        term.add(displacement, force)
    return force


def check_patch(elements: Elements, inner: np.ndarray) -> None:
    """Check that an affine field gives zero force at inner nodes and its exact stress everywhere."""
    gradient = RANDOM.uniform(-1, 1, (3, 3))
    displacement = elements.points @ gradient.T
    force = internal_force(elements, displacement)
    assert np.abs(force[inner]).max() < 1e-12 * np.abs(force).max()
    strain = np.array([*np.diag(gradient), *(gradient + gradient.T)[[0, 1, 0], [1, 2, 2]]])
    exact = elements.elasticity[0] @ strain
    mean = element_geometry(elements.points, elements.cells).gradient
    stress = element_stress(
        mean, np.repeat(elements.elasticity, len(elements.cells), axis=0), displacement[elements.cells]
    )
    assert np.abs(stress - exact).max() < 1e-12 * np.abs(exact).max()


@every_kind
@pytest.mark.parametrize("material", [FR4, SAC405], ids=["orthotropic", "isotropic"])
def test_patch_of_distorted_elements_carries_constant_stress(kind, material):
    points, cells = box(kind, LINE, LINE, LINE, move=shaken)
    check_patch(elements_of(kind, points, cells, [material]), inside(points))


def test_patch_of_curved_tetrahedra_carries_constant_stress():
    kind = KINDS["tetrahedron_quadratic"]
    points, cells = box(kind, LINE, LINE, LINE)
    middles = np.arange(len(points)) >= len(LINE) ** 3
    points = points + (inside(points) & middles)[:, None] * RANDOM.uniform(-0.03, 0.03, points.shape)
    check_patch(elements_of(kind, points, cells, [FR4]), inside(points))


@pytest.mark.parametrize("name", ["incompatible_modes", "one_point"])
def test_patch_of_hexahedra_with_scaled_jacobian_of_a_fifth(name):
    points, cells = box(KINDS[name], LINE, LINE, LINE)
    inner, points = inside(points), skewed(points)
    assert scaled_jacobians(points[cells]).max() == pytest.approx(0.2, rel=1e-3)
    elements = elements_of(KINDS[name], points, cells, [FR4])
    check_patch(elements, inner)
    values = np.linalg.eigvalsh(KINDS[name].stiffness(points[cells[:1]], elements.elasticity, elements.material[:1])[0])
    assert np.sum(values < 1e-10 * values[-1]) == 6


ORDERS = [("incompatible_modes", 2, 2), ("one_point", 2, 2), ("tetrahedron", 2, 1), ("tetrahedron_quadratic", 3, 2)]


@pytest.mark.parametrize("name, of_displacement, of_strain", ORDERS, ids=KINDS)
def test_order_in_h_on_distorted_meshes(name, of_displacement, of_strain):
    orders = orders_in_h(name)
    assert orders[0] > of_displacement - 0.25
    assert orders[1] > of_strain - 0.15


@every_kind
def test_no_assembled_model_has_a_smaller_critical_step_than_its_elements(kind):
    """The element bound (Irons and Treharne) is safe and close to the step of the assembled model."""
    points, cells = box(kind, LINE, LINE, LINE, move=shaken)
    elements = elements_of(kind, points, cells, [FR4, SAC405], np.arange(len(cells)) % 2)
    root = scipy.sparse.diags(1.0 / np.sqrt(np.repeat(mass_of(elements), 3)))
    squared = eigsh(root @ stiffness_matrix(elements) @ root, 1, which="LA", return_eigenvectors=False)[0]
    assembled = 2.0 / np.sqrt(squared)
    bound = critical_steps(elements, element_geometry(points, cells).nodal_volume).min()
    assert bound < assembled < 2.0 * bound


def pressures(kind, count: int, poisson: float) -> np.ndarray:
    """Return the element pressures of a confined cube under a smooth top pressure, shape (count, count, count)."""
    points, cells = box(kind, *[np.linspace(0, 1, count + 1)] * 3)
    elements = elements_of(kind, points, cells, [Isotropic(density=1.0, young_modulus=1.0, poisson_ratio=poisson)])
    held = np.abs(points) < 1e-9
    held[:, :2] |= points[:, :2] > 1 - 1e-9
    quads = boundary_facets(cells)[:, CYCLIC]
    top = quads[np.all(points[quads][:, :, 2] > 1 - 1e-9, axis=1)]
    centres = points[top].mean(axis=1)
    peak = 1e-3 * np.prod(0.5 + 0.5 * np.cos(np.pi * centres[:, :2]), axis=1)
    load = np.zeros_like(points)
    np.add.at(load, top, -peak[:, None, None] * np.abs(area_vectors(points[top])))
    displacement = solve(elements, np.zeros_like(points), held, load)
    strain = mean_strain(element_geometry(points, cells).gradient, displacement[cells])
    return -(strain @ elements.elasticity[0])[:, :3].mean(axis=1).reshape([count] * 3)


def alternation(values: np.ndarray) -> float:
    """Return the largest second difference of neighbours over the range: 1 for a checkerboard, otherwise O(h^2)."""
    return max(np.abs(np.diff(values, 2, axis=axis)).max() for axis in range(3)) / (4 * np.ptp(values))


@pytest.mark.parametrize("name", ["incompatible_modes", "one_point"])
def test_pressure_of_nearly_incompressible_bodies_has_no_checkerboard(name):
    coarse, fine, soft = (
        alternation(pressures(KINDS[name], count, nu)) for count, nu in [(6, 0.499), (12, 0.499), (12, 0.3)]
    )
    assert fine < 0.4 * coarse
    assert fine < 1.1 * soft < 0.02
