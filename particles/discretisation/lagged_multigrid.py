"""Conjugate gradients on a sequence of similar Laplacians, with the multigrid hierarchy of an earlier one."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from petsc4py import PETSc
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.incompressibility import SolveFailed, petsc

RELATIVE_TOLERANCE = 1e-6
RESIDUAL_LIMIT = 1e-5
MAX_ITERATIONS = 200
# A hierarchy that needs more is made anew; it costs as much as about thirty iterations.
MANY_ITERATIONS = 11
PREFIX = "potential_"
# No squared graph on the first level: fewer iterations. PETSc 3.19 has renamed the option.
OPTIONS = {"pc_gamg_square_graph": 0, "pc_gamg_aggressive_coarsening": 0}


@dataclass(slots=True)
class LaggedMultigrid:
    """Algebraic multigrid that is set up anew when its last use took many iterations.

    It keeps the matrix that it was set up for, so that a run from a checkpoint continues with the same bits.

    Attributes:
        origin: matrix of the hierarchy.
        iterations: of the last solve.
    """

    origin: sparse.csr_matrix | None = None
    iterations: int = 0
    _solver: PETSc.KSP | None = field(default=None, repr=False)

    def saved(self) -> dict[str, Any]:
        """All but the PETSc objects, for a checkpoint."""
        origin = self.origin
        rows = None if origin is None else {name: getattr(origin, name) for name in ("data", "indices", "indptr")}
        return {"origin": rows, "iterations": self.iterations}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        rows, self.iterations, self._solver = saved["origin"], saved["iterations"], None
        self.origin = None
        if rows is not None:
            count = len(rows["indptr"]) - 1
            self.origin = sparse.csr_matrix((rows["data"], rows["indices"], rows["indptr"]), shape=(count, count))

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
