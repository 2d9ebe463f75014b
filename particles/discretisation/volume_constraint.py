"""A symmetric positive definite system bordered by one constraint: the surface of a body that keeps its volume."""

import numpy as np
from petsc4py import PETSc
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.incompressibility import (
    SaddlePoint,
    Solution,
    SolveFailed,
    check_residuals,
    petsc,
)

RELATIVE_TOLERANCE = 1e-10
MAX_ITERATIONS = 2000


class _IterativeInverse:
    """x -> A^-1 x by conjugate gradients and an incomplete factorisation."""

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        self._solver = PETSc.KSP().create(PETSc.COMM_SELF)
        self._solver.setOperators(petsc(_held(matrix)))
        self._solver.setType(PETSc.KSP.Type.CG)
        self._solver.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
        self._solver.setTolerances(rtol=RELATIVE_TOLERANCE, max_it=MAX_ITERATIONS)
        self._solver.getPC().setType(PETSc.PC.Type.ICC)
        self._solution, self._right = self._solver.getOperators()[0].createVecs()

    @property
    def reason(self) -> int:
        """PETSc's reason to stop, positive where it converged."""
        return self._solver.getConvergedReason()

    def __call__(self, right: Floats) -> Floats:
        """A^-1 x.

        Raises:
            SolveFailed: no factorisation, which a sound surface always has.
        """
        self._right.setArray(right)
        try:
            self._solver.solve(self._right, self._solution)
        except PETSc.Error as error:
            raise SolveFailed(f"PETSc cannot factor the surface's matrix (error {error.ierr})") from error
        return self._solution.getArray().copy()


def _held(matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    """The matrix with ones for what nothing moves, such as the shift of a plate whose edges hold no particle."""
    idle = matrix.diagonal() == 0.0
    return (matrix + sparse.diags(idle.astype(float))).tocsr() if idle.any() else matrix


def solve_volume(problem: SaddlePoint) -> Solution:
    """Solve a problem whose only constraint is the volume, by its Schur complement, which is a number.

    Raises:
        SolveFailed: the true residual of either equation stays above the limit.
    """
    inverse, slope = _IterativeInverse(problem.operator), problem.constraint.toarray().ravel()
    loaded = inverse(problem.load)
    reason = inverse.reason
    pressed = inverse(slope)
    wanted = problem.rate - slope @ loaded
    pressure = wanted / (slope @ pressed)
    solution = Solution(loaded + pressure * pressed, pressure, 0)
    check_residuals(problem, solution, min(reason, inverse.reason), (float(np.linalg.norm(wanted)), 0.0))
    return solution
