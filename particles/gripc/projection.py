"""The projection of the paper's ISPG scheme, in strong form.

Velocity prediction (Hu et al., eqs 3 and 12-17), rotational pressure correction (eqs 5-7 and 20-24), and the
momentum-consistent smoothing of velocities (eqs 27-29), which dissipates what the approximation cannot show.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
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
from reflowshock.particles.gripc.collocation import Operators

# Shape functions of the linear basis average: fast oscillating coefficients hardly show in values or derivatives, so
# that multigrid and incomplete factors stall (200 iterations leave a residual above 1e-3 at 1728 particles).
PRECONDITIONER = {"quadratic": (PETSc.PC.Type.HYPRE, None), "linear": (PETSc.PC.Type.LU, "mumps")}
RELAXATION = 0.5


def predict_velocity(
    operators: Operators, fluid: tuple[float, float], velocity: Floats, slope: Floats, basis: str
) -> Floats:
    """Return coefficients v* `(3 n,)` [m/s] of rho/dt (v* - v) = mu lap v* - grad p at the particles.

    The printed weak form tests this with as many functions as it has points of integration (direct nodal
    integration): a square matrix N^T m on both sides, which is left out. Nothing is said of the stress on the free
    surface; it enters by the pressure there.

    Args:
        operators: at the particles.
        fluid: density over the time step [kg/(m^3 s)] and viscosity [Pa s].
        velocity: v, unsmoothed velocities `(3 n,)` before the step [m/s].
        slope: grad p `(3 n,)` of the last pressure [Pa/m].
        basis: "linear" or "quadratic".

    Raises:
        SolveFailed: the linear solve failed.
    """
    inertia, viscosity = fluid
    matrix = inertia * operators.velocity_values - viscosity * operators.velocity_laplacian
    return solve_gmres(matrix.tocsr(), inertia * velocity - slope, basis)[0]


@dataclass(frozen=True, slots=True)
class Poisson:
    """Laplacian below the free surface, value on it.

    The slope along the normal of a wall vanishes because the operators are mirrored there: rows of eq 23, with the
    derivative along the normal alone, would take the Laplacian from the particles on the walls.

    Attributes:
        operators: at the particles.
        surface: `(n,)` whether a particle lies on the free surface.
        basis: "linear" or "quadratic".
    """

    operators: Operators
    surface: NDArray[np.bool_]
    basis: str

    def solve(self, source: Floats, boundary: Floats) -> tuple[Floats, int]:
        """Return coefficients `(n,)` of f with lap f = source below the surface and f = boundary on it; iterations.

        Args:
            source: `(n,)`, read below the surface.
            boundary: `(n,)`, read on the surface.

        Raises:
            SolveFailed: the linear solve failed.
        """
        on, below = (sparse.diags(mask.astype(float)) for mask in (self.surface, ~self.surface))
        matrix = on @ self.operators.values + below @ self.operators.laplacian
        return solve_gmres(matrix.tocsr(), np.where(self.surface, boundary, source), self.basis)


@dataclass(frozen=True, slots=True)
class Correction:
    """What the projection of a velocity gives.

    Attributes:
        potential: `(n,)` coefficients of phi [Pa].
        pressure: `(n,)` at the end of the step [Pa].
        iterations: of the solve.
    """

    potential: Floats
    pressure: Floats
    iterations: int


def correct_pressure(
    poisson: Poisson, fluid: tuple[float, float], divergence: Floats, pressure: Floats, given: Floats
) -> Correction:
    """Rotational incremental pressure correction: phi = p_new - p + mu div v* (eqs 21, 22 and 24).

    Args:
        poisson: Laplacian and boundary.
        fluid: density over the time step [kg/(m^3 s)] and viscosity [Pa s].
        divergence: `(n,)` of the predicted velocity [1/s].
        pressure: `(n,)` coefficients of the last pressure [Pa].
        given: `(n,)` pressure that the free surface has, read there [Pa].

    Raises:
        SolveFailed: the linear solve failed.
    """
    inertia, viscosity = fluid
    last = poisson.operators.values @ pressure - viscosity * divergence
    potential, iterations = poisson.solve(inertia * divergence, given - last)
    return Correction(potential, poisson.operators.values @ potential + last, iterations)


@dataclass(frozen=True, slots=True)
class Velocities:
    """What the smoothing keeps from step to step, `(3 n,)` each, by component [m/s].

    Attributes:
        coefficients: V of the approximation.
        unsmoothed: u of the particles, which carry the momentum.
    """

    coefficients: Floats
    unsmoothed: Floats


def smooth(last: Velocities, coefficients: Floats, smoothing: sparse.csr_matrix) -> Velocities:
    """Velocities after a step, eq 28: u_new = (1 - a) (u + S (V_new - V)) + a S V_new, a = 0.5.

    Args:
        last: velocities before the step.
        coefficients: V_new `(3 n,)` [m/s].
        smoothing: S, `(3 n, 3 n)`.
    """
    kept = last.unsmoothed + smoothing @ (coefficients - last.coefficients)
    return Velocities(coefficients, (1.0 - RELAXATION) * kept + RELAXATION * (smoothing @ coefficients))


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
