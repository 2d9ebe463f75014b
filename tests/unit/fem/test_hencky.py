"""Deformation plasticity of points and elements: NumPy twin, tangents by differences, one step of flow theory."""

import numpy as np
import pytest
from scipy.optimize import brentq

from reflowshock.cases.hard.trials.bodies import force_of, nonlinear
from reflowshock.fem.elements.element import Elements, element_kind, element_stiffness
from reflowshock.fem.elements.stress import symmetric, voigt
from reflowshock.fem.errors import MeshError
from reflowshock.fem.kernels.hencky import PointLaw, hencky, largest_of
from reflowshock.fem.statics.hencky import HenckyElements
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import FR4, SAC405
from reflowshock.materials.parameters import Isotropic, JohnsonCook
from reflowshock.materials.plasticity import plastic_constants

IDEAL = SAC405.model_copy(update={"plasticity": JohnsonCook(A=30e6)})
SHEAR_TWICE = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
STRAIN = np.random.default_rng(3).normal(size=6) * 3e-3


def twin(strain: np.ndarray, material: Isotropic) -> tuple[np.ndarray, float]:
    """Return stress and plastic strain from the secant modulus on the hardening curve."""
    tensor, law = symmetric((strain / SHEAR_TWICE)[None])[0], material.plasticity
    deviator = tensor - np.trace(tensor) / 3.0 * np.eye(3)
    shear = material.shear_modulus
    bulk = material.young_modulus / (3.0 * (1.0 - 2.0 * material.poisson_ratio))
    trial = 3.0 * shear * np.sqrt(2.0 / 3.0) * np.linalg.norm(deviator)
    plastic = 0.0
    if trial > law.A:
        plastic = brentq(lambda p: trial - 3.0 * shear * p - law.A - law.B * p**law.n, 0.0, trial / shear, xtol=1e-18)
    secant = shear * (1.0 - 3.0 * shear * plastic / trial)
    return voigt((bulk * np.trace(tensor) * np.eye(3) + 2.0 * secant * deviator)[None])[0], plastic


def at_point(strain: np.ndarray, material: Isotropic) -> tuple[np.ndarray, np.ndarray, float]:
    """Return stress (6,), tangent (6, 6) and plastic strain at a strain (6,)."""
    stress, tangent = np.empty(6), np.empty((6, 6))
    plastic = hencky(strain, PointLaw(elasticity_matrix(material), plastic_constants(material)), stress, tangent)
    return stress, tangent, plastic


@pytest.mark.parametrize("material", [SAC405, IDEAL])
@pytest.mark.parametrize("size", [0.05, 1.0, 10.0])
def test_point_follows_its_twin(material, size):
    stress, tangent, plastic = at_point(size * STRAIN, material)
    expected, flow = twin(size * STRAIN, material)
    assert plastic == pytest.approx(flow, rel=1e-9, abs=1e-15)
    assert stress == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    assert (flow > 0.0) == (size > 0.5)
    step = 1e-7 * size
    for k in range(6):
        change = step * np.abs(STRAIN).max() * np.eye(6)[k]
        ends = [at_point(size * STRAIN + sign * change, material)[0] for sign in (1.0, -1.0)]
        slope = (ends[0] - ends[1]) / (2.0 * change[k])
        assert tangent[:, k] == pytest.approx(slope, abs=1e-6 * np.abs(tangent).max())


def one_element(material: Isotropic, formulation: str) -> Elements:
    """Return a distorted cube of 0.1 mm."""
    cube = np.array([[(k >> axis) & 1 for axis in range(3)] for k in range(8)], float)
    points = 1e-4 * (cube + np.random.default_rng(7).normal(size=(8, 3)) * 0.08)
    cells, matrix = np.arange(8, dtype=np.int32)[None], elasticity_matrix(material)[None]
    return Elements(points, cells, np.zeros(1, np.int32), matrix, np.ones(1), element_kind(8, formulation))


MOVED = np.random.default_rng(8).normal(size=(8, 3)) * 3e-7


@pytest.mark.parametrize("formulation", ["incompatible_modes", "one_point"])
def test_elastic_elements_are_the_linear_ones(formulation):
    elements = one_element(SAC405, formulation)
    response = HenckyElements.build(elements, [SAC405.elastic], np.zeros((1, 3))).respond(MOVED)
    stiffness = element_stiffness(elements)[0]
    assert response.tangent[0] == pytest.approx(stiffness, abs=1e-9 * np.abs(stiffness).max())
    force = stiffness @ MOVED.ravel()
    assert response.force[0] == pytest.approx(force, abs=1e-9 * np.abs(force).max())


@pytest.mark.parametrize("formulation, tolerance", [("incompatible_modes", 1e-6), ("one_point", 1e-3)])
def test_tangent_of_an_element_that_yields(formulation, tolerance):
    """The tangent is exact except that one-point elements neglect the change of hourglass strength."""
    elements = HenckyElements.build(one_element(SAC405, formulation), [SAC405], np.zeros((1, 3)))
    response = elements.respond(MOVED)
    assert response.points.plastic_strain.min() > 1e-3
    slopes = np.empty((24, 24))
    for k in range(24):
        change = np.zeros((8, 3))
        change.flat[k] = 1e-12
        ends = [elements.respond(MOVED + sign * change).force[0] for sign in (1.0, -1.0)]
        slopes[:, k] = (ends[0] - ends[1]) / 2e-12
    assert response.tangent[0] == pytest.approx(slopes, abs=tolerance * np.abs(slopes).max())


def test_one_step_of_the_flow_theory_from_rest_is_the_same():
    """This includes the limits of hourglass forces."""
    elements = one_element(SAC405, "one_point")
    response = HenckyElements.build(elements, [SAC405], np.zeros((1, 3))).respond(MOVED)
    term = nonlinear(elements, SAC405, finite=False)
    force = force_of(term, MOVED)
    assert response.force[0].reshape(8, 3) == pytest.approx(force, abs=1e-10 * np.abs(force).max())
    assert term.energy(MOVED).hourglass == pytest.approx(response.points.hourglass_energy[0], rel=1e-9)


def test_free_expansion_strains_nothing():
    elements = one_element(SAC405, "incompatible_modes")
    free = np.array([[1e-3, -2e-3, 3e-3]])
    response = HenckyElements.build(elements, [SAC405.elastic], free).respond(elements.points * free)
    assert np.abs(response.points.stress).max() < 1e-9 * SAC405.young_modulus * 1e-3


def test_tetrahedra_are_refused():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    cells = np.arange(4, dtype=np.int32)[None]
    matrix = elasticity_matrix(FR4)[None]
    elements = Elements(points, cells, np.zeros(1, np.int32), matrix, np.ones(1), element_kind(4))
    with pytest.raises(MeshError, match="available for hexahedra, not tetrahedron"):
        HenckyElements.build(elements, [FR4], np.zeros((1, 3)))


@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_residual_that_is_no_number_is_not_small(index):
    values = np.array([1.0, -2.0, 0.5])
    assert largest_of(values) == 2.0
    values[index] = np.nan
    assert np.isnan(largest_of(values))
