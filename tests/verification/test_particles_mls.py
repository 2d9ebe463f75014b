"""Convergence of the derivatives on irregular particles: quadratic basis against the linear basis of Hu et al."""

import numpy as np
import pytest

from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.gripc.moving_least_squares import SUPPORT, fit_derivatives

COUNTS = (8, 12, 18)


def relative_errors(basis, count, seed=13):
    """Return errors of gradient and Laplacian of sin(2x) cos(y) exp(z) in the inner half of a jittered unit cube."""
    axis, spacing = np.linspace(0.0, 1.0, count), 1.0 / (count - 1)
    points = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    points += np.random.default_rng(seed).uniform(-0.1, 0.1, points.shape) * spacing
    inner = np.flatnonzero((np.abs(points - 0.5) < 0.25).all(axis=1)).astype(np.int32)
    neighbours = NeighbourList(SUPPORT[basis] * spacing, 0.0)
    neighbours.update(points)
    values = fit_derivatives(points, inner, neighbours, basis)
    x, y, z = points.T
    field = np.sin(2 * x) * np.cos(y) * np.exp(z)
    slope = (2 * np.cos(2 * x) * np.cos(y) * np.exp(z))[inner]
    laplacian = -4.0 * field[inner]
    return (
        np.linalg.norm(values.gradient[0] @ field - slope) / np.linalg.norm(slope),
        np.linalg.norm(values.laplacian @ field - laplacian) / np.linalg.norm(laplacian),
    )


def orders(basis):
    """Return the orders of gradient and Laplacian in the spacing, and their errors."""
    errors = np.array([relative_errors(basis, count) for count in COUNTS])
    return np.polyfit(np.log(1.0 / (np.array(COUNTS) - 1)), np.log(errors), 1)[0], errors


def test_quadratic_basis_converges():
    (gradient, laplacian), errors = orders("quadratic")
    assert gradient > 1.8
    assert laplacian > 0.9
    assert errors[-1, 1] < 0.01


def test_laplacian_of_the_linear_basis_does_not_converge():
    """The error of the published Laplacian is independent of resolution; the gradient converges."""
    (gradient, laplacian), errors = orders("linear")
    assert gradient > 0.9
    assert abs(laplacian) < 0.3
    assert errors[:, 1].min() > 0.02


@pytest.mark.parametrize("basis", ["linear", "quadratic"])
def test_derivatives_of_a_constant_vanish(basis):
    points = np.random.default_rng(14).uniform(size=(400, 3))
    neighbours = NeighbourList(0.45, 0.0)
    neighbours.update(points)
    values = fit_derivatives(points, np.arange(400, dtype=np.int32), neighbours, basis)
    for matrix in (*values.gradient, values.laplacian):
        assert np.abs(matrix @ np.ones(400)).max() < 1e-6 * abs(matrix).max()
