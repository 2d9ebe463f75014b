"""Each element type: rigid-body modes, average strain, volume and its specific properties."""

import numpy as np
import pytest

from reflowshock.fem.elements.element import Elements, critical_steps, element_geometry, element_kind, element_stiffness
from reflowshock.fem.elements.hexahedron import HEXAHEDRON
from reflowshock.fem.elements.one_point import ONE_POINT, OnePoint, hourglass_control
from reflowshock.fem.elements.tetrahedron import EDGES, TETRAHEDRON, TETRAHEDRON_QUADRATIC
from reflowshock.fem.errors import MeshError
from reflowshock.fem.kernels.hexahedron import SIDES
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import FR4, SAC405

RANDOM = np.random.default_rng(11)
KINDS = [HEXAHEDRON, ONE_POINT, TETRAHEDRON, TETRAHEDRON_QUADRATIC]
ELASTICITY = np.array([elasticity_matrix(FR4), elasticity_matrix(SAC405)])
MATERIAL = np.array([0, 1], np.int32)
VERTICES = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def corners_of(kind, distortion=0.15) -> np.ndarray:
    """Return two distorted elements, shape (2, k, 3); the edges of tetrahedra are straight."""
    if kind.nodes == 8:
        return 0.5 * SIDES + RANDOM.uniform(-distortion, distortion, (2, 8, 3))
    vertices = VERTICES + RANDOM.uniform(-distortion, distortion, (2, 4, 3))
    middle = vertices[:, EDGES].mean(axis=2)
    return np.concatenate([vertices, middle], axis=1)[:, : kind.nodes]


def elements_of(kind, corners) -> Elements:
    """Return two separate elements of a kind, from corners, shape (2, nodes, 3) [m]."""
    cells = np.arange(2 * kind.nodes, dtype=np.int32).reshape(2, -1)
    return Elements(corners.reshape(-1, 3), cells, MATERIAL, ELASTICITY, np.full(2, 2.0), kind)


def rigid_fields(corners: np.ndarray) -> np.ndarray:
    """Return translations and rotations of one element, shape (6, 3k)."""
    moves = [np.broadcast_to(axis, corners.shape) for axis in np.eye(3)]
    return np.array([*moves, *(np.cross(axis, corners) for axis in np.eye(3))]).reshape(6, -1)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_exactly_six_modes_have_no_energy(kind):
    corners = corners_of(kind)
    for stiffness, vertices in zip(kind.stiffness(corners, ELASTICITY, MATERIAL), corners, strict=True):
        values = np.linalg.eigvalsh(stiffness)
        assert np.abs(values[:6]).max() < 1e-13 * values[-1]
        assert values[6] > 1e-4 * values[-1]
        assert np.abs(rigid_fields(vertices) @ stiffness).max() < 1e-13 * values[-1]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_mean_gradient_gives_the_average_strain(kind):
    corners, linear = corners_of(kind), RANDOM.uniform(-1, 1, (3, 3))
    gradients = np.einsum("eai,ead->eid", corners @ linear.T, kind.geometry(corners).gradient)
    assert np.allclose(gradients, linear, atol=1e-13)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_shares_of_the_volume_are_positive_and_complete(kind):
    geometry = kind.geometry(corners_of(kind, distortion=0.0))
    assert (geometry.nodal_volume > 0.0).all()
    assert geometry.volume == pytest.approx(1.0 if kind.nodes == 8 else 1.0 / 6.0, rel=1e-14)


def test_one_point_hexahedron_is_the_incompatible_modes_element_of_linear_problems():
    corners = corners_of(ONE_POINT, 0.2)
    ours, theirs = (kind.stiffness(corners, ELASTICITY, MATERIAL) for kind in (ONE_POINT, HEXAHEDRON))
    assert np.abs(ours - theirs).max() < 1e-14 * np.abs(theirs).max()


def test_hourglass_modes_are_orthogonal_to_affine_fields_and_softened_by_the_coefficient():
    corners = corners_of(ONE_POINT, 0.2)
    gamma, resistance = hourglass_control(corners, ELASTICITY, MATERIAL)
    affine = np.concatenate([np.ones((2, 8, 1)), corners], axis=2)
    assert np.abs(gamma.transpose(0, 2, 1) @ affine).max() < 1e-14
    values = np.linalg.eigvalsh(resistance)
    assert (values[:, 0] > 1e-3 * values[:, -1]).all()
    soft = np.linalg.eigvalsh(OnePoint(1e-6).stiffness(corners, ELASTICITY, MATERIAL))
    assert (np.sum(soft < 1e-4 * soft[:, -1:], axis=1) == 6 + 12).all()


def test_quadratic_tetrahedron_equals_an_independent_integration():
    corners = corners_of(TETRAHEDRON_QUADRATIC)
    twin = np.array([stiffness_twin(x, ELASTICITY[k]) for x, k in zip(corners, MATERIAL, strict=True)])
    ours = TETRAHEDRON_QUADRATIC.stiffness(corners, ELASTICITY, MATERIAL)
    assert np.abs(ours - twin).max() < 1e-9 * np.abs(twin).max()


def stiffness_twin(corners: np.ndarray, elasticity: np.ndarray) -> np.ndarray:
    """Return the stiffness from central differences of the shape functions at the four degree-2 points."""
    vertices = corners[:4]
    to_barycentric = np.linalg.inv(np.vstack([vertices.T, np.ones(4)]))

    def functions(x: np.ndarray) -> np.ndarray:
        part = to_barycentric @ np.append(x, 1.0)
        return np.concatenate([part * (2 * part - 1), 4 * part[EDGES].prod(axis=1)])

    volume = np.linalg.det(vertices[1:] - vertices[0]) / 6.0
    inner, outer = 0.1381966011250105, 0.5854101966249685
    result = np.zeros((30, 30))
    for weights in inner + (outer - inner) * np.eye(4):
        x, step = weights @ vertices, 1e-2
        gradient = np.array([(functions(x + step * e) - functions(x - step * e)) / (2 * step) for e in np.eye(3)])
        strain = np.zeros((6, 10, 3))
        for row, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]):
            strain[row, :, i] = gradient[j]
            strain[row, :, j] = gradient[i]
        strain = strain.reshape(6, 30)
        result += 0.25 * volume * strain.T @ elasticity @ strain
    return result


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_critical_step_is_the_element_eigenvalue(kind):
    corners = corners_of(kind)
    elements = elements_of(kind, corners)
    nodal_volume = element_geometry(elements.points, elements.cells).nodal_volume
    exact = []
    for stiffness, volume in zip(element_stiffness(elements), nodal_volume, strict=True):
        exact.append(2.0 / np.sqrt(np.linalg.eigvals(stiffness / np.repeat(2.0 * volume, 3)[:, None]).real.max()))
    assert critical_steps(elements, nodal_volume) == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize("kind", [TETRAHEDRON, TETRAHEDRON_QUADRATIC], ids=lambda kind: kind.name)
@pytest.mark.parametrize("height", [0.0, -1.0])
def test_flat_and_inverted_tetrahedra_are_errors(kind, height):
    corners = corners_of(kind, 0.0) * [1.0, 1.0, height]
    elements = elements_of(kind, corners)
    with pytest.raises(MeshError, match="2 of 2 elements have a zero or negative Jacobian"):
        element_geometry(elements.points, elements.cells)


def test_kind_follows_from_nodes_and_formulation():
    assert [element_kind(nodes) for nodes in (8, 4, 10)] == [HEXAHEDRON, TETRAHEDRON, TETRAHEDRON_QUADRATIC]
    assert element_kind(8, "one_point") is ONE_POINT
