"""Corotational hexahedra against the linear element, a NumPy twin and the derivative of an energy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from reflowshock.cases.hard.trials.grids import grid
from reflowshock.fem.elements.element import Elements, element_geometry, element_kind, element_stiffness
from reflowshock.fem.errors import InvertedElementError
from reflowshock.fem.forces.force import force_terms
from reflowshock.fem.forces.force_assembled import AssembledElements
from reflowshock.fem.forces.force_corotational import (
    CorotationalBlocks,
    CorotationalBoxes,
    CorotationalHexahedra,
    corotational_boxes,
)
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.model.stress_recovery import polar
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import COPPER, FR4, SAC405

MATERIALS = np.array([elasticity_matrix(FR4), elasticity_matrix(COPPER)])
TURN = Rotation.from_rotvec([0.7, -1.1, 2.0]).as_matrix()
FORMULATIONS = ("incompatible_modes", "one_point")


def boxes(counts: tuple[int, int, int], formulation: str = "incompatible_modes", share: float = 1.0) -> Elements:
    """Return boxes of different sizes and two materials, with holes."""
    points, cells = grid(*(np.cumsum([0.0, *np.linspace(1, 3, count)]) * 1e-4 for count in counts))
    random = np.random.default_rng(len(cells))
    is_solid = random.uniform(size=len(cells)) < share
    is_solid[0] = True
    material = random.integers(0, 2, is_solid.sum()).astype(np.int32)
    return Elements(points, cells[is_solid], material, MATERIALS, np.ones(is_solid.sum()), element_kind(8, formulation))


@pytest.fixture(params=[CorotationalBoxes, CorotationalBlocks, CorotationalHexahedra], ids=["rows", "blocks", "any"])
def kind(request):
    """Return each kind of term."""
    return request.param


@pytest.fixture
def hexahedra(kind):
    """Return the factory of elements for a kind of term: boxes or distorted hexahedra."""

    def make(counts: tuple[int, int, int], formulation: str = "incompatible_modes", share: float = 1.0) -> Elements:
        elements = boxes(counts, formulation, share)
        shift = 0.15 if kind is CorotationalHexahedra else 0.0
        return replace(elements, points=elements.points + gently(elements, shift, seed=5))

    return make


@pytest.fixture
def term_of(kind):
    """Return the factory of a term for all elements."""
    return lambda elements: kind.build(elements, np.arange(len(elements.cells)))


def force_of(term, displacement: np.ndarray) -> np.ndarray:
    """Return the force of a term at a displacement, shape (n, 3) [N]."""
    force = np.zeros_like(displacement)
    term.add(displacement, force)
    return force


def turned(points: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """Return a displacement followed by a rotation."""
    return (points + displacement) @ TURN.T - points


def local_energy(elements: Elements, displacement: np.ndarray) -> float:
    """Return the sum of d . K d / 2, with d in the mean-rotation frame of each element."""
    total = 0.0
    gradients = element_geometry(elements.points, elements.cells).gradient
    for nodes, gradient, stiffness in zip(elements.cells, gradients, element_stiffness(elements), strict=True):
        start, moved = elements.points[nodes], (elements.points + displacement)[nodes]
        start, moved = start - start.mean(axis=0), moved - moved.mean(axis=0)
        rotation, _ = polar((moved.T @ gradient)[None])
        local = (moved @ rotation[0] - start).ravel()
        total += 0.5 * local @ stiffness @ local
    return total


def gently(elements: Elements, size: float, seed: int = 0) -> np.ndarray:
    """Return small random displacements of the nodes of elements, shape (n, 3) [m]."""
    return size * 1e-4 * np.random.default_rng(seed).uniform(-1, 1, elements.points.shape)


@pytest.mark.parametrize("counts", [(1, 1, 1), (9, 2, 3), (2, 17, 3), (3, 2, 33), (16, 1, 1)])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_energy_and_its_derivative(hexahedra, term_of, counts, formulation):
    elements = hexahedra(counts, formulation, share=0.8)
    term, displacement = term_of(elements), turned(elements.points, gently(elements, 0.02))
    energy = term.energy(displacement)
    exact = local_energy(elements, displacement)
    assert energy.total == pytest.approx(exact, rel=1e-10)
    assert (energy.hourglass > 0.0) == (formulation == "one_point")
    force, step = force_of(term, displacement), 1e-10
    for seed in range(3):
        along = np.random.default_rng(10 + seed).uniform(-1, 1, displacement.shape)
        ahead, behind = (local_energy(elements, displacement + side * step * along) for side in (1, -1))
        change = ahead - behind
        assert change / (2 * step) == pytest.approx(-np.vdot(force, along), rel=1e-5)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_small_motions_are_linear_and_large_turns_are_free(hexahedra, term_of, formulation):
    elements = hexahedra((7, 3, 2), formulation)
    term, linear, displacement = term_of(elements), AssembledElements.build(elements), gently(elements, 1e-7)
    exact = force_of(linear, displacement)
    assert np.abs(force_of(term, displacement) - exact).max() < 1e-6 * np.abs(exact).max()
    scale = np.abs(force_of(linear, gently(elements, 1.0))).max()
    assert np.abs(force_of(term, turned(elements.points, 0.0 * displacement))).max() < 1e-12 * scale


def test_a_turned_body_has_turned_forces_without_net_force_or_moment(hexahedra, term_of):
    elements = hexahedra((5, 4, 3))
    term, displacement = term_of(elements), gently(elements, 0.05)
    force, other = force_of(term, displacement), force_of(term, turned(elements.points, displacement))
    scale = np.abs(force).max()
    assert np.abs(other - force @ TURN.T).max() < 1e-10 * scale
    arms = np.cross(elements.points + turned(elements.points, displacement), other)
    assert np.abs(other.sum(axis=0)).max() < 1e-12 * scale
    assert np.abs(arms.sum(axis=0)).max() < 1e-12 * np.abs(arms).max()


def test_error_against_finite_strain_falls_with_the_square_of_the_strain(hexahedra, term_of):
    elements = hexahedra((4, 3, 2), "one_point")
    errors = []
    for size in (1e-2, 2.5e-3):
        displacement = turned(elements.points, gently(elements, size))
        (path,) = force_terms(elements, [FR4, COPPER], "finite")
        assert isinstance(path, NonlinearElements)
        for share in np.linspace(0.1, 1.0, 10):
            finite = force_of(path, turned(elements.points, share * gently(elements, size)))
        errors.append(np.abs(finite - force_of(term_of(elements), displacement)).max())
    assert np.log(errors[0] / errors[1]) / np.log(4.0) > 1.8


def test_what_is_inside_out_is_told(hexahedra, term_of):
    elements = hexahedra((3, 2, 2))
    displacement = np.zeros_like(elements.points)
    displacement[:, 0] = -2.0 * elements.points[:, 0]
    with pytest.raises(InvertedElementError, match="turned inside out"):
        force_of(term_of(elements), displacement)


def test_rows_are_for_meshes_that_have_long_ones():
    side = np.linspace(0.0, 1e-3, 9)
    points, cells = grid(side, side, np.linspace(0.0, 1e-4, 3))
    even = Elements(points, cells, np.zeros(len(cells), np.int32), MATERIALS, np.ones(len(cells)), element_kind(8))
    graded = replace(even, points=points + 0.5 * points**2 / 1e-3)
    for elements, kind in ((even, CorotationalBoxes), (graded, CorotationalBlocks)):
        assert isinstance(corotational_boxes(elements, np.arange(len(cells))), kind)


def test_only_elastic_hexahedra_turn_without_a_path():
    elements = boxes((4, 3, 2), "one_point")
    materials = [FR4, SAC405]
    terms = force_terms(elements, materials, "corotational")
    assert [type(term) for term in terms] == [CorotationalBlocks, NonlinearElements]
    numbers = np.concatenate([term.numbers for term in terms])
    np.testing.assert_array_equal(np.sort(numbers), np.arange(len(elements.cells)))
    assert not np.isin(elements.material[terms[0].numbers], 1).any()
    distorted = elements.points + gently(elements, 0.1)
    (other,) = force_terms(replace(elements, points=distorted), [FR4, COPPER], "corotational")
    assert isinstance(other, CorotationalHexahedra)
