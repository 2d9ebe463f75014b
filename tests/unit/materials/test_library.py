"""The library: each material may be computed with, and the laws of solders follow the data that they cite."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from reflowshock.fem.kernels.plasticity import yield_stress
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import LIBRARY, SAC305, SNPB
from reflowshock.materials.parameters import Isotropic
from reflowshock.materials.plasticity import plastic_constants

RATES = (1e-3, 1e-1, 10.0, 100.0)


@pytest.mark.parametrize("name", LIBRARY)
def test_material_is_stable_and_its_waves_are_those_of_a_solid(name):
    elasticity = elasticity_matrix(LIBRARY[name])
    assert np.linalg.eigvalsh(elasticity)[0] > 0.0
    speeds = np.sqrt(np.diag(elasticity)[:3] / LIBRARY[name].density)
    assert 1800.0 < speeds.min() < 9000.0


def law(material: Isotropic, celsius: float, strain: float, rate: float) -> float:
    """Return the yield stress of a library solder [MPa]."""
    hot = material.model_copy(update={"temperature": celsius + 273.15})
    return 1e-6 * yield_stress(strain, rate, plastic_constants(hot))


@pytest.mark.parametrize(("celsius", "tolerance"), [(25.0, 0.15), (75.0, 0.2), (125.0, 0.25)])
def test_tin_silver_copper_yields_as_pang_and_xiong_measured(celsius, tolerance):
    for rate in RATES:
        measured = (62.0 - 0.22 * celsius) * rate ** (0.0726 + 8.27e-5 * celsius)
        assert law(SAC305, celsius, 0.0, rate) == pytest.approx(measured, rel=tolerance)


def anand(celsius: float, strains: np.ndarray, rate: float) -> np.ndarray:
    """Return stresses [MPa] of 60Sn-40Pb in tension, Anand's model with the constants of Wang et al. (2001)."""
    scaled = rate / 1.49e7 * np.exp(10830.0 / (celsius + 273.15))
    saturated = 80.42 * scaled**0.0231
    resistance = solve_ivp(
        lambda _, s: 2640.75 * (1.0 - s / saturated) ** 1.34, (0.0, strains[-1]), [56.33], t_eval=strains, rtol=1e-8
    ).y[0]
    return np.arcsinh(scaled**0.303) / 11.0 * resistance


@pytest.mark.parametrize("celsius", [25.0, 75.0, 125.0])
def test_tin_lead_yields_as_the_anand_model(celsius):
    strains = np.array([1e-4, 0.02, 0.05, 0.1])
    for rate in RATES:
        fitted = [law(SNPB, celsius, strain, rate) for strain in strains]
        assert fitted == pytest.approx(anand(celsius, strains, rate), rel=0.25)
