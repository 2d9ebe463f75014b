"""Conjugate gradients for a sequence of similar Laplacians, with the multigrid hierarchy of an earlier one."""

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.incompressibility import SolveFailed, to_petsc_spd
from reflowshock.particles.discretisation.lagged_solver import LaggedSolver

RELATIVE_TOLERANCE = 1e-6
RESIDUAL_LIMIT = 1e-5
MAX_ITERATIONS = 200
# Number of iterations above which the hierarchy is rebuilt, at the cost of about thirty iterations.
MANY_ITERATIONS = 11
PREFIX = "potential_"
# Without a squared graph on the first level fewer iterations are needed; PETSc 3.19 renamed the option.
OPTIONS = {"pc_gamg_square_graph": 0, "pc_gamg_aggressive_coarsening": 0}


@dataclass(slots=True)
class LaggedMultigrid(LaggedSolver):
    """Conjugate gradients with algebraic multigrid that is rebuilt after a solve with many iterations."""

    def solve(self, laplacian: sparse.csr_matrix, flux: Floats) -> tuple[Floats, int]:
        """Solve L phi = b.

        Args:
            laplacian: Symmetric positive definite matrix L, shape (n, n).
            flux: Right-hand side b, shape (n,).

        Returns:
            Solution phi, shape (n,), and the number of iterations.

        Raises:
            SolveFailed: The true residual exceeds the limit.
        """
        solver, matrix = self._prepared(laplacian), to_petsc_spd(laplacian)
        solver.setOperators(matrix, solver.getOperators()[1])
        potential, right = matrix.createVecs()
        right.setArray(flux)
        solver.solve(right, potential)
        solution = potential.getArray().copy()
        residual = float(np.linalg.norm(laplacian @ solution - flux)) / (float(np.linalg.norm(flux)) or 1.0)
        if not residual < RESIDUAL_LIMIT:
            raise SolveFailed(
                f"potential: relative residual {residual:.2e} above {RESIDUAL_LIMIT:g} after "
                f"{solver.getIterationNumber()} iterations (PETSc reason {solver.getConvergedReason()})"
            )
        self.iterations = solver.getIterationNumber()
        return solution, self.iterations

    def _prepared(self, laplacian: sparse.csr_matrix) -> PETSc.KSP:
        """Return the solver, with a new hierarchy if the old one is slow, of another size or not restored."""
        if self.origin is None or self.iterations > MANY_ITERATIONS or self.origin.shape != laplacian.shape:
            self.origin, self._solver = laplacian, None
        if self._solver is None:
            self._solver = _conjugate_gradients(to_petsc_spd(self.origin))
        return self._solver


def _conjugate_gradients(matrix: PETSc.Mat) -> PETSc.KSP:
    solver = PETSc.KSP().create(PETSc.COMM_SELF)
    solver.setType(PETSc.KSP.Type.CG)
    solver.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
    solver.setTolerances(rtol=RELATIVE_TOLERANCE, max_it=MAX_ITERATIONS)
    solver.setOperators(matrix)
    options = PETSc.Options(PREFIX)
    for name, value in OPTIONS.items():
        options[name] = value
    solver.getPC().setType(PETSc.PC.Type.GAMG)
    solver.setOptionsPrefix(PREFIX)
    solver.setFromOptions()
    solver.setUp()
    solver.getPC().setReusePreconditioner(True)
    return solver
