"""Residual stress after cooling against exact solutions: free bodies, bimaterial strips, plastic layers."""

import numpy as np
import pytest
from scipy.optimize import brentq

from reflowshock.fem.elements.element import Elements, element_kind
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.kernels.nonlinear import Path
from reflowshock.fem.statics.hencky import HenckyElements
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import FR4
from reflowshock.materials.parameters import Isotropic, JohnsonCook
from reflowshock.materials.plasticity import plastic_constants
from tests.support.fem_residual import cooled, layered

CHANGE = -192.0


def metal(young: float, expansion: float, poisson: float = 0.0, plasticity: JohnsonCook | None = None) -> Isotropic:
    """Return a metal from Young's modulus [Pa], expansion [1/K], Poisson's ratio and plasticity."""
    return Isotropic(
        density=8000.0, young_modulus=young, poisson_ratio=poisson, thermal_expansion=expansion, plasticity=plasticity
    )


LAW = JohnsonCook(A=38e6, B=275e6, n=0.71)
SOLDER = metal(44.6e9, 22e-6, 0.4, LAW)


def test_free_body_is_stress_free():
    mesh = layered(np.linspace(0, 2e-3, 4), np.linspace(0, 1e-3, 3), {"board": np.full(3, 2e-4)}, distorted=0.2)
    result = cooled(mesh, {"board": FR4}, CHANGE)
    assert np.abs(result.stress).max() < 1e-9 * 28e9 * 16e-6 * 192.0
    contraction = CHANGE * np.array(FR4.expansion) * result.plain.local.points
    difference = result.equilibrium.displacement - contraction
    assert np.ptp(difference, axis=0).max() < 1e-9 * np.abs(contraction).max()


def test_bimaterial_strip():
    """Axial stress of each layer and curvature are exact (Timoshenko, J. Opt. Soc. Am. 11, 1925)."""
    low, high, thin, thick = metal(28e9, 16e-6), metal(132e9, 2.1e-6), 0.3e-3, 0.6e-3
    length = 12e-3
    mesh = layered(
        np.linspace(0, length, 41),
        np.array([0.0, 0.3e-3]),
        {"board": np.full(3, thin / 3), "die": np.full(3, thick / 3)},
    )
    result = cooled(mesh, {"board": low, "die": high}, CHANGE)
    ratio, stiffness = thin / thick, low.young_modulus / high.young_modulus
    mismatch = (high.thermal_expansion - low.thermal_expansion) * CHANGE  # of the upper layer over the lower one
    bracket = 3.0 * (1.0 + ratio) ** 2 + (1.0 + ratio * stiffness) * (ratio**2 + 1.0 / (ratio * stiffness))
    curvature = 6.0 * mismatch * (1.0 + ratio) ** 2 / ((thin + thick) * bracket)
    body, height = result.plain, thin + thick
    points = body.local.points
    middle = np.flatnonzero((np.abs(points[:, 0] - 1.5e-3) < 1e-9) & (points[:, 1] == 0.0) & (points[:, 2] == 0.0))[0]
    root = np.flatnonzero((points == 0.0).all(axis=1))[0]
    sag = result.equilibrium.displacement[middle, 2] - result.equilibrium.displacement[root, 2]
    assert sag == pytest.approx(-0.5 * curvature * 1.5e-3**2, rel=2e-4)
    # Equilibrium of the composite section, E (strain + curvature z - free expansion).
    centres = points[body.elements.cells].mean(axis=1)
    lower = centres[:, 2] < thin
    young = np.where(lower, low.young_modulus, high.young_modulus)
    free = CHANGE * np.where(lower, low.thermal_expansion, high.thermal_expansion)
    modulus = low.young_modulus * thin, high.young_modulus * thick
    ends = (0.0, thin), (thin, height)
    first = [e * (b + a) / 2 for e, (a, b) in zip(modulus, ends, strict=True)]
    second = [e * (a * a + a * b + b * b) / 3 for e, (a, b) in zip(modulus, ends, strict=True)]
    expansions = CHANGE * np.array([low.thermal_expansion, high.thermal_expansion])
    system = np.array([[sum(modulus), sum(first)], [sum(first), sum(second)]])
    strain, bending = np.linalg.solve(system, [modulus @ expansions, first @ expansions])
    assert bending == pytest.approx(curvature, rel=1e-12)
    expected = young * (strain + bending * centres[:, 2] - free)
    inner = centres[:, 0] < 0.5 * length
    assert np.abs(result.stress[inner, 0] - expected[inner]).max() < 1e-3 * np.abs(expected).max()


