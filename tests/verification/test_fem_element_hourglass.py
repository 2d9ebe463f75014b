"""Hourglass energy of one-point hexahedra: the energy balance equals the energy of the hourglass stiffness."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.grids import grid
from reflowshock.fem.elements.element import Elements, element_kind
from reflowshock.fem.elements.one_point import ONE_POINT, hourglass_control
from reflowshock.fem.forces.force import force_terms
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import FR4

RANDOM = np.random.default_rng(5)


def cube(distortion: float, formulation: str) -> Elements:
    """Return the elements of a unit cube whose inner nodes are moved by a distortion."""
    points, cells = grid(*[np.linspace(0, 1, 4)] * 3)
    points[np.all((points > 0) & (points < 1), axis=1)] += distortion
    count = len(cells)
    elasticity = elasticity_matrix(FR4)[None]
    return Elements(points, cells, np.zeros(count, np.int32), elasticity, np.ones(count), element_kind(8, formulation))


def energy_of(elements: Elements, displacement: np.ndarray):
    """Return the energy of elements at a displacement (n, 3), summed over force terms."""
    energies = []
    for term in force_terms(elements, (FR4,)):
        term.add(displacement, np.zeros_like(displacement))
        energies.append(term.energy(displacement))
    return sum(energies[1:], energies[0])


@pytest.mark.parametrize("distortion", [0.0, 0.05], ids=["congruent", "assembled"])
def test_hourglass_energy_equals_the_hourglass_stiffness_energy(distortion):
    elements = cube(distortion, "one_point")
    displacement = RANDOM.uniform(-1e-3, 1e-3, elements.points.shape)
    gamma, resistance = hourglass_control(elements.points[elements.cells], elements.elasticity, elements.material)
    amplitude = np.einsum("eak,eai->eki", gamma, displacement[elements.cells]).reshape(-1, 12)
    exact = 0.5 * np.einsum("em,emn,en->", amplitude, resistance, amplitude)
    energy = energy_of(elements, displacement)
    assert energy.hourglass == pytest.approx(exact, rel=1e-10)
    assert energy.total == pytest.approx(
        energy_of(cube(distortion, "incompatible_modes"), displacement).strain, rel=1e-12
    )


@pytest.mark.parametrize("distortion", [0.0, 0.05], ids=["congruent", "assembled"])
def test_affine_fields_have_no_hourglass_energy(distortion):
    elements = cube(distortion, "one_point")
    energy = energy_of(elements, elements.points @ RANDOM.uniform(-1e-3, 1e-3, (3, 3)))
    assert abs(energy.hourglass) < 1e-12 * energy.strain


def test_full_integration_has_no_hourglass_energy():
    assert not element_kind(8).hourglass and ONE_POINT.hourglass
    elements = cube(0.0, "incompatible_modes")
    assert energy_of(elements, RANDOM.uniform(-1, 1, elements.points.shape)).hourglass == 0.0
