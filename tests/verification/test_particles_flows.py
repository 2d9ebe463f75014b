"""Flows by delta-SPH against exact solutions and measurements: channel, vortices, tank at rest, dam break."""

from math import log2, sqrt

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq

from reflowshock.particles.flows.channel import Poiseuille, exact_speeds
from reflowshock.particles.flows.dam_break import DamBreak
from reflowshock.particles.flows.flow_effects import decide_flow
from reflowshock.particles.flows.rheology import Rheology
from reflowshock.particles.flows.sph_numerics import SphNumerics
from reflowshock.particles.flows.vortices import TaylorGreen
from reflowshock.particles.reference.dam_break import FRONT
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.sph_flows.dam_break import dam, solve_dam_break
from reflowshock.particles.sph_flows.viscous_flows import channel, solve_poiseuille, solve_taylor_green


def value(result, name):
    """Return the value of a metric of a result."""
    return result.metrics[name][0]


def test_channel_starts_as_the_exact_solution():
    errors = []
    for across in (10, 20):
        scene = Poiseuille(width=1e-3, speed=0.01, duration=0.2, numerics=SphNumerics(particles_across=across))
        errors.append(value(solve_poiseuille(scene), "profile_error"))
    assert errors[1] < 0.01
    assert log2(errors[0] / errors[1]) > 1.0


def carreau_profile(height, scene):
    """Return steady speeds [m/s]: linear stress across the channel, shear rate by root finding, then integration."""
    law, offset = scene.rheology, np.linspace(0.0, 0.5 * scene.width, 1001)
    stress = scene.density * scene.force * offset
    rates = [brentq(lambda rate, s=s: law.viscosity(rate, scene.viscosity) * rate - s, 0.0, 1e4) for s in stress]
    below = cumulative_trapezoid(rates, offset, initial=0.0)
    return np.interp(np.abs(height - 0.5 * scene.width), offset, below[-1] - below)


def power_law_profile(height, scene):
    """Return steady speeds [m/s] of an unbounded power law (Bird, Armstrong, Hassager 1987)."""
    offset = np.abs(2.0 * height / scene.width - 1.0)
    return scene.speed * (1.0 - offset ** (1.0 + 1.0 / scene.rheology.exponent))


THINNING = {"law": "power_law", "exponent": 0.5, "shear_rate": 40.0}
THICKENING = {"law": "power_law", "exponent": 1.5, "shear_rate": 40.0}
CARREAU = {"law": "carreau", "exponent": 0.4, "shear_rate": 10.0, "viscosity_at_infinity": 1e-4}


def steady_speeds(height, scene):
    """Return the exact steady speeds of a channel at heights [m], shape (n,) [m/s]."""
    return exact_speeds(height, 0.0, scene)


def error_of_steady_flow(rheology, profile, across, duration):
    """Return the RMS speed error over the largest speed after a duration [w^2 / nu] from the exact profile."""
    numerics = SphNumerics(particles_across=across)
    scene = Poiseuille(width=1e-3, speed=0.01, duration=duration, rheology=Rheology(**rheology), numerics=numerics)
    simulation = channel(scene)
    liquid = slice(simulation.fluids)
    simulation.fields.u[liquid] = profile(simulation.fields.z[liquid], scene)
    while simulation.time < scene.until:
        simulation.step(simulation.time_step())
    error = simulation.fields.u[liquid] - profile(simulation.fields.z[liquid], scene)
    return float(np.sqrt((error**2).mean())) / scene.speed


@pytest.mark.parametrize("rheology", [THINNING, THICKENING])
def test_a_power_law_without_its_bounds_has_the_exact_profile(rheology):
    scene = Poiseuille(width=1e-3, speed=0.01, rheology=Rheology(**rheology, bound=1000.0))
    height = np.linspace(0.0, scene.width, 41)
    assert steady_speeds(height, scene) == pytest.approx(power_law_profile(height, scene), abs=1e-4 * scene.speed)