@pytest.mark.parametrize("formulation", ["incompatible_modes", "one_point"])
def test_layer_between_stiff_blocks_yields_as_in_one_dimension(formulation):
    """Equal strains e along x and y with zero stress along z: e = (1 - nu) s / E + p / 2, s = A + B p^n."""
    stiff = metal(1e17, 2.1e-6)
    mesh = layered(np.array([0.0, 1e-3]), np.array([0.0, 1e-3]), {"board": [1e-4], "solder": [1e-4], "die": [1e-4]})
    result = cooled(mesh, {"board": stiff, "solder": SOLDER, "die": stiff}, CHANGE, formulation)
    strain = CHANGE * (stiff.thermal_expansion - SOLDER.thermal_expansion)

    def excess(plastic: float) -> float:
        stress = LAW.A + LAW.B * plastic**LAW.n
        return (1.0 - SOLDER.poisson_ratio) * stress / SOLDER.young_modulus + 0.5 * plastic - strain

    plastic = brentq(excess, 0.0, 1.0, xtol=1e-15)
    stress = LAW.A + LAW.B * plastic**LAW.n
    layer_stress = result.stress[1]
    assert plastic > 1e-3
    assert layer_stress == pytest.approx([stress, stress, 0.0, 0.0, 0.0, 0.0], abs=1e-6 * stress)
    assert len(result.equilibrium.residuals) <= 10
    assert result.equilibrium.residuals[-1] <= 1e-10


@pytest.mark.parametrize("formulation", ["incompatible_modes", "one_point"])
def test_shear_beyond_yield_equals_flow_theory(formulation):
    """In simple shear g = t / G + sqrt(3) p and sqrt(3) t = A + B p^n; small steps end in the same state."""
    side, shear = 1e-4, 8e-3
    points = side * np.array([[(k >> axis) & 1 for axis in range(3)] for k in range(8)], float)
    cells, matrix = np.arange(8, dtype=np.int32)[None], elasticity_matrix(SOLDER)[None]
    elements = Elements(points, cells, np.zeros(1, np.int32), matrix, np.ones(1), element_kind(8, formulation))
    displacement = np.zeros((8, 3))
    displacement[:, 0] = shear * points[:, 2]
    response = HenckyElements.build(elements, [SOLDER], np.zeros((1, 3))).respond(displacement)
    modulus = SOLDER.shear_modulus

    def excess(plastic: float) -> float:
        return (LAW.A + LAW.B * plastic**LAW.n) / np.sqrt(3.0) / modulus + np.sqrt(3.0) * plastic - shear

    plastic = brentq(excess, 0.0, 1.0, xtol=1e-16)
    assert response.points.plastic_strain == pytest.approx(plastic, rel=1e-9)
    assert response.points.stress[..., 5] == pytest.approx((LAW.A + LAW.B * plastic**LAW.n) / np.sqrt(3.0), rel=1e-9)
    path = NonlinearElements.build(elements, np.arange(1), np.array([plastic_constants(SOLDER)]), Path(False, np.inf))
    for part in np.linspace(0.05, 1.0, 20):
        force = np.zeros((8, 3))
        path.add(part * displacement, force)
    assert -force == pytest.approx(response.force[0].reshape(8, 3), abs=1e-9 * np.abs(force).max())
