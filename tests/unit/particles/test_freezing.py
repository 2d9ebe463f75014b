"""Freezing on a cold plate: Neumann's exact layer growth, heat conservation and a freezing drop."""

from math import erf, exp, pi, sqrt

import numpy as np
import pytest

from reflowshock.materials import enthalpy
from reflowshock.particles.flows.freezing import Freezing
from reflowshock.particles.flows.printing import LITTLE_FROZEN, Printing, PrintingNumerics
from reflowshock.particles.printing.deposit import LIQUID, SOLID, Deposit
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.heat import Heat, enthalpy_at
from reflowshock.particles.sph.smoothing import norm

SOLDER = {
    "melting_point": 490.0, "substrate_temperature": 350.0, "temperature": 540.0, "latent_heat": 5.9e4,
    "heat_capacity": 250.0, "conductivity": 57.0,
}  # fmt: skip
DENSITY = 7400.0


def column(count, mirror=1, **changes):
    """Return the heat of a column of particles 1 um apart on the plate, and their fields."""
    scene = Printing(
        drop_volume=2.5e-13, surface_tension=0.55, viscosity=2e-3, speed=1.5, delay=1.0, pitch=1e-4, columns=1, rows=1,
        density=DENSITY,
    )  # fmt: skip
    law = Deposit(scene).law
    law = law._replace(dimension=1, spacing=1e-6, length=1.3e-6, norm=norm(law.kernel, 1, 1.3e-6), mirror=mirror)
    points = np.zeros((3, count))
    points[2] = 1e-6 * (np.arange(count) + 0.5)
    fields = flow.make_fields(points, np.empty((3, 0)), np.zeros(count), law)
    freezing = Freezing(**(SOLDER | changes))
    return Heat(freezing, law, np.full(count, enthalpy_at(freezing, freezing.temperature))), fields


@pytest.mark.parametrize("temperature", [490.0, 540.0])
def test_a_layer_freezes_as_fast_as_in_the_exact_solution(temperature):
    errors = []
    for thickness in (10.0, 20.0):
        heat, fields = column(round(8.0 * thickness), temperature=temperature)
        until = heat.freezing.time_for(1e-6 * thickness, DENSITY)
        steps = int(np.ceil(until / heat.longest_step))
        for _ in range(steps):
            heat.conduct(fields, until / steps)
        share = 1.0 - np.clip(heat.enthalpy / heat.freezing.latent_heat, 0.0, 1.0)
        assert abs(share.sum() / thickness - 1.0) < 0.01
        depth = fields.z / (2.0 * sqrt(heat.freezing.diffusivity(DENSITY) * until))
        solid = depth < 0.9 * heat.freezing.growth
        rise = np.array([erf(scaled) for scaled in depth[solid]]) / erf(heat.freezing.growth)
        exact = 350.0 + 140.0 * rise
        errors.append(np.abs(heat.temperature[solid] - exact).max() / 140.0)
    assert errors[1] < 0.02 and errors[1] < 0.7 * errors[0], errors


def test_growth_solves_the_equation_of_stefan():
    growth = Freezing(**(SOLDER | {"temperature": 490.0})).growth
    assert growth * exp(growth**2) * erf(growth) == pytest.approx(250.0 * 140.0 / 5.9e4 / sqrt(pi), rel=1e-9)
    assert Freezing(**(SOLDER | {"substrate_temperature": 490.0})).growth == 0.0


def test_heat_is_conserved_without_a_plate():
    heat, fields = column(40, mirror=0)
    heat.enthalpy[:10] = enthalpy_at(heat.freezing, 300.0)
    before = heat.enthalpy.sum()
    for _ in range(100):
        heat.conduct(fields, heat.longest_step)
    assert heat.enthalpy.sum() == pytest.approx(before, rel=1e-12)
    assert heat.temperature[:10].mean() > 310.0


