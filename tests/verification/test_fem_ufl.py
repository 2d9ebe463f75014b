"""Material laws in UFL against built-in elements on the same mesh: forces, energy and relaxation."""

import numpy as np
import pytest
import ufl
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import dns_elements, force_of, motion_of, nonlinear
from reflowshock.cases.hard.trials.boxes import KINDS, box, elements_of, stiffness_matrix
from reflowshock.cases.hard.trials.grids import mesh_of
from reflowshock.cases.hard.trials.motion import random_start
from reflowshock.cases.own_material import own_material
from reflowshock.fem.elements.element import Elements, element_stiffness
from reflowshock.fem.forces.force_ufl import Law, UflElements, tangent_at_rest
from reflowshock.fem.model.assembly import ForceOptions, make_body
from reflowshock.fem.model.body import Body
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import FR4
from reflowshock.materials.parameters import Isotropic

TETRAHEDRA = ["tetrahedron", "tetrahedron_quadratic"]
RUBBER = Isotropic(density=1000.0, young_modulus=3e6, poisson_ratio=0.3)
SHEAR = RUBBER.shear_modulus
LAME = RUBBER.young_modulus * 0.3 / (1.3 * 0.4)
IDENTITY = ufl.Identity(3)


def distorted(name: str, material, seed: int = 0, cells: int = 2) -> Elements:
    """Return the elements of a small distorted cube, of a named kind and a material."""
    random, line = np.random.default_rng(seed), np.linspace(0, 1e-3, cells + 1)
    points, cells = box(
        KINDS[name], line, line, line, move=lambda points: points + random.uniform(-3e-5, 3e-5, points.shape)
    )
    return elements_of(KINDS[name], points, cells, [material])


def term_of(elements: Elements, law: Law) -> UflElements:
    """Return the force term of all elements with a law in UFL."""
    return UflElements(elements, np.arange(len(elements.cells)), law)


def linear(matrix: np.ndarray) -> Law:
    """Return the law of linear elasticity with a stiffness matrix, shape (6, 6) [Pa]."""
    constants = ufl.as_matrix(matrix.tolist())

    def energy(gradient, _):
        e = ufl.sym(gradient)
        strain = ufl.as_vector([e[0, 0], e[1, 1], e[2, 2], 2 * e[0, 1], 2 * e[1, 2], 2 * e[0, 2]])
        return 0.5 * ufl.inner(constants * strain, strain)

    return Law(energy)


def neo_hookean() -> Law:
    """Return the law of a compressible neo-Hookean material."""

    def energy(gradient, _):
        deformation = IDENTITY + gradient
        log_volume = ufl.ln(ufl.det(deformation))
        stretch = ufl.tr(deformation.T * deformation)
        return 0.5 * SHEAR * (stretch - 3.0 - 2.0 * log_volume) + 0.5 * LAME * log_volume**2

    return Law(energy)


def first_step() -> Law:
    """Return the UFL law of the first finite-kinematics step from rest.

    s = C : 2 (U - 1) (U + 1)^-1 in the turned frame, P = R s U^-1; U, the root of F^T F, by Newton's method.
    """

    def stretched(gradient):
        deformation = IDENTITY + gradient
        right = deformation.T * deformation
        stretch = 0.5 * (IDENTITY + right)
        for _ in range(5):
            stretch = 0.5 * (stretch + right * ufl.inv(stretch))
        strain = 2.0 * ufl.sym((stretch - IDENTITY) * ufl.inv(stretch + IDENTITY))
        return deformation, stretch, strain, LAME * ufl.tr(strain) * IDENTITY + 2.0 * SHEAR * strain

    def energy(gradient, _):
        *_, strain, kirchhoff = stretched(gradient)
        return 0.5 * ufl.inner(strain, kirchhoff)

    def stress(gradient, _):
        deformation, stretch, _, kirchhoff = stretched(gradient)
        inverse = ufl.inv(stretch)
        return deformation * inverse * kirchhoff * inverse

    return Law(energy, stress)


@pytest.mark.parametrize("name", TETRAHEDRA)
def test_small_strain_equals_built_in_elements(name):
    elements = distorted(name, FR4)
    displacement = np.random.default_rng(1).uniform(-1e-6, 1e-6, elements.points.shape)
    law = linear(elasticity_matrix(FR4))
    term = term_of(elements, law)
    ours = (stiffness_matrix(elements) @ displacement.ravel()).reshape(-1, 3)
    assert force_of(term, displacement) == pytest.approx(ours, abs=1e-10 * np.abs(ours).max())
    assert term.energy(displacement).strain == pytest.approx(0.5 * np.vdot(ours, displacement), rel=1e-10)
    stiffness = element_stiffness(elements)
    assert tangent_at_rest(elements, law) == pytest.approx(stiffness, abs=1e-10 * stiffness.max())


