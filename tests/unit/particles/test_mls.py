import numpy as np
import pytest

from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.gripc.moving_least_squares import SUPPORT, fit_derivatives, fit_shape_functions
from reflowshock.particles.ispg.stencils import DegenerateStencil


@pytest.fixture
def cloud():
    """Return a lattice of points moved at random, shape (n, 3)."""
    axis = np.arange(7.0)
    points = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    return points + np.random.default_rng(4).uniform(-0.15, 0.15, points.shape)


def fit(points, rows, basis):
    """Return the derivative operators at some rows of points."""
    neighbours = NeighbourList(SUPPORT[basis], skin=0.3)
    neighbours.update(points)
    return fit_derivatives(points, np.asarray(rows, np.int32), neighbours, basis)


def weights(offsets, support):
    """Return the weights of offsets (k, 3) within a support radius, shape (k,)."""
    return np.maximum(1.0 - (offsets**2).sum(axis=1) / support**2, 0.0) ** 3


@pytest.mark.parametrize("row", [171, 0])
def test_quadratic_weights_equal_a_dense_least_squares_fit(cloud, row):
    """The twin applies NumPy's lstsq to the weighted Taylor expansion, inside and at a corner."""
    actual = fit(cloud, [row], "quadratic")
    d = np.delete(cloud, row, axis=0) - cloud[row]
    x, y, z = d.T
    taylor = np.column_stack((x, y, z, x * x / 2, y * y / 2, z * z / 2, x * y, x * z, y * z))
    root = np.sqrt(weights(d, SUPPORT["quadratic"]))[:, None]
    fitted = np.linalg.pinv(taylor * root) * root.T
    expected = np.vstack((fitted[:3], fitted[3:6].sum(axis=0)))
    operators = np.vstack([m.toarray() for m in (*actual.gradient, actual.laplacian)])
    assert actual.order[0] == 2
    assert np.delete(operators, row, axis=1) == pytest.approx(expected, abs=1e-9)
    assert operators.sum(axis=1) == pytest.approx(0.0, abs=1e-10)


def mls_value(cloud, values, at):
    """Return the linear MLS approximation at a point."""
    basis = np.column_stack((np.ones(len(cloud)), cloud - at))
    w = weights(cloud - at, SUPPORT["linear"])
    return np.linalg.solve(basis.T @ (w[:, None] * basis), basis.T @ (w * values))[0]


@pytest.mark.parametrize("row", [171, 0])
def test_shape_functions_equal_the_mls_approximation(cloud, row):
    values = np.random.default_rng(6).normal(size=len(cloud))
    neighbours = NeighbourList(SUPPORT["linear"], skin=0.3)
    neighbours.update(cloud)
    fitted = fit_shape_functions(cloud, np.array([row], np.int32), neighbours)
    assert fitted @ values == pytest.approx(mls_value(cloud, values, cloud[row]))
    assert fitted @ cloud == pytest.approx(cloud[[row]], abs=1e-12)


def test_linear_derivatives_equal_differences_of_the_mls_approximation(cloud):
    values = np.random.default_rng(5).normal(size=len(cloud))
    row, step = 171, 1e-3
    fitted = fit(cloud, [row], "linear")
    centre = mls_value(cloud, values, cloud[row])
    laplacian = 0.0
    for c in range(3):
        shift = step * np.eye(3)[c]
        right, left = (mls_value(cloud, values, cloud[row] + s) for s in (shift, -shift))
        assert (fitted.gradient[c] @ values)[0] == pytest.approx((right - left) / (2 * step), rel=1e-4)
        laplacian += (right - 2 * centre + left) / step**2
    assert (fitted.laplacian @ values)[0] == pytest.approx(laplacian, rel=1e-3)


def test_quadratic_basis_reproduces_quadratic_fields_everywhere(cloud):
    x, y, z = cloud.T
    fitted = fit(cloud, np.arange(len(cloud)), "quadratic")
    assert fitted.gradient[0] @ (x * x - y * z + 3 * x) == pytest.approx(2 * x + 3, abs=1e-8)
    assert fitted.laplacian @ (x * x + 2 * y * y - z * z + x * y) == pytest.approx(4.0, abs=1e-8)


def test_linear_basis_reproduces_linear_fields_everywhere(cloud):
    fitted = fit(cloud, np.arange(len(cloud)), "linear")
    assert fitted.gradient[1] @ (cloud @ [1.0, 2.0, 3.0]) == pytest.approx(2.0, abs=1e-9)


def test_too_few_neighbours_fall_back_to_the_linear_terms():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0.0]])
    fitted = fit(points, [0], "quadratic")
    assert fitted.order[0] == 1
    assert (fitted.gradient[2] @ points)[0] == pytest.approx([0.0, 0.0, 1.0])


def test_a_planar_neighbourhood_is_an_error():
    axis = np.arange(4.0)
    points = np.stack(np.meshgrid(axis, axis, [0.0]), axis=-1).reshape(-1, 3)
    with pytest.raises(DegenerateStencil, match="particle 5"):
        fit(points, [5], "quadratic")
