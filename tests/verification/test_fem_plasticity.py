"""The return equation of J2 plasticity against independent solvers."""

import numpy as np
import pytest
from scipy.optimize import brentq

from reflowshock.fem.kernels.plasticity import plastic_increment, yield_stress
from reflowshock.materials.library import FR4
from reflowshock.materials.parameters import Isotropic, JohnsonCook
from reflowshock.materials.plasticity import plastic_constants

RANDOM = np.random.default_rng(11)


def solder(temperature: float = 298.15, **law: float) -> Isotropic:
    """Return plastic solder at a temperature [K]; ``law`` replaces constants of Johnson and Cook."""
    plasticity = JohnsonCook(**({"A": 38e6, "B": 275e6, "n": 0.71, "C": 0.0713, "reference_rate": 1e-3} | law))
    return Isotropic(
        density=7400.0, young_modulus=50e9, poisson_ratio=0.36, plasticity=plasticity, temperature=temperature
    )


def plain_yield_stress(material: Isotropic, strain: float, rate: float) -> float:
    """Return the yield stress as Johnson and Cook write it."""
    law = material.plasticity
    hot = (material.temperature - law.room_temperature) / (law.melting_temperature - law.room_temperature)
    fast = 1.0 + law.C * np.log(max(1.0, rate / law.reference_rate))
    return (law.A + law.B * strain**law.n) * fast * (1.0 - max(0.0, hot) ** law.m)


def exact_increment(trial: float, strain: float, material: Isotropic, step: float) -> float:
    """Solve the return equation by Brent's method in ln x, between round-off and the rate-independent increment."""
    stiffness = 3.0 * material.shear_modulus
    largest = (trial - plain_yield_stress(material, strain, 0.0)) / stiffness

    def excess(log):
        x = np.exp(log)
        return trial - stiffness * x - plain_yield_stress(material, strain + x, x / step)

    low = np.log(largest)
    while excess(low) < 0.0:
        low -= 1.0
    return float(np.exp(brentq(excess, low, np.log(largest) + 1e-9, xtol=1e-14, rtol=1e-15)))


@pytest.mark.parametrize("rate", [1e-8, 1e-4, 1e-3, 1.0, 1e3, 1e8])
@pytest.mark.parametrize("exponent", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("temperature", [298.15, 400.0, 490.1])
def test_return_equation_is_solved(rate, exponent, temperature):
    material = solder(temperature, n=exponent)
    constants = plastic_constants(material)
    for strain in (0.0, 1e-9, 1e-3, 0.5):
        step = 1e-8
        trial = plain_yield_stress(material, strain, rate) + 3.0 * material.shear_modulus * rate * step
        increment = plastic_increment(trial, strain, constants, step)
        assert increment == pytest.approx(exact_increment(trial, strain, material, step), rel=1e-8)
        left = trial - 3.0 * material.shear_modulus * increment
        assert left == pytest.approx(
            plain_yield_stress(material, strain + increment, increment / step), rel=1e-12, abs=1e-14 * trial
        )


def test_any_admissible_constants_give_a_bracketed_solution():
    for _ in range(3000):
        constants = 10.0 ** RANDOM.uniform([9, -2, 3, -1.3, -4, -6], [12, 9, 10, 0, 1, 3])
        constants[[2, 4]] *= RANDOM.integers(0, 2, 2)
        strain = RANDOM.integers(0, 2) * 10.0 ** RANDOM.uniform(-9, 0)
        step = 10.0 ** RANDOM.uniform(-12, 0)
        static = yield_stress(strain, 0.0, constants)
        trial = static * (1.0 + 10.0 ** RANDOM.uniform(-6, 3))
        increment = plastic_increment(trial, strain, constants, step)
        assert 0.0 <= increment <= (trial - static) / constants[0] * (1.0 + 1e-14)
        left = trial - constants[0] * increment
        assert left == pytest.approx(
            yield_stress(strain + increment, increment / step, constants), rel=1e-12, abs=1e-14 * trial
        )


def test_below_yield_nothing_flows():
    constants = plastic_constants(solder())
    assert plastic_increment(37.9e6, 0.0, constants, 1e-8) == 0.0
    assert plastic_increment(float("nan"), 0.0, constants, 1e-8) == 0.0
    for never in (plastic_constants(FR4), plastic_constants(solder().elastic)):
        assert plastic_increment(1e300, 0.0, never, 1e-8) == 0.0
