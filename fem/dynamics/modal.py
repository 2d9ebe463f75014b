"""Natural frequencies and mode shapes, K x = omega^2 M x by shift-and-invert, with SLEPc or else with SciPy."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray
from petsc4py import PETSc

from reflowshock.fem.errors import AgreedError
from reflowshock.fem.model.factorisation import Factorisation, make_direct
from reflowshock.fem.model.global_matrix import Equations

try:
    from slepc4py import SLEPc  # type: ignore[import-untyped]
except ImportError:
    SLEPc = None

# The shift is -SHIFT times the largest omega^2, so that the factored matrix is positive definite even for a free body.
# A smaller shift loses digits to the condition number, a larger one brings the lowest modes too close together.
SHIFT = 1e-10
TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True)
class Modes:
    """The lowest modes of a model.

    Attributes:
        frequency: Natural frequencies in ascending order, shape (k,) [Hz]; about zero for rigid-body modes.
        shape: Mode shapes at the nodes of this rank with x . M x = 1 over all ranks, shape (k, n, 3) [1/sqrt(kg)]; the
            sign is arbitrary.
        effective_mass: Effective modal mass for base excitation along x, y, z, shape (k, 3) [kg].
    """

    frequency: NDArray[np.float64]
    shape: NDArray[np.float64]
    effective_mass: NDArray[np.float64]


def natural_modes(equations: Equations, count: int) -> Modes:
    """Compute the lowest natural modes of a model; collective.

    Args:
        equations: Numbered equations of the model.
        count: Number of modes, less than the number of equations.

    Returns:
        Natural frequencies in ascending order, shape (k,) [Hz]; mode shapes at the nodes of this rank with unit modal
        mass, shape (k, n, 3); effective modal masses for base excitation along x, y, z, shape (k, 3) [kg].

    Raises:
        ValueError: ``count`` is out of range, or there are several ranks and no SLEPc.
        AgreedError: Fewer than ``count`` modes converged; on every rank.
    """
    if not 0 < count < equations.total:
        raise ValueError(f"number of modes = {count}; allowed: 1 to {equations.total - 1}")
    solve = _scipy_modes if SLEPc is None else _slepc_modes
    stiffness, mass = equations.stiffness(), equations.mass()
    shift = -SHIFT * float((stiffness.getDiagonal() / mass).max()[1])
    squared, vectors = solve(stiffness, mass, shift, count)
    order = np.argsort(squared)
    shapes = np.zeros((count, len(equations.body.mass), 3))
    effective = np.zeros((count, 3))
    for shape, moving, index in zip(shapes, effective, order, strict=True):
        vector = vectors[index]
        vector.scale(1.0 / np.sqrt((vector * mass).dot(vector)))
        equations.spread(vector, shape)
        moving[:] = _momentum(equations, shape) ** 2
    frequency = np.sqrt(np.maximum(squared[order], 0.0)) / (2.0 * np.pi)
    return Modes(frequency, shapes, effective)


def _momentum(equations: Equations, shape: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sum over all ranks of mass times mode shape, shape (3,) [sqrt(kg)]."""
    owned = equations.body.shared.owned
    return np.asarray(equations.comm.allreduce(equations.body.mass[owned] @ shape[owned]))


def _slepc_modes(
    stiffness: PETSc.Mat, mass: PETSc.Vec, shift: float, count: int
) -> tuple[NDArray[np.float64], list[PETSc.Vec]]:
    """Return squared circular frequencies [1/s^2] and eigenvectors by SLEPc's Krylov-Schur, on any number of ranks."""
    solver = SLEPc.EPS().create(stiffness.comm)
    solver.setOperators(stiffness, _diagonal_matrix(mass))
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setDimensions(count)
    solver.setTolerances(TOLERANCE)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_REAL)
    solver.setTarget(shift)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    make_direct(transform.getKSP())
    solver.solve()
    if solver.getConverged() < count:
        raise AgreedError(
            f"{solver.getConverged()} of {count} modes converged, SLEPc says {solver.getConvergedReason()}"
        )
    vectors = [stiffness.createVecRight() for _ in range(count)]
    values = [solver.getEigenpair(k, vector).real for k, vector in enumerate(vectors)]
    return np.array(values), vectors


def _diagonal_matrix(diagonal: PETSc.Vec) -> PETSc.Mat:
    """Return a sparse diagonal matrix with the given diagonal."""
    matrix = PETSc.Mat().createAIJ((diagonal.sizes, diagonal.sizes), nnz=(1, 0), comm=diagonal.comm)
    matrix.setDiagonal(diagonal)
    matrix.assemble()
    return matrix


def _scipy_modes(
    stiffness: PETSc.Mat, mass: PETSc.Vec, shift: float, count: int
) -> tuple[NDArray[np.float64], list[PETSc.Vec]]:
    """Return squared circular frequencies [1/s^2] and eigenvectors by SciPy's ARPACK, on one rank."""
    if stiffness.comm.size > 1:
        raise ValueError("modes on several ranks need SLEPc (package python3-slepc4py-real)")
    shifted, right, solution = stiffness.copy(), mass.duplicate(), mass.duplicate()
    shifted.setDiagonal(stiffness.getDiagonal() - shift * mass)
    factor = Factorisation(shifted)

    def solve(values: NDArray[np.float64]) -> NDArray[np.float64]:
        right.array = values
        factor.solve(right, solution)
        return solution.array.copy()

    matrix = scipy.sparse.csr_matrix(stiffness.getValuesCSR()[::-1], shape=stiffness.size)
    diagonal, inverse = scipy.sparse.diags(mass.array), scipy.sparse.linalg.LinearOperator(matrix.shape, solve)
    values, columns = scipy.sparse.linalg.eigsh(matrix, count, diagonal, sigma=shift, OPinv=inverse, tol=TOLERANCE)
    factor.free()
    vectors = [mass.duplicate() for _ in range(count)]
    for vector, column in zip(vectors, columns.T, strict=True):
        vector.array = column
    return values, vectors
