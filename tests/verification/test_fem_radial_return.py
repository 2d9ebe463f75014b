"""Radial return along strain paths: exact for proportional paths, otherwise first order."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from reflowshock.fem.kernels.plasticity import plastic_increment
from reflowshock.materials.parameters import Isotropic, JohnsonCook
from reflowshock.materials.plasticity import plastic_constants

ORDER = (0.93, 1.07)


def solder(**law: float) -> Isotropic:
    """Return plastic solder with constants of Johnson and Cook."""
    return Isotropic(density=7400.0, young_modulus=50e9, poisson_ratio=0.36, plasticity=JohnsonCook(**law))


def mises(deviator: np.ndarray) -> float:
    """Return the Mises stress of a stress deviator, shape (3, 3) [Pa]."""
    return float(np.sqrt(1.5) * np.linalg.norm(deviator))


def returned(material: Isotropic, strains: np.ndarray, step: float) -> tuple[np.ndarray, float]:
    """Return deviator (3, 3) [Pa] and plastic strain after deviatoric total strains (k, 3, 3) that start at zero."""
    constants, shear = plastic_constants(material), material.shear_modulus
    deviator, plastic = np.zeros((3, 3)), 0.0
    for increment in np.diff(strains, axis=0):
        trial = deviator + 2.0 * shear * increment
        grown = plastic_increment(mises(trial), plastic, constants, step)
        deviator = trial * (1.0 - 3.0 * shear * grown / mises(trial))
        plastic += grown
    return deviator, plastic


def flow(material: Isotropic, rate: Callable[[float], np.ndarray], start: np.ndarray, end: float) -> np.ndarray:
    """Integrate the rate equations of Johnson-Cook viscoplasticity: deviator and plastic strain (10,) at the end.

    The flow rule is solved for the rate, reference_rate exp((q / (A + B p^n) - 1) / C), without a return mapping.
    """
    law, shear = material.plasticity, material.shear_modulus

    def slope(time, state):
        deviator, plastic = state[:9].reshape(3, 3), max(state[9], 0.0)
        stress = mises(deviator)
        grown = law.reference_rate * np.exp((stress / (law.A + law.B * plastic**law.n) - 1.0) / law.C)
        direction = 1.5 * deviator / stress
        return np.append((2.0 * shear * (rate(time) - grown * direction)).ravel(), grown)

    solution = solve_ivp(slope, (0.0, end), start, method="Radau", rtol=1e-10, atol=np.append(np.full(9, 1e-3), 1e-14))
    assert solution.success
    return solution.y[:, -1]


SHEAR = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]) / np.sqrt(2.0)
TENSION = np.diag([2.0, -1.0, -1.0]) / np.sqrt(6.0)


@pytest.mark.parametrize("exponent", [0.3, 0.71, 1.0])
@pytest.mark.parametrize("steps", [1, 7])
def test_proportional_path_with_hardening_is_exact_in_any_number_of_steps(exponent, steps):
    material = solder(A=38e6, B=275e6, n=exponent)
    path = np.linspace(0.0, 0.02, steps + 1)[:, None, None] * TENSION
    deviator, plastic = returned(material, path, 1e-3)
    assert mises(deviator) == pytest.approx(38e6 + 275e6 * plastic**exponent, rel=1e-12)
    total = np.sqrt(2.0 / 3.0) * 0.02
    assert mises(deviator) == pytest.approx(3.0 * material.shear_modulus * (total - plastic), rel=1e-10)


@pytest.mark.parametrize("rate", [1.0, 1e2, 1e4])
def test_constant_plastic_rate_with_hardening_equals_the_integrated_rate_equations(rate):
    material = solder(A=38e6, B=275e6, n=0.71, C=0.0713, reference_rate=1e-3)
    law, shear = material.plasticity, material.shear_modulus
    factor = 1.0 + law.C * np.log(rate / law.reference_rate)
    first, last = 1e-3, 0.02

    def strain(plastic):  # path on which the plastic strain grows at a constant rate
        stress = (law.A + law.B * plastic**law.n) * factor
        return np.sqrt(1.5) * (plastic + stress / (3.0 * shear))

    def strain_rate(time):
        plastic = first + rate * time
        return np.sqrt(1.5) * rate * (1.0 + law.B * law.n * plastic ** (law.n - 1.0) * factor / (3.0 * shear)) * SHEAR

    constants, steps = plastic_constants(material), 9
    step, plastic = (last - first) / rate / steps, first
    for target in np.linspace(first, last, steps + 1)[1:]:
        trial = 3.0 * shear * (np.sqrt(2.0 / 3.0) * strain(target) - plastic)
        plastic += plastic_increment(trial, plastic, constants, step)
        assert plastic == pytest.approx(target, rel=1e-10)
    start = np.append(2.0 * shear * (strain(first) - np.sqrt(1.5) * first) * SHEAR, first)
    end = flow(material, strain_rate, start, steps * step)
    assert plastic == pytest.approx(end[9], rel=1e-8)
    stress = (law.A + law.B * plastic**law.n) * factor
    assert stress == pytest.approx(mises(end[:9].reshape(3, 3)), rel=1e-8)


def order(steps: list[int], errors: list[float]) -> float:
    """Return the order of errors in 1 / steps, fitted."""
    return float(np.polyfit(np.log(1.0 / np.array(steps)), np.log(errors), 1)[0])


def test_turning_path_of_perfect_plasticity_converges_to_krieg_and_krieg():
    """The angle psi between deviator and strain rate follows tan(psi / 2) ~ exp(-2 G |e| / R), R the yield radius."""
    material = solder(A=38e6)
    radius, shear = np.sqrt(2.0 / 3.0) * 38e6, material.shear_modulus
    yielding, turned = radius / (2.0 * shear), 1.2 * radius / (2.0 * shear)
    angle = 2.0 * np.arctan(np.tan(np.pi / 4.0) * np.exp(-2.0 * shear * turned / radius))
    exact = radius * (np.cos(angle) * TENSION + np.sin(angle) * SHEAR)
    steps, errors = [20, 40, 80, 160], []
    for count in steps:
        path = yielding * SHEAR + np.linspace(0.0, turned, count + 1)[:, None, None] * TENSION
        deviator, _ = returned(material, np.concatenate([np.zeros((1, 3, 3)), path]), 1e-3)
        errors.append(np.linalg.norm(deviator - exact) / radius)
    assert errors[0] < 0.02
    assert ORDER[0] < order(steps, errors) < ORDER[1]


def test_turning_path_with_rate_and_hardening_is_of_first_order():
    material = solder(A=38e6, B=275e6, n=0.71, C=0.0713, reference_rate=1e-3)
    duration, size = 1e-3, 0.01

    def strain(time):
        turn = np.pi * time / duration
        return size * (np.sin(turn) * TENSION + (1.0 - np.cos(turn)) * SHEAR)

    def strain_rate(time):
        turn = np.pi * time / duration
        return size * np.pi / duration * (np.cos(turn) * TENSION + np.sin(turn) * SHEAR)

    start = np.append((1e3 * TENSION).ravel(), 0.0)  # initial direction; its stress relaxes
    end = flow(material, strain_rate, start, duration)
    steps, errors = [200, 400, 800], []
    for count in steps:
        path = np.array([strain(time) for time in np.linspace(0.0, duration, count + 1)])
        deviator, plastic = returned(material, path, duration / count)
        errors.append(np.linalg.norm(deviator - end[:9].reshape(3, 3)) / np.linalg.norm(end[:9]))
    assert errors[-1] < 5e-3
    assert plastic == pytest.approx(end[9], rel=5e-3)
    assert ORDER[0] < order(steps, errors) < ORDER[1]
