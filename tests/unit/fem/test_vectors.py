"""Vectors of elements in kernels: polar decomposition, nodes of a block, and the order of elements in blocks."""

import numpy as np
import pytest
from numba import njit
from scipy.linalg import polar as exact_polar
from scipy.spatial.transform import Rotation

from reflowshock.cases.hard.trials.grids import grid
from reflowshock.fem.elements.element import Elements, element_kind
from reflowshock.fem.forces.lanes import arrange
from reflowshock.fem.kernels.vectors.memory import nine, place, put_six, put_three
from reflowshock.fem.kernels.vectors.modes import read_modes, subtract_modes
from reflowshock.fem.kernels.vectors.polar import polar
from reflowshock.fem.kernels.vectors.vector import WIDTH
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import COPPER


@njit
def write_polar(f, rotation, strain):
    r, e, upright = polar(nine(place(f), 0))
    put_three(place(rotation), 0, r[:3])
    put_six(place(rotation), 3 * WIDTH, r[3:])
    put_six(place(strain), 0, e)
    return upright


def by_lane(matrices: np.ndarray) -> np.ndarray:
    """Return matrices ``(WIDTH, 3, 3)`` entry by entry, lanes innermost."""
    return np.ascontiguousarray(matrices.reshape(WIDTH, 9).T)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-4, 0.004, 0.02, 0.3])
def test_polar_decomposition(size):
    """Small strains are found by a series, large ones by iteration; small ones have no error of cancellation."""
    random = np.random.default_rng(3)
    strain = random.uniform(-size, size, (WIDTH, 3, 3))
    strain = 0.5 * (strain + strain.transpose(0, 2, 1))
    turn = Rotation.from_rotvec(random.normal(size=(WIDTH, 3))).as_matrix()
    f, rotation, found = turn @ (np.eye(3) + strain), np.empty((9, WIDTH)), np.empty((6, WIDTH))
    assert write_polar(by_lane(f), rotation, found)
    exact = np.array([exact_polar(matrix)[0] for matrix in f])
    assert np.abs(rotation - by_lane(exact)).max() < 2e-15
    assert np.abs(found - by_lane(strain)[[0, 4, 8, 1, 5, 2]]).max() < 2e-15


@pytest.mark.parametrize("last", [-np.eye(3), np.diag([1.0, 1.0, -0.5]), np.full((3, 3), np.nan)])
def test_polar_decomposition_of_an_inverted_element(last):
    f = np.array([np.eye(3)] * (WIDTH - 1) + [last])
    assert not write_polar(by_lane(f), np.empty((9, WIDTH)), np.empty((6, WIDTH)))


@njit
def subtract_all(values, cells, count, result):
    subtract_modes(place(result), place(cells), 1, count, read_modes(place(values), place(cells), 1))


@pytest.mark.parametrize("count", range(1, WIDTH + 1))
def test_nodes_of_a_block(count):
    """Modes there and back are eight times the values; elements share nodes, those after the last one do not count."""
    random = np.random.default_rng(count)
    cells = random.integers(0, 12, (2, 8, WIDTH)).astype(np.int32)
    values, result, expected = random.normal(size=(12, 3)), np.ones((12, 3)), np.ones((12, 3))
    subtract_all(values, cells, count, result)
    np.subtract.at(expected, cells[1, :, :count], 8.0 * values[cells[1, :, :count]])
    assert np.abs(result - expected).max() < 1e-13


@pytest.mark.parametrize("width", [4, 16])
def test_order_of_elements(width):
    """Each element has one lane, blocks have one group, and blocks of one shape share its pattern."""
    points, cells = grid(*(np.cumsum([0.0, *np.linspace(1, 2, count)]) for count in (3, 5, 2)))
    points, cells = (
        np.concatenate([points + [9.0 * k, 0.0, 0.0] for k in range(7)]),
        np.concatenate([cells + k * len(points) for k in range(7)]),
    )
    count = len(cells)
    group = np.random.default_rng(1).integers(0, 2, count)
    elasticity = elasticity_matrix(COPPER)[None]
    material = np.zeros(count, np.int32)
    elements = Elements(points, cells, material, elasticity, np.ones(count), element_kind(8, "one_point"))
    lanes = arrange(elements, group, width)
    assert np.array_equal(np.sort(lanes.element[lanes.valid]), np.arange(count))
    assert (group[lanes.element] == group[lanes.element[:, :1]]).all()
    assert (lanes.filled < width).sum() <= 2
    size = np.ptp(points[cells], axis=1)
    shape = lanes.shape[lanes.pattern_shapes[lanes.pattern]]
    assert np.allclose(size[shape], size[lanes.element])
    assert len(lanes.pattern_shapes) < len(lanes.element)
