"""Shear-rate dependent viscosity: laws, particle shear rates, effects, restart, printed ink."""

import numpy as np
import pytest

from reflowshock.particles.flows.droplet import Droplet, DropletNumerics
from reflowshock.particles.flows.flow_effects import decide_flow
from reflowshock.particles.flows.printing import Printing
from reflowshock.particles.flows.rheology import Rheology
from reflowshock.particles.printing.deposit import Deposit
from reflowshock.particles.sph.shear_viscosity import viscosity_at, viscosity_of
from reflowshock.particles.sph_flows.droplet import droplet

INK = {"diameter": 23e-6, "density": 1000.0, "surface_tension": 0.072, "viscosity": 0.0149, "duration": 1e-5}
CARREAU = Rheology(law="carreau", exponent=0.4, shear_rate=1e5, viscosity_at_infinity=1e-3)
LAWS = [CARREAU, *(Rheology(law="power_law", exponent=power, shear_rate=1e5, bound=5.0) for power in (0.5, 1.0, 1.6))]


def ink(rheology, **changes):
    """Return a droplet with a rheology; ``changes`` replace parameters."""
    return Droplet(**INK | changes, rheology=rheology, numerics=DropletNumerics(particles_per_diameter=8))


@pytest.mark.parametrize("rheology", LAWS, ids=lambda item: f"{item.law} {item.exponent}")
def test_particles_have_the_viscosity_of_the_parameters(rheology):
    law = droplet(ink(rheology)).law
    for rate in (0.0, 1.0, 1e3, 7e4, 1e5, 3e6, 1e9):
        assert viscosity_at(rate, law) == pytest.approx(rheology.viscosity(rate, 0.0149), rel=1e-13)


def test_limits_of_the_laws():
    assert CARREAU.viscosity(0.0, 0.02) == 0.02
    assert CARREAU.viscosity(1e15, 0.02) == pytest.approx(1e-3, rel=1e-3)
    thinning, _, thickening = LAWS[1:]
    assert thinning.viscosity(4e5, 0.02) == pytest.approx(0.01)
    assert thinning.viscosity(0.0, 0.02) == pytest.approx(0.1) and thinning.viscosity(1e12, 0.02) == pytest.approx(4e-3)
    assert thickening.viscosity(0.0, 0.02) == pytest.approx(4e-3)
    assert thickening.largest(0.02, 1e12) == pytest.approx(0.1)


def test_particle_shear_rate_equals_the_flow():
    """In a linear flow the gradient is exact everywhere, including the surface."""
    simulation = droplet(ink(CARREAU))
    fields, rows = simulation.fields, simulation.particles.rows
    gradient = np.random.default_rng(2).normal(size=(3, 3)) * 1e5
    fields.u[:], fields.v[:], fields.w[:] = gradient @ np.array(fields[:3])
    strain = 0.5 * (gradient + gradient.T)
    expected = CARREAU.viscosity(float(np.sqrt(2.0 * (strain**2).sum())), 0.0149)
    for i in range(0, simulation.fluids, 17):
        viscosity = viscosity_of(np.uint64(i), simulation.fluids, rows.of(i), fields, simulation.law)
        assert viscosity == pytest.approx(expected, rel=1e-10)
    turning = np.array([[0.0, -1e6, 0.0], [1e6, 0.0, 0.0], [0.0, 0.0, 0.0]])
    fields.u[:], fields.v[:], fields.w[:] = turning @ np.array(fields[:3])
    viscosity = viscosity_of(np.uint64(0), simulation.fluids, rows.of(0), fields, simulation.law)
    assert viscosity == pytest.approx(0.0149, rel=1e-9)  # rigid rotation has no shear


def test_an_exponent_of_one_computes_what_constant_viscosity_does():
    constant = droplet(ink(None, speed=3.0))
    same = droplet(ink(Rheology(law="power_law", exponent=1.0, shear_rate=1.0), speed=3.0))
    for _ in range(20):
        step = constant.time_step()
        assert same.time_step() == step
        constant.step(step)
        same.step(step)
    assert np.allclose(same.rates, constant.rates, rtol=1e-9, atol=1e-9 * np.abs(constant.rates).max())


def test_shear_dependence_acts_where_it_is_given_and_viscosity_acts():
    def told(scene):
        return decide_flow(scene)["shear_dependent_viscosity"]

    assert not told(ink(None))["on"]
    assert told(ink(CARREAU)) == {"on": True, "why": "carreau, exponent 0.4"}
    off = ink(CARREAU, effects={"viscosity": "off"})
    assert not told(off)["on"] and droplet(off).law.rheology == 0
    assert not droplet(ink(None)).fields.viscosity.any()


@pytest.mark.long
def test_a_drop_that_thins_spreads_as_a_less_viscous_one():
    """At rates far above its reference rate a Carreau liquid has its infinite-shear viscosity."""
    thin = Rheology(law="carreau", exponent=0.2, shear_rate=1.0, viscosity_at_infinity=5e-3)
    simulations = [droplet(ink(rheology, speed=3.0, viscosity=mu)) for rheology, mu in ((thin, 0.0149), (None, 5e-3))]
    for simulation in simulations:
        while simulation.time < 3e-6:
            simulation.step(min(simulation.time_step(), 2e-8))
    first, second = (simulation.surface.points[:, 0] for simulation in simulations)
    assert np.ptp(first) == pytest.approx(np.ptp(second), rel=0.02)


def test_printed_ink_has_it_too():
    scene = Printing(
        drop_volume=6.37e-15, surface_tension=0.072, viscosity=0.0149, speed=3.0, delay=1e-3, pitch=23e-6, columns=1,
        rows=1, rheology=CARREAU,
    )  # fmt: skip
    deposit = Deposit(scene)
    deposit.add_drop((0.0, 0.0))
    for _ in range(5):
        deposit.step(1.0)
    assert np.ptp(deposit.simulation.fields.viscosity) > 0.0


def test_the_step_of_a_stiff_drop_is_stable():
    stiff = droplet(ink(None, speed=5.0, viscosity=0.3))
    assert stiff.time_step() < 0.5 * ink(None).density * stiff.law.length**2 / 0.3 * 0.126
    for _ in range(60):
        stiff.step(stiff.time_step())
        assert stiff.fastest < 5.1