def test_enthalpy_and_temperature_are_inverse_outside_the_latent_heat():
    properties = {"melting_point": 490.0, "heat_capacity": 250.0, "latent_heat": 5.9e4}
    temperatures = np.array([350.0, 489.0, 491.0, 540.0])
    stored = enthalpy.enthalpy(temperatures, **properties)
    assert enthalpy.temperature(stored, **properties) == pytest.approx(temperatures, rel=1e-12)
    assert enthalpy.temperature(2.0e4, **properties) == 490.0
    assert enthalpy.enthalpy(490.0, **properties) == 5.9e4


def frozen(restart_after=None):
    """Run the landing and freezing of a solder drop; return it and the particles solid at half time."""
    scene = Printing(
        drop_volume=2.5e-13, surface_tension=0.345, viscosity=1.3e-3, speed=1.5, delay=1.0, pitch=1e-4, columns=1,
        rows=1, density=DENSITY, freezing=Freezing(**SOLDER), numerics=PrintingNumerics(particles_per_diameter=8),
    )  # fmt: skip
    deposit = Deposit(scene)
    deposit.add_drop((0.0, 0.0))
    steps, halfway = 0, None
    while deposit.simulation:
        deposit.step(1.0)
        steps += 1
        if steps % 20 == 0:
            deposit.cure()
        if halfway is None and (deposit.state == LIQUID).mean() < 0.5:
            deposit.update()
            halfway = deposit.state != LIQUID, deposit.points.copy()
        if steps == restart_after:
            saved = deposit.saved()
            deposit = Deposit(scene)
            deposit.restore(saved)
    return scene, deposit, halfway


def test_a_drop_freezes_from_the_plate_upwards_and_frozen_particles_stay_fixed():
    scene, deposit, (solid, points) = frozen()
    assert points[solid, 2].mean() < 0.6 * points[~solid, 2].mean()
    assert np.array_equal(deposit.points[solid], points[solid])
    assert (deposit.state == SOLID).all() and len(deposit.bodies) == 1
    top = deposit.points[:, 2].max() + 0.5 * scene.spacing
    assert 0.7 < deposit.time / scene.freezing.time_for(top, DENSITY) < 1.6  # finite size of the drop
    _, again, _ = frozen(restart_after=150)
    assert np.array_equal(again.points, deposit.points) and again.time == deposit.time


DROP = {
    "drop_volume": 2.5e-13, "surface_tension": 0.345, "speed": 1.5, "delay": 1e-3, "pitch": 1e-4, "columns": 1,
    "rows": 1, "density": DENSITY, "numerics": PrintingNumerics(particles_per_diameter=8),
}  # fmt: skip
SLOW = Freezing(**(SOLDER | {"conductivity": 1e-5}))


def test_light_cures_drops_that_do_not_freeze():
    assert Printing(**DROP, freezing=Freezing(**SOLDER)).freezes
    assert Printing(**DROP, freezing=SLOW, effects={"freezing": "on"}).freezes
    off = {"freezing": Freezing(**SOLDER), "effects": {"freezing": "off"}}
    for scene in (Printing(**DROP), Printing(**DROP, freezing=SLOW), Printing(**DROP, **off)):
        assert not scene.freezes
        deposit = Deposit(scene)
        deposit.add_drop((0.0, 0.0))
        deposit.expose(scene.cure_time)
        assert deposit.heat is None and deposit.cure()


def test_slow_freezing_changes_little():
    final_points = []
    for switch in ("off", "on"):
        scene = Printing(**DROP, freezing=SLOW, effects={"freezing": switch})
        deposit = Deposit(scene)
        deposit.add_drop((0.0, 0.0))
        for _ in range(60):
            deposit.step(1.0)
        assert (deposit.heat is not None) == (switch == "on")
        deposit.cure()
        final_points.append(deposit.points)
    assert scene.share_frozen < LITTLE_FROZEN
    assert np.abs(final_points[1] - final_points[0]).max() < scene.share_frozen * scene.length
