"""Nodal volumes with given moments; impossible moments raise an error."""

import numpy as np
import pytest

from reflowshock.particles.ispg.nodal_volumes import NoNodalVolumes, _solve, fit_volumes

RANDOM = np.random.default_rng(5)


def points(thickness: float) -> np.ndarray:
    """Return the monomials up to degree one of random points in a film, shape (n, 4)."""
    return np.column_stack((np.ones(40), RANDOM.uniform(-1.0, 1.0, (40, 3)) * (1.0, 1.0, thickness)))


@pytest.mark.parametrize("thickness", [1.0, 1e-6])
def test_volumes_have_the_moments(thickness):
    powers = points(thickness)
    moments = np.array([1.0, 0.02, -0.01, 0.03 * thickness])
    volumes = fit_volumes(np.full(40, 0.025), powers, moments, np.zeros(4))
    np.testing.assert_allclose(powers.T @ volumes, moments, rtol=0.0, atol=1e-12)
    assert (volumes > 0.0).all()


def test_particles_in_a_plane_have_no_moment_off_it():
    with pytest.raises(NoNodalVolumes, match="too uneven"):
        fit_volumes(np.full(40, 0.025), points(0.0), np.array([1.0, 0.0, 0.0, 0.1]), np.zeros(4))


@pytest.mark.parametrize("index", range(4))
def test_a_nan_moment_is_an_error(index):
    powers, volumes = points(1.0), np.full(40, 0.025)
    moments = powers.T @ volumes
    moments[index] = np.nan
    with pytest.raises(NoNodalVolumes):
        fit_volumes(volumes, powers, moments, np.zeros(4))


def test_badly_scaled_equations_are_solved_and_dependent_ones_are_not():
    scales = 10.0 ** np.array([0.0, -3.0, -7.0])
    matrix = np.array([[2.0, 0.5, 0.2], [0.5, 1.0, -0.3], [0.2, -0.3, 3.0]]) * np.outer(scales, scales)
    moments = np.array([1.0, 2.0, 3.0]) / scales
    right = (matrix @ moments)[:, None]
    assert _solve(matrix.copy(), right)
    np.testing.assert_allclose(right[:, 0], moments, rtol=1e-13)
    assert not _solve(np.ones((3, 3)), np.ones((3, 1)))