def test_carreau_liquid_has_the_exact_profile():
    scene = Poiseuille(width=1e-3, speed=0.01, rheology=Rheology(**CARREAU))
    height = np.linspace(0.0, scene.width, 41)
    assert steady_speeds(height, scene) == pytest.approx(carreau_profile(height, scene), abs=1e-4 * scene.speed)
    assert steady_speeds(np.array([0.5e-3]), scene)[0] == pytest.approx(scene.speed, rel=1e-4)


@pytest.mark.parametrize(
    ("rheology", "profile"),
    [
        pytest.param(THINNING | {"bound": 4.0}, steady_speeds, marks=pytest.mark.long, id="power law"),
        pytest.param(CARREAU, carreau_profile, id="Carreau"),
    ],
)
def test_liquid_whose_viscosity_depends_on_shear_keeps_its_profile(rheology, profile):
    assert error_of_steady_flow(rheology, profile, 10, 0.1) < 0.03


@pytest.mark.long
@pytest.mark.parametrize(
    ("rheology", "profile"),
    [(THINNING, power_law_profile), (THICKENING, power_law_profile), (CARREAU, carreau_profile)],
    ids=["thinning", "thickening", "Carreau"],
)
def test_profiles_of_such_liquids_converge(rheology, profile):
    coarse, fine = (error_of_steady_flow(rheology, profile, across, 0.5) for across in (10, 20))
    assert fine < 0.02
    assert log2(coarse / fine) > 1.0


def test_vortices_die_out_at_the_exact_rate():
    errors = []
    for across in (16, 32):
        scene = TaylorGreen(side=1e-3, speed=0.1, numerics=SphNumerics(particles_across=across))
        result = solve_taylor_green(scene)
        errors.append(value(result, "speed_error"))
    assert abs(value(result, "decay_rate_error")) < 0.05
    assert log2(errors[0] / errors[1]) > 1.0


