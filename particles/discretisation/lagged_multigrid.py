"""Conjugate gradients on a sequence of similar Laplacians, with the multigrid hierarchy of an earlier one."""

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.incompressibility import SolveFailed, petsc
from reflowshock.particles.discretisation.lagged_solver import LaggedSolver

RELATIVE_TOLERANCE = 1e-6
RESIDUAL_LIMIT = 1e-5
MAX_ITERATIONS = 200
# A hierarchy that needs more is made anew; it costs as much as about thirty iterations.
MANY_ITERATIONS = 11
PREFIX = "potential_"
# No squared graph on the first level: fewer iterations. PETSc 3.19 has renamed the option.
OPTIONS = {"pc_gamg_square_graph": 0, "pc_gamg_aggressive_coarsening": 0}


@dataclass(slots=True)
class LaggedMultigrid(LaggedSolver):
    """Algebraic multigrid that is set up anew when its last use took many iterations."""

    def solve(self, laplacian: sparse.csr_matrix, flux: Floats) -> tuple[Floats, int]:
        """Solve L phi = b.

        Args:
            laplacian: L, `(n, n)`.
            flux: b, `(n,)`.

        Returns:
            phi `(n,)`, and the iterations.

        Raises:
            SolveFailed: the true residual stays above the limit.
        """
        solver, matrix = self._prepared(laplacian), petsc(laplacian)
        solver.setOperators(matrix, solver.getOperators()[1])
        potential, right = matrix.createVecs()
        right.setArray(flux)
        solver.solve(right, potential)
        found = potential.getArray().copy()
        residual = float(np.linalg.norm(laplacian @ found - flux)) / (float(np.linalg.norm(flux)) or 1.0)
        if not residual < RESIDUAL_LIMIT:
            raise SolveFailed(
                f"potential: relative residual {residual:.2e} above {RESIDUAL_LIMIT:g} after "
                f"{solver.getIterationNumber()} iterations (PETSc reason {solver.getConvergedReason()})"
            )
        self.iterations = solver.getIterationNumber()
        return found, self.iterations

    def _prepared(self, laplacian: sparse.csr_matrix) -> PETSc.KSP:
        """The solver with its hierarchy, made anew when it is old, of another size or lost."""
        if self.origin is None or self.iterations > MANY_ITERATIONS or self.origin.shape != laplacian.shape:
            self.origin, self._solver = laplacian, None
        if self._solver is None:
            self._solver = _conjugate_gradients(petsc(self.origin))
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
