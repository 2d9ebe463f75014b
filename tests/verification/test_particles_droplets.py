"""Droplets by delta-SPH: Young and Laplace, spherical caps, an impact, energy, hard cases; effects on and off."""

import numpy as np
import pytest

from reflowshock.particles.parameters.droplets import Droplet, DropletNumerics, cap
from reflowshock.particles.parameters.flow_effects import decide_flow
from reflowshock.particles.scenes.droplet import droplet, solve_droplet

INK = {"diameter": 93.5e-6, "density": 1000.0, "surface_tension": 0.072, "viscosity": 0.02}
JET = INK | {"diameter": 23e-6, "viscosity": 0.0149, "speed": 5.0}


def ink(across, duration, **changes):
    return Droplet(**INK | changes, duration=duration, numerics=DropletNumerics(particles_per_diameter=across))


def value(result, name):
    return result.metrics[name][0]


@pytest.mark.parametrize(("diameter", "tension"), [(93.5e-6, 0.072), (46.75e-6, 0.072), (93.5e-6, 0.036)])
def test_the_pressure_of_a_free_drop_is_that_of_young_and_laplace(diameter, tension):
    scene = ink(10, 1.0, diameter=diameter, surface_tension=tension)
    result = solve_droplet(scene.model_copy(update={"duration": 0.3 * scene.unit_of_time}))
    assert abs(value(result, "pressure_error")) < 0.02
    assert value(result, "roundness") < 1.03


def assert_cap(scene, slack):
    result = solve_droplet(scene)
    assert abs(value(result, "base_error")) < slack
    assert abs(value(result, "height_error")) < slack


def test_a_drop_on_a_wall_becomes_a_cap():
    assert_cap(ink(10, 60e-6, contact_angle=np.radians(90.0)), 0.02)


@pytest.mark.long
@pytest.mark.parametrize(("degrees", "duration", "slack"), [(60.0, 250e-6, 0.02), (120.0, 350e-6, 0.03)])
def test_drops_on_walls_that_they_wet_or_not_become_caps(degrees, duration, slack):
    assert_cap(ink(14, duration, contact_angle=np.radians(degrees)), slack)


@pytest.mark.parametrize(
    ("receding", "advancing", "angle"), [(60.0, 120.0, 90.0), (100.0, 130.0, 100.0), (50.0, 80.0, 80.0)]
)
def test_a_contact_line_moves_only_beyond_its_advancing_and_receding_angle(receding, advancing, angle):
    """A half sphere on a wall: it stays, recedes to the receding angle or advances to the advancing one."""
    contact, bounds = np.radians(0.5 * (receding + advancing)), np.radians([receding, advancing])
    scene = ink(10, 80e-6, contact_angle=contact, receding_angle=bounds[0], advancing_angle=bounds[1])
    result = solve_droplet(scene)
    base, height = cap(np.radians(angle))
    assert value(result, "base_over_diameter") == pytest.approx(base, rel=0.03)
    assert value(result, "height_over_diameter") == pytest.approx(height, rel=0.03)
    assert "base_error" not in result.metrics


def test_one_angle_is_what_it_was_without_bounds():
    one, two = (droplet(ink(8, 1.0, contact_angle=1.2, **more)) for more in ({}, {"advancing_angle": 1.2}))
    for simulation in (one, two):
        for _ in range(20):
            simulation.step(1e-8)
    assert two.surface.bounds == pytest.approx((np.cos(1.2), np.cos(1.2)))
    assert np.allclose(one.surface.points, two.surface.points, rtol=0.0, atol=1e-12 * one.law.spacing)


def test_an_impact_spreads_as_volumes_of_fluid_do():
    """23 um at 5 m/s, 90 degrees: an axisymmetric volume of fluid spreads to 1.21 to 1.25 D in 2.3 to 3.7 us."""
    result = solve_droplet(Droplet(**JET, duration=6e-6, numerics=DropletNumerics(particles_per_diameter=10)))
    assert 1.0 <= value(result, "spread_max") <= 1.4
    assert 2e-6 <= value(result, "time_of_spread_max") <= 6e-6
    assert abs(value(result, "volume_drift")) < 0.01


def test_the_energy_of_a_drop_that_is_let_go_only_falls():
    """A cube of ink: kinetic energy and that of its surface; what compression keeps is small."""
    history = solve_droplet(ink(10, 60e-6, start="cube")).history
    total = history["kinetic_energy"] + history["surface_energy"]
    rise = (np.maximum.accumulate(total[::-1])[::-1] - total).max()
    assert rise < 0.01 * total[0]
    assert total[-1] < total[0]


def test_effects_that_are_off_do_nothing():
    """Weight off: no acceleration; tension off: no force of the surface."""
    simulation = droplet(ink(8, 1e-6, contact_angle=1.2))
    assert simulation.law.gravity_z == 0.0
    heavy = droplet(ink(8, 1e-6, contact_angle=1.2, effects={"gravity": "on"}))
    above = simulation.fields.z > 2.0 * simulation.law.length  # below, images weigh too
    assert np.allclose((heavy.rates[3] - simulation.rates[3])[above], -9.81, rtol=1e-6)
    without = droplet(ink(8, 1e-6, contact_angle=1.2, effects={"surface_tension": "off"}))
    assert not without.surface.forces().any()
    assert np.abs(without.rates[1:4]).max() < 1e-9 * np.abs(simulation.rates[1:4]).max()


def test_little_weight_does_little():
    heights = [
        value(solve_droplet(ink(8, 40e-6, contact_angle=1.2, effects={"gravity": switch})), "height_over_diameter")
        for switch in ("off", "on")
    ]
    told = decide_flow(ink(8, 1.0, contact_angle=1.2))["droplet_gravity"]
    assert not told["on"]
    assert heights[1] == pytest.approx(heights[0], rel=max(told["influence"], 1e-3))


def test_little_tension_does_little():
    """At a Weber number of 20 000, before the drop has spread far."""
    spreads = []
    for switch in ("off", "on"):
        scene = ink(8, 1.0, weber=2e4, reynolds=50.0, effects={"surface_tension": switch})
        scene = scene.model_copy(update={"duration": 0.5 * scene.unit_of_time})
        spreads.append(solve_droplet(scene).history["spread"][-1])
    told = decide_flow(ink(8, 1.0, weber=2e4, reynolds=50.0))["droplet_tension"]
    assert not told["on"]
    assert spreads[1] == pytest.approx(spreads[0], rel=told["influence"])


@pytest.mark.parametrize("reynolds", [5.0, 100.0])
def test_hard_impacts_stay_finite_and_on_their_side_of_the_wall(reynolds):
    scene = ink(8, 1.0, weber=100.0, reynolds=reynolds)
    result = solve_droplet(scene.model_copy(update={"duration": 0.6 * scene.unit_of_time}))
    assert result.pictures[-1].points[:, 2].min() >= 0.0
    assert abs(value(result, "volume_drift")) < 0.02
    assert np.isfinite(result.history["height"]).all()
