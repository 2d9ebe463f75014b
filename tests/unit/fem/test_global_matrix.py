import numpy as np
import pytest
from mpi4py import MPI
from petsc4py import PETSc

from reflowshock.cases.hard.trials.bodies import dns_body
from reflowshock.fem.errors import AgreedError
from reflowshock.fem.mesh.mesh import append
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.factorisation import Factorisation
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.materials.roles import ELASTIC
from tests.support.fem_bodies import STEEL, dense_stiffness
from tests.support.fem_models import bar, small_assembly


@pytest.fixture(scope="module")
def tied() -> Body:
    """Return the small package as one body with ties."""
    return dns_body(append(small_assembly(1, size=1e-3)), materials=ELASTIC)[0]


def random_field(body: Body, seed: int) -> np.ndarray:
    """Return random displacements that supports and ties admit, shape (n, 3)."""
    field = np.zeros_like(body.local.points)
    field[body.free] = np.random.default_rng(seed).normal(size=body.free.sum())
    body.tie.spread(field)
    return field


def test_stiffness_of_a_tied_package_is_that_of_its_force_terms(tied):
    equations = Equations.of(MPI.COMM_SELF, tied)
    assert equations.total == tied.free.sum() == 3 * len(tied.mass) - (~tied.free).sum()
    displacement, force = random_field(tied, 0), np.zeros_like(tied.local.points)
    for term in tied.terms:
        term.add(displacement, force)
    tied.tie.gather(force)
    source = equations.vector(displacement)
    result = source.duplicate()
    equations.stiffness().mult(source, result)
    assert result.array == pytest.approx(-force[tied.free], abs=1e-12 * np.abs(force).max())


def test_stiffness_against_columns_of_the_force_terms():
    body, _ = dns_body(bar(0.1, 3, 0.01), STEEL)
    matrix = Equations.of(MPI.COMM_SELF, body).stiffness()
    dense = matrix.convert("dense").getDenseArray()
    exact = dense_stiffness(body)
    assert dense == pytest.approx(exact, abs=1e-12 * np.abs(exact).max())
    assert dense == pytest.approx(dense.T, abs=0.0)


def test_field_and_vector_are_inverse_on_tied_fields(tied):
    equations = Equations.of(MPI.COMM_SELF, tied)
    field, back = random_field(tied, 1), np.empty_like(tied.local.points)
    equations.spread(equations.vector(field), back)
    assert np.array_equal(field, back)


def test_mass_is_the_lumped_mass(tied):
    equations = Equations.of(MPI.COMM_SELF, tied)
    assert np.array_equal(equations.mass().array, np.repeat(tied.mass, 3)[tied.free.ravel()])


def test_supports_that_hold_everything():
    body, _ = dns_body(bar(0.1, 3, 0.01), STEEL)
    body.free[:] = False
    with pytest.raises(ValueError, match="the supports fix every node"):
        Equations.of(MPI.COMM_SELF, body)


def test_factor_solves_and_tells_its_cost(tied):
    equations = Equations.of(MPI.COMM_SELF, tied)
    matrix = equations.stiffness()
    expected = equations.vector(random_field(tied, 2))
    right, solution = expected.duplicate(), expected.duplicate()
    matrix.mult(expected, right)
    factor = Factorisation(matrix)
    factor.solve(right, solution)
    assert solution.array == pytest.approx(expected.array, abs=1e-6)
    assert factor.cost.entries > equations.total
    assert factor.cost.operations > factor.cost.entries
    factor.free()


@pytest.mark.parametrize(("pivot", "message"), [(-1.0, "1 pivots are negative"), (0.0, r"INFOG\(1\) = -10")])
def test_matrix_that_is_not_positive_definite(pivot, message):
    matrix = PETSc.Mat().createAIJ((3, 3), csr=([0, 1, 2, 3], [0, 1, 2], [1.0, pivot, 1.0]), comm=MPI.COMM_SELF)
    with pytest.raises(AgreedError, match=message):
        Factorisation(matrix)
