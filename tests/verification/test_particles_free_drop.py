"""Free drops with inertia against Rayleigh, Lamb, Reid and Laplace."""

import numpy as np
import pytest

from particles.free_drop import solve_free_drop
from particles.parameters import Solder, SolderNumerics
from particles.rayleigh import lamb_decay_rate, rayleigh_frequency, viscous_oscillation

RADIUS, DENSITY, GAMMA = 0.62e-3, 8930.0, 0.4985


def drop(ohnesorge, shells):
    """A ball of solder whose viscosity gives an Ohnesorge number mu / sqrt(rho gamma R)."""
    viscosity = ohnesorge * np.sqrt(DENSITY * GAMMA * RADIUS)
    numerics = SolderNumerics(spacing=RADIUS / shells)
    return Solder(volume=4 / 3 * np.pi * RADIUS**3, viscosity=viscosity, numerics=numerics)


def test_viscous_oscillation_has_its_limits():
    """Lamb's rate at small viscosity, approached with its square root (the vortical layer below the surface)."""
    omega = rayleigh_frequency(2, 1.0, 1.0, 1.0)
    assert omega == pytest.approx(np.sqrt(8.0))
    misses = []
    for viscosity in (4e-4, 1e-4):
        decay, frequency = viscous_oscillation(2, omega, viscosity)
        assert frequency == pytest.approx(omega, rel=1e-4)
        misses.append(decay / lamb_decay_rate(2, 1.0, 1.0, viscosity) - 1.0)
    assert misses[1] == pytest.approx(0.5 * misses[0], rel=0.05)


def test_second_mode_of_a_viscous_drop():
    """147 particles, small amplitude, Ohnesorge number 0.02: period within 0.5 %, decay rate within 10 % of Reid's."""
    result = solve_free_drop(drop(0.02, 3), amplitude=0.02, periods=1.5)
    diffusion_rate = 0.02 * np.sqrt(GAMMA / (DENSITY * RADIUS**3))
    decay, frequency = viscous_oscillation(2, rayleigh_frequency(2, RADIUS, DENSITY, GAMMA), diffusion_rate)
    assert result.metrics["period"][0] == pytest.approx(2.0 * np.pi / frequency, rel=5e-3)
    assert result.metrics["decay_rate"][0] == pytest.approx(decay, rel=0.1)
    assert np.diff(result.history["energy"]).max() < 0.0
    assert result.metrics["volume_drift"][0] < 1e-6