def tank(diffusion, viscosity, across=16):
    """Return pressure errors of a tank at rest over rho g H, and kinetic over potential energy."""
    numerics = SphNumerics(particles_across=across, density_diffusion=diffusion, artificial_viscosity=viscosity)
    scene = DamBreak(height=1.0, width=1.0, tank_length=1.0, sensor_height=0.2, duration=1.0, numerics=numerics)
    simulation = dam(scene)
    errors, energies = [], []
    while simulation.time < 5.0 * scene.unit_of_time:
        simulation.step(simulation.time_step())
        liquid, fields = slice(simulation.fluids), simulation.fields
        exact = 1.0 - fields.z[liquid]
        errors.append(fields.pressure[liquid] / (scene.density * scene.gravity * scene.height) - exact)
        energies.append(fields.mass[liquid] @ (fields.u[liquid] ** 2 + fields.w[liquid] ** 2))
    late = np.array(errors[-len(errors) // 4 :])
    return late, np.array(energies) / (scene.gravity * scene.height * simulation.fields.mass[liquid].sum())


def test_a_tank_rests_under_its_weight():
    errors, motion = tank(0.1, 0.02)
    assert np.abs(errors.mean(axis=0)).mean() < 0.02
    assert motion.max() < 1e-3


@pytest.mark.long
def test_density_diffusion_removes_pressure_noise():
    smooth, rough = (tank(diffusion, 0.0)[0].std() for diffusion in (0.1, 0.0))
    assert smooth < rough / 5.0


def dam_break(across, duration):
    """Return the result of a dam break, from particles across and duration [sqrt(H / g)]."""
    numerics = SphNumerics(particles_across=across)
    parameters = {"height": 0.6, "width": 1.2, "tank_length": 3.22, "sensor_height": 0.12}
    return solve_dam_break(DamBreak(**parameters, duration=duration * sqrt(0.6 / 9.81), numerics=numerics))


@pytest.mark.long
def test_a_dam_break_strikes_the_wall_as_measured():
    """At coarse resolution the front is thinner than the smoothing length and is detected late."""
    result = dam_break(20, 5.1)
    assert value(result, "impact_onset") == pytest.approx(2.5, abs=0.15)
    assert value(result, "plateau_mean") == pytest.approx(0.5, abs=0.1)
    assert value(result, "particles_lost") == 0
    assert value(result, "energy_rise") < 0.01


@pytest.mark.long
def test_a_finer_dam_break_strikes_when_and_as_hard_as_measured():
    result = dam_break(60, 5.1)
    assert value(result, "impact_onset") == pytest.approx(2.5, abs=0.1)
    assert value(result, "plateau_mean") == pytest.approx(0.5, abs=0.1)
    assert value(result, "particles_lost") == 0


def test_front_of_a_column_matches_an_independent_code():
    """The reference is interFoam's front with free slip and H = 2 W; Martin & Moyce measured it 11 to 19 % behind."""
    numerics = SphNumerics(particles_across=40)
    parameters = {"height": 2.0, "width": 1.0, "tank_length": 4.0, "sensor_height": 0.4, "duration": 0.47}
    scene = DamBreak(**parameters, numerics=numerics)
    history = solve_dam_break(scene).history
    time = history["time"] * sqrt(2.0 * scene.gravity / scene.width)
    front = np.interp(FRONT[0], time, history["front"] + 0.5 * scene.spacing) / scene.width
    assert front == pytest.approx(FRONT[1], rel=0.05)


@pytest.mark.parametrize("term", ["viscosity", "artificial"])
def test_a_term_that_is_off_is_not_computed(term):
    """The unused parameter is NaN: a rate that used it would be NaN."""
    numerics = SphNumerics(particles_across=10)
    parameters = {"height": 0.6, "width": 1.2, "tank_length": 3.22, "sensor_height": 0.12, "duration": 1.0}
    simulation = dam(DamBreak(**parameters, numerics=numerics))
    laws = [simulation.law._replace(**{term: value}) for value in (0.0, float("nan"))]
    rates = [Simulation(simulation.fields, simulation.fluids, law).rates for law in laws]
    assert np.isfinite(rates[0]).all()
    assert np.array_equal(rates[0], rates[1])  # "nan > 0" is false, so the branch is not taken
    acting = Simulation(simulation.fields, simulation.fluids, laws[0]._replace(**{term: 1e3}))
    acting.fields.u[: simulation.fluids] = np.sin(40.0 * simulation.fields.z[: simulation.fluids])
    with_term, without = (
        Simulation(acting.fields, simulation.fluids, laws[0]._replace(**{term: value})).rates for value in (1e3, 0.0)
    )
    assert not np.array_equal(with_term, without)


def test_neglected_viscosity_changes_nothing():
    numerics = SphNumerics(particles_across=10, artificial_viscosity=0.02)
    parameters = {"height": 0.6, "width": 1.2, "tank_length": 3.22, "sensor_height": 0.12, "duration": 0.4}
    fronts = []
    for switch in ("off", "on"):
        scene = DamBreak(**parameters, numerics=numerics, effects={"viscosity": switch})
        fronts.append(solve_dam_break(scene).history["front"][-1])
    decision = decide_flow(scene.model_copy(update={"effects": scene.effects.model_copy(update={"viscosity": "auto"})}))
    assert not decision["flow_viscosity"]["on"]
    assert fronts[1] == pytest.approx(fronts[0], rel=decision["flow_viscosity"]["influence"])


def test_small_artificial_viscosity_changes_little():
    rates = []
    for alpha in (0.0, 1e-3):
        numerics = SphNumerics(particles_across=16, artificial_viscosity=alpha)
        scene = TaylorGreen(side=1e-3, speed=0.1, duration=0.5, numerics=numerics)
        rates.append(value(solve_taylor_green(scene), "decay_rate"))
    influence = decide_flow(scene)["artificial_viscosity"]["influence"]
    assert 0.0 < influence < 1e-3
    assert rates[1] == pytest.approx(rates[0], rel=0.01)
