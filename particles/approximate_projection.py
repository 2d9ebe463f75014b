"""Velocity and pressure of a body that relaxes towards rest, in a time that grows with the particles only.

    A v - C^T p = f,     C v + T p = g,     T = L - C_d A_d^-1 C_d^T

Without viscosity A couples the surface only; on the other degrees of freedom d it is diagonal, and what they add to the
Schur complement C A^-1 C^T is a wide and nearly singular Laplacian. It is replaced by a compact one, L (approximate
projection: Almgren, Bell & Szymczak 1996): conjugate gradients then need about as many steps at any size. The
difference T p vanishes with the spacing, and at rest, where the local pressures vanish; the volume of the whole body is
a row of C that keeps its exact form, and is eliminated.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy import sparse

from particles.incompressibility import Inverse, SaddlePoint, Solution, check_residuals, conjugate_gradients, petsc

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Surface:
    """The degrees of freedom that A couples or that change the volume, and the rest, on which A is diagonal.

    Attributes:
        dofs: `(s,)` the surface.
        inverse: of A on the surface.
        local, transposed: C on the surface without the row of the volume, `(m, s)` [m^2], and its transpose.
        rest: `(d,)` 1 / A off the surface, zero on it [s/kg].
        swept: `(m,)` local rates of a unit of pressure on the whole surface.
        compliance: rate of the volume for a unit of pressure on the whole surface.
    """

    dofs: NDArray[np.int64]
    inverse: Inverse
    local: sparse.csr_matrix
    transposed: sparse.csr_matrix
    rest: Floats
    swept: Floats
    compliance: float

    def solve(self, right: Floats) -> Floats:
        """A^-1 x."""
        result = self.rest * right
        result[self.dofs] = self.inverse(right[self.dofs])
        return result

    def yields(self, pressure: Floats) -> Floats:
        """C_s A_s^-1 C_s^T p at constant volume, `(m,)`."""
        flux = self.local @ self.inverse(self.transposed @ pressure)
        return flux - self.swept * (float(self.swept @ pressure) / self.compliance)


class _Schur:
    """PETSc shell of L + C_s A_s^-1 C_s^T at constant volume."""

    def __init__(self, laplacian: sparse.csr_matrix, surface: _Surface) -> None:
        self._laplacian, self._surface = laplacian, surface

    def mult(self, _matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        pressure = x.getArray(readonly=True)
        y.setArray(self._laplacian @ pressure + self._surface.yields(pressure))


def _split(problem: SaddlePoint) -> _Surface:
    operator, constraint = problem.operator, problem.constraint
    operator.eliminate_zeros()
    whole = constraint[-1].toarray().ravel()
    on_surface = (np.diff(operator.indptr) > 1) | (whole != 0.0)
    dofs = np.flatnonzero(on_surface)
    inverse = Inverse(operator[dofs][:, dofs])
    local = constraint[:-1][:, dofs]
    given = inverse(whole[dofs])
    rest = np.where(on_surface, 0.0, 1.0 / operator.diagonal())
    return _Surface(dofs, inverse, local, local.T.tocsr(), rest, local @ given, float(whole[dofs] @ given))


def project(problem: SaddlePoint, laplacian: sparse.csr_matrix) -> Solution:
    """Solve by conjugate gradients on the pressure, preconditioned by algebraic multigrid.

    Args:
        problem: the last row of its constraint is that of the whole volume.
        laplacian: L, `(m - 1, m - 1)` [m^3/(Pa s)].

    Raises:
        SolveFailed: the true residual of either equation stays above the limit.
    """
    surface = _split(problem)
    scaled = surface.local @ sparse.diags(1.0 / problem.operator.diagonal()[surface.dofs])
    unconstrained = surface.solve(problem.load)
    wanted = problem.rate - problem.constraint @ unconstrained
    share = surface.swept * (wanted[-1] / surface.compliance)
    shell = PETSc.Mat().createPython([*laplacian.shape], _Schur(laplacian, surface), comm=PETSc.COMM_SELF)
    shell.setUp()
    solver = conjugate_gradients(shell, petsc((laplacian + scaled @ surface.transposed).tocsr()))
    solver.getPC().setType(PETSc.PC.Type.HYPRE)
    local, right = shell.createVecs()
    right.setArray(wanted[:-1] - share)
    solver.solve(right, local)
    pressure = np.append(local.getArray(), (wanted[-1] - surface.swept @ local.getArray()) / surface.compliance)
    push = problem.constraint.T @ pressure
    velocity = surface.solve(problem.load + push)
    leak = np.append(laplacian @ pressure[:-1], 0.0) - problem.constraint @ (surface.rest * push)
    solution = Solution(velocity, pressure, solver.getIterationNumber())
    check_residuals(problem, solution, solver.getConvergedReason(), (float(np.linalg.norm(wanted)), leak))
    return solution
