"""Nonsymmetric sparse systems: PETSc's GMRES, its preconditioner chosen by the basis, and the true residual checked."""

import numpy as np
from petsc4py import PETSc
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.incompressibility import (
    MAX_ITERATIONS,
    RELATIVE_TOLERANCE,
    RESIDUAL_LIMIT,
    SolveFailed,
    to_petsc,
)

# Shape functions of the linear basis average: fast oscillating coefficients hardly show in values or derivatives, so
# that multigrid and incomplete factors stall (200 iterations leave a residual above 1e-3 at 1728 particles).
PRECONDITIONER = {"quadratic": (PETSc.PC.Type.HYPRE, None), "linear": (PETSc.PC.Type.LU, "mumps")}


def solve_gmres(matrix: sparse.csr_matrix, right: Floats, basis: str) -> tuple[Floats, int]:
    """Solve A x = b, each row scaled by its largest entry: algebraic multigrid, with the linear basis exact factors.

    Args:
        matrix: `(d, d)`.
        right: `(d,)`.
        basis: that the matrix is made with.

    Returns:
        x `(d,)` and the number of iterations.

    Raises:
        SolveFailed: the true residual of the scaled system stays above the limit.
    """
    scale = 1.0 / abs(matrix).max(axis=1).toarray().ravel()
    scaled, load = (sparse.diags(scale) @ matrix).tocsr(), scale * right
    solver = PETSc.KSP().create(PETSc.COMM_SELF)
    solver.setOperators(to_petsc(scaled))
    solver.setType(PETSc.KSP.Type.GMRES)
    solver.setGMRESRestart(MAX_ITERATIONS)
    solver.setPCSide(PETSc.PC.Side.RIGHT)
    solver.setTolerances(rtol=RELATIVE_TOLERANCE, max_it=MAX_ITERATIONS)
    kind, package = PRECONDITIONER[basis]
    solver.getPC().setType(kind)
    if package is not None:
        solver.getPC().setFactorSolverType(package)
    solution, known = solver.getOperators()[0].createVecs()
    known.setArray(load)
    solver.solve(known, solution)
    found, iterations = solution.getArray().copy(), solver.getIterationNumber()
    residual = float(np.linalg.norm(scaled @ found - load)) / (float(np.linalg.norm(load)) or 1.0)
    if not residual < RESIDUAL_LIMIT:
        raise SolveFailed(
            f"GMRES: relative residual {residual:.2e} above {RESIDUAL_LIMIT:g} after {iterations} iterations "
            f"(PETSc reason {solver.getConvergedReason()})"
        )
    return found, iterations