@pytest.mark.parametrize("name", ["incompatible_modes", "one_point"])
def test_hexahedra_agree_where_strain_is_uniform(name):
    """Their incompatible modes do not contribute in a patch test."""
    elements = distorted(name, FR4)
    displacement = elements.points @ np.random.default_rng(1).uniform(-1e-3, 1e-3, (3, 3))
    ours = (stiffness_matrix(elements) @ displacement.ravel()).reshape(-1, 3)
    theirs = force_of(term_of(elements, linear(elasticity_matrix(FR4))), displacement)
    assert theirs == pytest.approx(ours, abs=1e-10 * np.abs(ours).max())


@pytest.mark.parametrize("name", TETRAHEDRA)
def test_finite_strain_equals_built_in_elements(name):
    """Strains are about 10 %, with a rotation of 2 rad about a skew axis."""
    elements = distorted(name, RUBBER)
    random = np.random.default_rng(2)
    moved = elements.points + random.uniform(-3e-5, 3e-5, elements.points.shape)
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn = np.eye(3) + np.sin(2.0) * cross + (1.0 - np.cos(2.0)) * cross @ cross
    displacement = moved @ turn.T - elements.points
    numpy_term = nonlinear(elements, RUBBER, finite=True)
    ours = force_of(numpy_term, displacement)
    term = term_of(elements, first_step())
    assert force_of(term, displacement) == pytest.approx(ours, abs=1e-10 * np.abs(ours).max())
    assert term.energy(displacement).strain == pytest.approx(numpy_term.energy(displacement).strain, rel=1e-10)


def energy_errors(law: Law, fraction: float) -> tuple[float, float]:
    """Return the relative energy imbalance in free vibration and the fraction dissipated."""
    elements = distorted("tetrahedron", RUBBER)
    body, critical = body_of(elements, law)
    motion = motion_of(body, fraction * critical)
    random_start(motion, 3)
    total = []
    for _ in range(int(100 / fraction)):
        motion.advance()
        motion.update_force()
        total.append(motion.kinetic_energy() + motion.internal_energy().total)
    return float(np.ptp(total)) / total[0], motion.internal_energy().plastic / total[0]


def body_of(elements: Elements, law: Law, part: str = "board") -> tuple[Body, float]:
    """Return a body with a material law and its smallest critical step [s]."""
    rank_elements, tables = dns_elements(mesh_of(elements.points, elements.cells, "board", {}), {"board": RUBBER})
    rank_elements = rank_elements.with_laws(tables.part_names, {part: law})
    step = float(rank_elements.steps.min())
    return make_body(
        MPI.COMM_SELF, rank_elements, tables, np.ones(len(rank_elements.steps)), ForceOptions("small", step)
    ), step


def test_free_vibration_keeps_its_energy():
    """Central differences conserve it to second order in the step."""
    errors = [energy_errors(neo_hookean(), fraction)[0] for fraction in (0.4, 0.2)]
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.4)


@pytest.mark.long
def test_free_vibration_loses_the_viscous_dissipation():
    balance, taken = energy_errors(own_material.potting(1e-7), 0.2)
    assert balance < 1e-10
    assert 0.0 < taken < 1.0


def test_sudden_shear_relaxes_exponentially():
    """After a sudden small strain the viscous stress decays as exp(-t / tau) from g times the slow stress."""
    step, rate = 0.05 * own_material.RELAXATION, 1e-6
    elements = distorted("tetrahedron", RUBBER)
    term = term_of(elements, own_material.potting(step))
    displacement = rate * elements.points[:, [1, 0, 2]] * [1.0, 1.0, 0.0]
    forces = [np.abs(force_of(term, displacement)).max() for _ in range(40)]
    slow = np.abs(force_of(term_of(elements, own_material.potting(step, stiffer=0.0)), displacement)).max()
    time = (np.arange(40) + 0.5) * step  # the strain is applied in the middle of the first step
    exact = 1.0 + own_material.STIFFER * np.exp(-time / own_material.RELAXATION)
    assert np.array(forces) / slow == pytest.approx(exact, rel=1e-5)


def test_history_continues_bitwise():
    elements = distorted("incompatible_modes", RUBBER)
    law, cells = own_material.potting(1e-5), np.arange(100, 108)
    path = np.random.default_rng(4).uniform(-3e-5, 3e-5, (3, *elements.points.shape))
    term, again = term_of(elements, law), term_of(elements, law)
    for displacement in path[:2]:
        force_of(term, displacement)
    again.restore({name: rows.value for name, rows in term.state(cells).items()})
    assert np.array_equal(force_of(term, path[2]), force_of(again, path[2]))
    assert term.energy(path[2]) == again.energy(path[2])


def test_unknown_part_is_named():
    with pytest.raises(ValueError, match=r"part 'solder' does not exist; parts: board"):
        body_of(distorted("tetrahedron", RUBBER), neo_hookean(), "solder")
