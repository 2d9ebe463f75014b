import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reflowshock.meshing.core.hexahedra import quad_areas, scaled_jacobian, shortest_lengths, volumes

BOX = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 2], [1, 0, 2], [1, 1, 2], [0, 1, 2]], float)
CELL = np.arange(8)[None]


def test_sheared_box():
    sheared = BOX.copy()
    sheared[:, 0] += 0.5 * sheared[:, 2]
    assert volumes(sheared, CELL)[0] == pytest.approx(2.0)
    assert scaled_jacobian(sheared, CELL)[0] == pytest.approx(2.0 / np.sqrt(5.0))
    assert shortest_lengths(sheared, CELL)[0] == pytest.approx(2.0 / np.sqrt(5.0))
    assert quad_areas(sheared, np.array([[0, 1, 5, 4]]))[0] == pytest.approx(2.0)


def test_inside_out_is_not_positive():
    assert scaled_jacobian(BOX, CELL[:, [4, 5, 6, 7, 0, 1, 2, 3]])[0] == pytest.approx(-1.0)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9), st.floats(0.0, 0.2))
def test_volume_is_that_of_the_enclosed_polyhedron(affine, twist):
    """A linear map scales volumes by its determinant; a frustum with a turned lid keeps flat ends."""
    matrix = np.eye(3) + 0.3 * np.reshape(affine, (3, 3))
    assert volumes(BOX @ matrix.T, CELL)[0] == pytest.approx(2.0 * np.linalg.det(matrix), abs=1e-12)
    # The section at height s is a square of sides that go linearly from 1 to lid: its area integrates exactly.
    lid = np.array([[1.0 - twist, -twist], [twist, 1.0 - twist]])
    turned = BOX.copy()
    turned[4:, :2] = turned[4:, :2] @ lid.T
    shares = np.linspace(0.0, 1.0, 3)
    areas = [np.linalg.det((1 - s) * np.eye(2) + s * lid) for s in shares]
    assert volumes(turned, CELL)[0] == pytest.approx(2.0 * np.dot([1, 4, 1], areas) / 6.0, rel=1e-12)
