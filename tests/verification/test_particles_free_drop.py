"""Free drops with inertia against Rayleigh, Lamb, Reid and Laplace."""

import numpy as np
import pytest

from reflowshock.particles.parameters.scenes import Liquid, Oscillation
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.reference.drop_oscillation import lamb_decay_rate, rayleigh_frequency, viscous_oscillation
from reflowshock.particles.scenes.free_drop import solve_free_drop, solve_oscillation

RADIUS, DENSITY, GAMMA = 0.62e-3, 8930.0, 0.4985


def drop(ohnesorge, shells):
    """Return a ball of solder with a given Ohnesorge number mu / sqrt(rho gamma R)."""
    viscosity = ohnesorge * np.sqrt(DENSITY * GAMMA * RADIUS)
    numerics = SolderNumerics(spacing=RADIUS / shells)
    return Solder(volume=4 / 3 * np.pi * RADIUS**3, viscosity=viscosity, numerics=numerics)


def test_viscous_oscillation_has_its_limits():
    """The decay approaches Lamb's rate with the square root of viscosity (vortical layer below the surface)."""
    omega = rayleigh_frequency(2, 1.0, 1.0, 1.0)
    assert omega == pytest.approx(np.sqrt(8.0))
    misses = []
    for viscosity in (4e-4, 1e-4):
        decay, frequency = viscous_oscillation(2, omega, viscosity)
        assert frequency == pytest.approx(omega, rel=1e-4)
        misses.append(decay / lamb_decay_rate(2, 1.0, 1.0, viscosity) - 1.0)
    assert misses[1] == pytest.approx(0.5 * misses[0], rel=0.05)


def exact(ohnesorge):
    """Return decay rate [1/s] and period [s] of the second mode at small amplitude."""
    diffusion_rate = ohnesorge * np.sqrt(GAMMA / (DENSITY * RADIUS**3))
    decay, frequency = viscous_oscillation(2, rayleigh_frequency(2, RADIUS, DENSITY, GAMMA), diffusion_rate)
    return decay, 2.0 * np.pi / frequency


def check_conservation(result):
    """Check volume, momentum (over mass times maximum speed) and the monotonic decrease of energy."""
    history = result.history
    mass = DENSITY * history["volume"][0]
    assert result.metrics["volume_drift"][0] < 1e-6
    assert history["momentum"].max() < 1e-10 * np.sqrt(2.0 * mass * history["kinetic_energy"].max())
    assert np.diff(history["energy"]).max() < 0.0


def second_mode_errors(shells, decay_rate):
    """Return period errors at small amplitude and Ohnesorge number 0.02, and check that they decrease with the shells.

    The effect of the time step on the period, (omega dt)^2 / 3, is subtracted. The last run checks the decay rate.
    """
    decay, period = exact(0.02)
    from_time_step = (2.0 * np.pi / 80) ** 2 / 3.0
    errors = []
    for count in shells:
        result = solve_free_drop(drop(0.02, count), amplitude=0.02, periods=1.5, steps_per_period=80)
        errors.append(abs(result.metrics["period"][0] / period - 1.0 - from_time_step))
        check_conservation(result)
    assert -np.polyfit(np.log(shells), np.log(errors), 1)[0] > 1.5, errors
    assert result.metrics["decay_rate"][0] == pytest.approx(decay, rel=decay_rate)
    return errors


@pytest.mark.long
def test_second_mode_converges_in_space():
    """The order is two; the next test and the half drop on a wall check Reid's period within 0.5 %."""
    second_mode_errors(np.array([2, 3]), 0.05)


@pytest.mark.long
def test_second_mode_of_four_shells():
    """The order is two, with Reid's period within 0.5 % and decay within 5 %."""
    assert second_mode_errors(np.array([2, 3, 4]), 0.05)[-1] < 5e-3


@pytest.mark.long
def test_second_mode_converges_in_time():
    """The order is two, from differences of the period for steps of ratio 2."""
    steps = (25, 50, 100)
    runs = [solve_free_drop(drop(0.02, 2), amplitude=0.02, periods=1.5, steps_per_period=count) for count in steps]
    coarse, middle, fine = (run.metrics["period"][0] for run in runs)
    assert np.log2((coarse - middle) / (middle - fine)) > 1.7


@pytest.mark.long
def test_laplace_pressure_converges():
    """The polyhedron at rest has the pressure 2 A / (3 V), of second order."""
    shells = np.array([2, 3, 4, 5])
    runs = [solve_free_drop(drop(0.02, count), periods=0.1, steps_per_period=10) for count in shells]
    errors = [run.metrics["mean_pressure_error"][0] for run in runs]
    assert -np.polyfit(np.log(shells), np.log(errors), 1)[0] > 1.8, errors


@pytest.mark.long
def test_second_mode_of_solder_at_a_tenth_of_the_radius():
    """Period within 1 % and decay within 10 % of Reid's values; his decay is 1.9 % below Lamb's.

    At this amplitude the exact period is about 0.4 % longer (Tsamopoulos & Brown 1983).
    """
    result = solve_free_drop(drop(1.37e-3, 4), amplitude=0.1, periods=2.0)
    assert result.history["amplitude"].max() == pytest.approx(0.1, rel=0.1)
    assert abs(result.metrics["period_error"][0]) < 0.01
    assert abs(result.metrics["decay_rate_error"][0]) < 0.1
    check_conservation(result)


@pytest.mark.long
@pytest.mark.parametrize(("shells", "excess"), [(3, 0.25), (4, 0.2), (5, 0.15), (7, 0.12)])
def test_ispg_has_the_period_and_decay_of_a_free_drop(shells, excess):
    """Smoothing and time integration each cause half of the excess decay (0.21, 0.18, 0.10 and 0.08)."""
    scene = Oscillation(volume=1e-9, particles_per_radius=shells, scheme="ispg")
    metrics = solve_oscillation(scene, scene.resolve(Liquid())).metrics
    assert abs(metrics["period_error"][0]) < 0.01
    assert 0.0 < metrics["decay_rate_error"][0] < excess
    assert metrics["volume_drift"][0] < 1e-6


def test_laplace_drop():
    """Tilford et al.: radius 46.75 um, 0.072 N/m, 3.08 kPa."""
    numerics = SolderNumerics(spacing=46.75e-6 / 4)
    liquid = Solder(
        volume=4 / 3 * np.pi * 46.75e-6**3, density=1e3, surface_tension=0.072, viscosity=1e-3, numerics=numerics
    )
    result = solve_free_drop(liquid, periods=1.0, steps_per_period=30)
    assert result.metrics["mean_pressure"][0] == pytest.approx(3080.0, rel=5e-3)
    assert result.metrics["pressure_scatter"][0] < 2e-3
    assert result.metrics["capillary_number_at_rest"][0] < 1e-4
    assert result.metrics["volume_drift"][0] < 1e-6


@pytest.mark.long
def test_a_drop_stretched_to_more_than_half_its_radius():
    """Energy decreases and momentum and volume are conserved through remeshing of tetrahedra; the period is longer."""
    result = solve_free_drop(drop(1.37e-3, 3), amplitude=0.5, periods=1.0)
    history = result.history
    assert history["amplitude"].max() > 0.6
    assert np.diff(history["energy"]).max() < 0.0
    assert result.metrics["volume_drift"][0] < 2e-5
    mass = DENSITY * history["volume"][0]
    assert history["momentum"].max() < 1e-10 * np.sqrt(2.0 * mass * history["kinetic_energy"].max())
    assert 0.0 < result.metrics["period_error"][0] < 0.25
