"""Saddle-point problem of an implicit step: velocity and pressure of an incompressible liquid.

    A v - C^T p = f,     C v + S p = g

A is the mass over the time step plus implicit viscosity and surface tension, symmetric and positive definite. The rows
of C are gradients of volumes that sum to the gradient a of the enclosed volume: the dual volumes of the particles, or
the volume of the whole body alone. The unknowns p are pressures; at rest they equal the capillary pressure, and
f = -p a makes the discrete energy stationary.
"""

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc
from scipy import sparse

from reflowshock.arrays import Floats

RELATIVE_TOLERANCE = 1e-9
RESIDUAL_LIMIT = 1e-6
MAX_ITERATIONS = 200


class SolveFailed(RuntimeError):
    """Error of a linear solve that did not reach its tolerance."""


@dataclass(frozen=True, slots=True)
class SaddlePoint:
    """Saddle-point problem without fixed degrees of freedom.

    Attributes:
        operator: Matrix A, shape (d, d) [kg/s].
        constraint: Volume gradients C, shape (m, d) [m^2].
        load: Load f, shape (d,) [N].
        rate: Required rates of volume g, shape (m,) [m^3/s].
        stabilisation: S, symmetric positive semidefinite, shape (m, m) [m^3/(Pa s)]; None if C needs none.
        guess: Initial guess of the pressure, shape (m,) [Pa]; None for zero.
    """

    operator: sparse.csr_matrix
    constraint: sparse.csr_matrix
    load: Floats
    rate: Floats
    stabilisation: sparse.csr_matrix | None = None
    guess: Floats | None = None


@dataclass(frozen=True, slots=True)
class Solution:
    """Solution of a saddle-point problem.

    Attributes:
        velocity: Velocity of the degrees of freedom, shape (d,) [m/s].
        pressure: Pressures, shape (m,) [Pa].
        iterations: Number of conjugate gradient iterations on the pressure.
    """

    velocity: Floats
    pressure: Floats
    iterations: int


def to_petsc(matrix: sparse.csr_matrix) -> PETSc.Mat:
    """Copy a sparse matrix, of any shape, to PETSc on this process (sequential AIJ)."""
    matrix.sort_indices()
    # petsc4py delays the destruction of objects that went out of scope; without this each step would leak its factors.
    PETSc.garbage_cleanup(PETSc.COMM_SELF)
    parts = (matrix.indptr.astype(PETSc.IntType), matrix.indices.astype(PETSc.IntType), matrix.data)
    return PETSc.Mat().createAIJ(matrix.shape, csr=parts, comm=PETSc.COMM_SELF)


def to_petsc_spd(matrix: sparse.csr_matrix) -> PETSc.Mat:
    """Copy a symmetric positive definite sparse matrix to PETSc, on this process, and declare these properties."""
    result = to_petsc(matrix)
    result.setOption(PETSc.Mat.Option.SPD, True)
    return result


def factor_cholesky(matrix: sparse.csr_matrix) -> PETSc.KSP:
    """Factor a symmetric positive definite matrix by MUMPS and return a solver with its Cholesky factors.

    The solver applies the factors only: ``solve(right, result)`` takes PETSc vectors and overwrites the second one.
    """
    solver = PETSc.KSP().create(PETSc.COMM_SELF)
    solver.setOperators(to_petsc_spd(matrix))
    solver.setType(PETSc.KSP.Type.PREONLY)
    solver.getPC().setType(PETSc.PC.Type.CHOLESKY)
    solver.getPC().setFactorSolverType("mumps")
    solver.setUp()
    return solver


class _FactoredInverse:
    """Inverse A^-1 on NumPy vectors; only the coupled rows of A are factored."""

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        matrix.eliminate_zeros()
        self._coupled = np.flatnonzero(np.diff(matrix.indptr) > 1)
        self._diagonal = matrix.diagonal()
        self._solver = None
        if len(self._coupled) > 0:
            self._solver = factor_cholesky(matrix[self._coupled][:, self._coupled])
            self._solution, self._right = self._solver.getOperators()[0].createVecs()

    def __call__(self, right: Floats) -> Floats:
        """Return A^-1 x."""
        result = right / self._diagonal
        if self._solver is not None:
            self._right.setArray(right[self._coupled])
            self._solver.solve(self._right, self._solution)
            result[self._coupled] = self._solution.getArray()
        return result


