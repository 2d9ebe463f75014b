"""The hexahedron against a NumPy twin and general element requirements."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.grids import grid
from reflowshock.fem.elements.element import Elements, critical_steps, element_geometry, element_stiffness, lumped_mass
from reflowshock.fem.errors import MeshError
from reflowshock.fem.estimates.estimate import box_critical_step, skewed_critical_step
from reflowshock.fem.forces.force_assembled import AssembledElements
from reflowshock.fem.forces.force_congruent import CongruentElements, is_box, parity_blocks
from reflowshock.fem.kernels.hexahedron import GAUSS, SIDES, shape_derivatives
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import COPPER, FR4, SAC405, SILICON

RANDOM = np.random.default_rng(7)


def one_element(distortion: float, size=(1.0, 1.0, 1.0)) -> np.ndarray:
    """Return the corners of a box distorted at random, shape (8, 3) [m]."""
    return 0.5 * SIDES * size + distortion * RANDOM.uniform(-1, 1, (8, 3)) * size


def elements_of(points, cells, material=FR4) -> Elements:
    """Return hexahedra with incompatible modes of one material."""
    return Elements(
        np.ascontiguousarray(points),
        np.asarray(cells, np.int32),
        np.zeros(len(cells), np.int32),
        elasticity_matrix(material)[None],
        np.full(len(cells), material.density),
    )


def strain_matrix(gradient: np.ndarray) -> np.ndarray:
    """Return the strain matrix of shape function gradients (k, 3), shape (6, 3 k)."""
    columns = []
    for x, y, z in gradient:
        columns.append([[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]])
    return np.concatenate(columns, axis=1)


def stiffness_twin(corners: np.ndarray, elasticity: np.ndarray) -> np.ndarray:
    """Return the stiffness of the Taylor-modified Wilson element with linear dilatation."""
    jacobians = np.array([corners.T @ derivatives for derivatives in shape_derivatives(GAUSS)])
    weights = np.linalg.det(jacobians)
    gradients = shape_derivatives(GAUSS) @ np.linalg.inv(jacobians)
    basis = np.column_stack([np.ones(8), GAUSS])
    root = np.sqrt(weights)[:, None]
    linear = basis @ np.linalg.lstsq(basis * root, gradients.reshape(8, 24) * root, rcond=None)[0]
    centre = corners.T @ shape_derivatives(np.zeros((1, 3)))[0]
    full = np.zeros((33, 33))
    for g, xi in enumerate(GAUSS):
        modes = -2.0 * np.diag(xi) @ np.linalg.inv(centre) * np.linalg.det(centre) / weights[g]
        strain = strain_matrix(np.concatenate([gradients[g], modes]))
        strain[:3, :24] += (linear[g] - strain[:3, :24].sum(axis=0)) / 3.0
        full += weights[g] * strain.T @ elasticity @ strain
    return full[:24, :24] - full[:24, 24:] @ np.linalg.solve(full[24:, 24:], full[24:, :24])


@pytest.mark.parametrize("material", [FR4, SAC405])
def test_stiffness_equals_its_twin(material):
    corners = one_element(0.15)
    ours = element_stiffness(elements_of(corners, [np.arange(8)], material))[0]
    twin = stiffness_twin(corners, elasticity_matrix(material))
    assert np.abs(ours - twin).max() < 1e-12 * np.abs(twin).max()


def test_distorted_element_has_six_rigid_modes_and_no_other():
    values = np.linalg.eigvalsh(element_stiffness(elements_of(one_element(0.2), [np.arange(8)]))[0])
    assert np.abs(values[:6]).max() < 1e-12 * values[-1]
    assert values[6] > 1e-3 * values[-1]


def test_boxes_and_assembled_elements_give_the_same_force():
    points, cells = grid([0, 1e-3, 3e-3], [0, 0.5e-3, 1e-3], [0, 0.25e-3, 0.4e-3])
    elements = elements_of(points, cells)
    displacement = RANDOM.uniform(-1, 1, points.shape)
    forces = [np.zeros_like(points), np.zeros_like(points)]
    CongruentElements.build(elements).add(displacement, forces[0])
    AssembledElements.build(elements).add(displacement, forces[1])
    twin = np.zeros(3 * len(points))
    dofs = (3 * cells[:, :, None] + np.arange(3)).reshape(len(cells), 24)
    for k, stiffness in zip(dofs, element_stiffness(elements), strict=True):
        twin[k] -= stiffness @ displacement.ravel()[k]
    for force in forces:
        assert np.abs(force.ravel() - twin).max() < 1e-13 * np.abs(twin).max()


def test_boxes_are_found_however_they_are_numbered():
    turned = 0.5 * SIDES[:, [1, 2, 0]] * [1.0, 2.0, 3.0]
    sheared = 0.5 * SIDES + 0.01 * SIDES[:, [2, 2, 2]] * [1.0, 0.0, 0.0]
    corners = np.array([0.5 * SIDES * [1.0, 2.0, 3.0], turned, sheared])
    assert is_box(corners).tolist() == [True, True, False]


def test_turned_box_gives_the_same_force():
    points = 0.5 * SIDES * [1.0, 2.0, 3.0]
    order = np.argsort((SIDES[:, [1, 2, 0]] > 0) @ [1, 2, 4])
    displacement = RANDOM.uniform(-1, 1, (8, 3))
    forces = []
    for cells in (np.arange(8), order):
        force = np.zeros((8, 3))
        CongruentElements.build(elements_of(points, [cells])).add(displacement, force)
        forces.append(force)
    assert np.allclose(*forces, rtol=1e-13, atol=0)


def test_stiffness_without_mirror_symmetry_is_refused():
    with pytest.raises(ValueError, match="mirror symmetry"):
        parity_blocks(element_stiffness(elements_of(one_element(0.2), [np.arange(8)])))


@pytest.mark.parametrize("material", [FR4, SILICON, COPPER, SAC405])
@pytest.mark.parametrize("size", [(1.0, 1.0, 1.0), (2.5, 2.5, 0.25), (0.1, 0.3, 0.02)])
def test_estimated_box_step_is_the_element_step(material, size):
    elements = elements_of(one_element(0.0, size), [np.arange(8)], material)
    exact = critical_steps(elements, element_geometry(elements.points, elements.cells).nodal_volume)[0]
    assert box_critical_step(material, np.array(size)) == pytest.approx(exact, rel=1e-9)


def test_critical_step_of_a_hexahedron_at_any_angles_is_that_of_its_edges():
    edges = np.array([[1.0, 0.3, 0.0], [-0.2, 0.7, 0.0], [0.0, 0.0, 0.25]]) * 1e-3
    elements = elements_of(0.5 * SIDES @ edges, [np.arange(8)])
    exact = critical_steps(elements, element_geometry(elements.points, elements.cells).nodal_volume)[0]
    assert skewed_critical_step(FR4, edges[None])[0] == pytest.approx(exact, rel=1e-9)
    box = np.diag([1e-3, 2e-3, 0.25e-3])
    assert skewed_critical_step(FR4, box[None])[0] == pytest.approx(box_critical_step(FR4, np.diag(box)), rel=1e-12)


def test_lumped_mass_is_density_times_volume_on_distorted_elements():
    points, cells = grid([0, 1, 2], [0, 1, 2], [0, 1, 2])
    inner = np.all((points > 0) & (points < 2), axis=1)
    points[inner] += 0.2
    elements = elements_of(points, cells)
    geometry = element_geometry(points, elements.cells)
    assert geometry.volume.sum() == pytest.approx(8.0, rel=1e-14)
    assert lumped_mass(elements, geometry.nodal_volume).sum() == pytest.approx(8.0 * FR4.density, rel=1e-14)


def test_mean_gradient_gives_the_average_strain():
    corners = one_element(0.2)
    elements = elements_of(corners, [np.arange(8)])
    gradient = element_geometry(corners, elements.cells).gradient[0]
    linear = RANDOM.uniform(-1, 1, (3, 3))
    assert np.allclose((corners @ linear.T).T @ gradient, linear, atol=1e-13)


def test_inverted_element_is_an_error_with_its_place():
    corners = one_element(0.0)
    corners[[0, 1]] = corners[[1, 0]]
    with pytest.raises(MeshError, match="negative Jacobian"):
        element_geometry(corners, np.arange(8, dtype=np.int32)[None])
