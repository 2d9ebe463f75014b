"""Volumes with wanted moments: what has none is told, not computed with."""

import numpy as np
import pytest

from reflowshock.particles.ispg.nodal_volumes import NoNodalVolumes, _solve, fitted_volumes

RANDOM = np.random.default_rng(5)


def points(thickness: float) -> np.ndarray:
    """Powers `(n, 4)` up to the first degree of points in a film."""
    return np.column_stack((np.ones(40), RANDOM.uniform(-1.0, 1.0, (40, 3)) * (1.0, 1.0, thickness)))


@pytest.mark.parametrize("thickness", [1.0, 1e-6])
def test_volumes_have_the_moments(thickness):
    powers = points(thickness)
    wanted = np.array([1.0, 0.02, -0.01, 0.03 * thickness])
    found = fitted_volumes(np.full(40, 0.025), powers, wanted, np.zeros(4))
    np.testing.assert_allclose(powers.T @ found, wanted, rtol=0.0, atol=1e-12)
    assert (found > 0.0).all()


def test_particles_in_a_plane_have_none_off_it():
    with pytest.raises(NoNodalVolumes, match="too unevenly"):
        fitted_volumes(np.full(40, 0.025), points(0.0), np.array([1.0, 0.0, 0.0, 0.1]), np.zeros(4))


@pytest.mark.parametrize("place", range(4))
def test_a_moment_that_is_no_number_is_missing(place):
    """Also where nothing is missing of the others."""
    powers, found = points(1.0), np.full(40, 0.025)
    wanted = powers.T @ found
    wanted[place] = np.nan
    with pytest.raises(NoNodalVolumes):
        fitted_volumes(found, powers, wanted, np.zeros(4))


def test_equations_of_any_scales_are_solved_and_dependent_ones_are_not():
    scales = 10.0 ** np.array([0.0, -3.0, -7.0])
    matrix = np.array([[2.0, 0.5, 0.2], [0.5, 1.0, -0.3], [0.2, -0.3, 3.0]]) * np.outer(scales, scales)
    wanted = np.array([1.0, 2.0, 3.0]) / scales
    right = (matrix @ wanted)[:, None]
    assert _solve(matrix.copy(), right)
    np.testing.assert_allclose(right[:, 0], wanted, rtol=1e-13)
    assert not _solve(np.ones((3, 3)), np.ones((3, 1)))
