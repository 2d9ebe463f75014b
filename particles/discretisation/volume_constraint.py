"""Symmetric positive definite system with the enclosed volume as its only constraint."""

import numpy as np
from petsc4py import PETSc
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.incompressibility import (
    SaddlePoint,
    Solution,
    SolveFailed,
    check_residuals,
    to_petsc_spd,
)

RELATIVE_TOLERANCE = 1e-10
MAX_ITERATIONS = 2000


class _IterativeInverse:
    """Inverse A^-1 by conjugate gradients with an incomplete Cholesky factorisation."""

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        self._solver = PETSc.KSP().create(PETSc.COMM_SELF)
        self._solver.setOperators(to_petsc_spd(_with_unit_rows(matrix)))
        self._solver.setType(PETSc.KSP.Type.CG)
        self._solver.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
        self._solver.setTolerances(rtol=RELATIVE_TOLERANCE, max_it=MAX_ITERATIONS)
        self._solver.getPC().setType(PETSc.PC.Type.ICC)
        self._solution, self._right = self._solver.getOperators()[0].createVecs()

    @property
    def reason(self) -> int:
        """Convergence reason of PETSc, positive if it converged."""
        return self._solver.getConvergedReason()

    def __call__(self, right: Floats) -> Floats:
        """Return A^-1 x.

        Raises:
            SolveFailed: The factorisation failed; a sound surface always has one.
        """
        self._right.setArray(right)
        try:
            self._solver.solve(self._right, self._solution)
        except PETSc.Error as error:
            raise SolveFailed(f"PETSc cannot factor the matrix of the surface (error {error.ierr})") from error
        return self._solution.getArray().copy()


def _with_unit_rows(matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    """Set a unit diagonal in zero rows, such as the shift of a plate whose edges pin no particle."""
    idle = matrix.diagonal() == 0.0
    return (matrix + sparse.diags(idle.astype(float))).tocsr() if idle.any() else matrix


def solve_volume(problem: SaddlePoint) -> Solution:
    """Solve a problem whose only constraint is the volume; its Schur complement is a number.

    Args:
        problem: Saddle-point problem A v - C^T p = f, C v = g, whose C has one row.

    Returns:
        Velocity, the one pressure, and 0 iterations.

    Raises:
        SolveFailed: The true residual of either equation exceeds the limit.
    """
    inverse, slope = _IterativeInverse(problem.operator), problem.constraint.toarray().ravel()
    loaded = inverse(problem.load)
    reason = inverse.reason
    pressed = inverse(slope)
    missing_rate = problem.rate - slope @ loaded
    pressure = missing_rate / (slope @ pressed)
    solution = Solution(loaded + pressure * pressed, pressure, 0)
    check_residuals(problem, solution, min(reason, inverse.reason), float(np.linalg.norm(missing_rate)), 0.0)
    return solution