class _Schur:
    """PETSc shell matrix of C A^-1 C^T + S."""

    def __init__(self, problem: SaddlePoint, inverse: _FactoredInverse) -> None:
        self._problem, self._transposed, self._inverse = problem, problem.constraint.T.tocsr(), inverse

    def mult(self, _matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        pressure = x.getArray(readonly=True)
        flux = self._problem.constraint @ self._inverse(self._transposed @ pressure)
        y.setArray(flux + _leak(self._problem, pressure))


def _leak(problem: SaddlePoint, pressure: Floats) -> Floats | float:
    """Return S p, shape (m,) [m^3/s]."""
    return 0.0 if problem.stabilisation is None else problem.stabilisation @ pressure


def solve_saddle_point(problem: SaddlePoint) -> Solution:
    """Solve A v - C^T p = f and C v + S p = g by conjugate gradients on the Schur complement.

    The preconditioner is C diag(A)^-1 C^T + S.

    Args:
        problem: Matrices A, C and S, and right-hand sides f and g.

    Returns:
        Velocity v, pressure p and number of iterations.

    Raises:
        SolveFailed: The true residual of either equation exceeds the limit.
    """
    operator, constraint = problem.operator, problem.constraint
    inverse = _FactoredInverse(operator)
    lumped = constraint @ sparse.diags(1.0 / operator.diagonal()) @ constraint.T
    if problem.stabilisation is not None:
        lumped = lumped + problem.stabilisation
    count = constraint.shape[0]
    shell = PETSc.Mat().createPython([count, count], _Schur(problem, inverse), comm=PETSc.COMM_SELF)
    shell.setUp()
    solver = _conjugate_gradients(shell, to_petsc_spd(lumped.tocsr()))
    solver.getPC().setType(PETSc.PC.Type.CHOLESKY)
    solver.getPC().setFactorSolverType("mumps")
    unconstrained = inverse(problem.load)
    pressure, right = shell.createVecs()
    right.setArray(problem.rate - constraint @ unconstrained)
    if problem.guess is not None:
        pressure.setArray(problem.guess)
        solver.setInitialGuessNonzero(True)
    solver.solve(right, pressure)
    velocity = inverse(problem.load + constraint.T @ pressure.getArray())
    solution = Solution(velocity, pressure.getArray().copy(), solver.getIterationNumber())
    scale = float(np.linalg.norm(right.getArray()))
    check_residuals(problem, solution, solver.getConvergedReason(), scale, _leak(problem, solution.pressure))
    return solution


def _conjugate_gradients(operator: PETSc.Mat, preconditioner: PETSc.Mat) -> PETSc.KSP:
    """Return a conjugate gradient solver for the pressure."""
    solver = PETSc.KSP().create(PETSc.COMM_SELF)
    solver.setOperators(operator, preconditioner)
    solver.setType(PETSc.KSP.Type.CG)
    solver.setTolerances(rtol=RELATIVE_TOLERANCE, max_it=MAX_ITERATIONS)
    return solver


def check_residuals(problem: SaddlePoint, solution: Solution, reason: int, scale: float, leak: Floats | float) -> None:
    """Check the true residuals of a solution.

    Args:
        problem: Saddle-point problem A v - C^T p = f, C v + S p = g, with its matrices and right-hand sides.
        solution: Its approximate solution: velocity, pressure and number of iterations.
        reason: Convergence reason of PETSc, positive if it converged.
        scale: Norm of the rates of volume that the pressure had to supply [m^3/s].
        leak: Stabilisation term S p, shape (m,) [m^3/s].

    Raises:
        SolveFailed: A relative residual exceeds the limit.
    """
    inner, push = problem.operator @ solution.velocity, problem.constraint.T @ solution.pressure
    # If the load is tiny, the pressure balances the operator.
    force = max(float(np.linalg.norm(part)) for part in (inner, push, problem.load)) or 1.0
    momentum = inner - push - problem.load
    continuity = problem.constraint @ solution.velocity + leak - problem.rate
    relative = (float(np.linalg.norm(momentum)) / force, float(np.linalg.norm(continuity)) / (scale or 1.0))
    if not (reason > 0 and max(relative) < RESIDUAL_LIMIT):
        raise SolveFailed(
            f"pressure solve: relative residuals {relative[0]:.2e} (momentum), {relative[1]:.2e} (continuity) above "
            f"{RESIDUAL_LIMIT:g} after {solution.iterations} iterations (PETSc reason {reason})"
        )
