"""Projection of the printed ISPG scheme, in strong form.

Velocity prediction (Hu et al., eqs 3 and 12 to 17), rotational pressure correction (eqs 5 to 7 and 20 to 24), and the
momentum-consistent smoothing of velocities (eqs 27 to 29), which dissipates unresolved velocities.
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

# The linear basis averages fast oscillating coefficients away, so that multigrid and incomplete factors stall (residual
# above 1e-3 after 200 iterations with 1728 particles).
PRECONDITIONER = {"quadratic": (PETSc.PC.Type.HYPRE, None), "linear": (PETSc.PC.Type.LU, "mumps")}
RELAXATION = 0.5


@dataclass(frozen=True, slots=True)
class Material:
    """Coefficients of the momentum equation.

    Attributes:
        inertia: Density over the time step [kg/(m^3 s)].
        viscosity: Dynamic viscosity [Pa s].
    """

    inertia: float
    viscosity: float


def predict_velocity(operators: Operators, material: Material, velocity: Floats, slope: Floats, basis: str) -> Floats:
    """Solve rho/dt (v* - v) = mu lap v* - grad p at the particles for the coefficients of v*, shape (3 n,) [m/s].

    The printed weak form has one test function per integration point (direct nodal integration), so that a square
    matrix N^T m on both sides cancels. The stress on the free surface enters by its pressure only.

    Args:
        operators: Sparse matrices for values, derivatives and smoothing at the particles.
        material: Density over the time step [kg/(m^3 s)], and viscosity [Pa s].
        velocity: Unsmoothed velocity v before the step, all x, all y, all z, shape (3 n,) [m/s].
        slope: Gradient of the last pressure in the same order, shape (3 n,) [Pa/m].
        basis: Polynomial basis of the moving least squares fit, "linear" or "quadratic".

    Raises:
        SolveFailed: The linear solve failed.
    """
    inertia, viscosity = material.inertia, material.viscosity
    matrix = inertia * operators.velocity_values - viscosity * operators.velocity_laplacian
    return solve_gmres(matrix.tocsr(), inertia * velocity - slope, basis)[0]


@dataclass(frozen=True, slots=True)
class Poisson:
    """Poisson problem with the Laplacian below the free surface and prescribed values on it.

    The normal derivative at walls vanishes, because the operators are mirrored there. The rows of eq 23, with only the
    normal derivative, would take the Laplacian from the particles on the walls.

    Attributes:
        operators: Operators at the particles.
        surface: Whether each particle lies on the free surface, shape (n,).
        basis: "linear" or "quadratic".
    """

    operators: Operators
    surface: NDArray[np.bool_]
    basis: str

    def solve(self, source: Floats, boundary: Floats) -> tuple[Floats, int]:
        """Solve lap f = source below the surface and f = boundary on it.

        Args:
            source: Source, read below the surface, shape (n,).
            boundary: Boundary values, read on the surface, shape (n,).

        Returns:
            Coefficients of f, shape (n,), and the number of iterations.

        Raises:
            SolveFailed: The linear solve failed.
        """
        on, below = (sparse.diags(mask.astype(float)) for mask in (self.surface, ~self.surface))
        matrix = on @ self.operators.values + below @ self.operators.laplacian
        return solve_gmres(matrix.tocsr(), np.where(self.surface, boundary, source), self.basis)


@dataclass(frozen=True, slots=True)
class Correction:
    """Result of a pressure correction.

    Attributes:
        potential: Coefficients of phi, shape (n,) [Pa].
        pressure: Pressure at the end of the step, shape (n,) [Pa].
        iterations: Number of iterations of the solve.
    """

    potential: Floats
    pressure: Floats
    iterations: int


def correct_pressure(
    poisson: Poisson, material: Material, divergence: Floats, pressure: Floats, boundary: Floats
) -> Correction:
    """Correct the pressure in rotational incremental form: phi = p_new - p + mu div v* (eqs 21, 22 and 24).

    Args:
        poisson: Poisson problem: operators, particles of the free surface, basis.
        material: Density over the time step [kg/(m^3 s)], and viscosity [Pa s].
        divergence: Values of the divergence of the predicted velocity at the particles, shape (n,) [1/s].
        pressure: Coefficients of the last pressure in the basis, shape (n,) [Pa].
        boundary: Values of the pressure of the free surface, read there, shape (n,) [Pa].

    Returns:
        Coefficients of phi, values of the pressure at the end of the step at the particles, shape (n,) each [Pa], and
        number of iterations.

    Raises:
        SolveFailed: The linear solve failed.
    """
    inertia, viscosity = material.inertia, material.viscosity
    last = poisson.operators.values @ pressure - viscosity * divergence
    potential, iterations = poisson.solve(inertia * divergence, boundary - last)
    return Correction(potential, poisson.operators.values @ potential + last, iterations)


@dataclass(frozen=True, slots=True)
class Velocities:
    """Velocities that the smoothing hands to the next step, by component, shape (3 n,) each [m/s].

    Attributes:
        coefficients: Coefficients V of the approximation.
        unsmoothed: Velocities u of the particles, which carry the momentum.
    """

    coefficients: Floats
    unsmoothed: Floats


def smooth_velocities(last: Velocities, coefficients: Floats, smoothing: sparse.csr_matrix) -> Velocities:
    """Return the velocities after a step, u_new = (1 - a) (u + S (V_new - V)) + a S V_new with a = 0.5 (eq 28).

    Args:
        last: Coefficients V and unsmoothed velocities u of the particles before the step, shape (3 n,) each [m/s].
        coefficients: New coefficients V_new, shape (3 n,) [m/s].
        smoothing: Smoothing operator S, shape (3 n, 3 n).

    Returns:
        Coefficients and unsmoothed velocities for the next step, shape (3 n,) each [m/s].
    """
    carried = last.unsmoothed + smoothing @ (coefficients - last.coefficients)
    return Velocities(coefficients, (1.0 - RELAXATION) * carried + RELAXATION * (smoothing @ coefficients))


def solve_gmres(matrix: sparse.csr_matrix, right: Floats, basis: str) -> tuple[Floats, int]:
    """Solve A x = b by GMRES with rows scaled by their largest entry.

    The preconditioner is algebraic multigrid for the quadratic basis, and an LU factorisation for the linear one.

    Args:
        matrix: Matrix A, shape (d, d).
        right: Right-hand side b, shape (d,).
        basis: Basis of the operators in A, "linear" or "quadratic".

    Returns:
        Solution x, shape (d,), and the number of iterations.

    Raises:
        SolveFailed: The true residual of the scaled system exceeds the limit.
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
    unknowns, load_vector = solver.getOperators()[0].createVecs()
    load_vector.setArray(load)
    solver.solve(load_vector, unknowns)
    solution, iterations = unknowns.getArray().copy(), solver.getIterationNumber()
    residual = float(np.linalg.norm(scaled @ solution - load)) / (float(np.linalg.norm(load)) or 1.0)
    if not residual < RESIDUAL_LIMIT:
        raise SolveFailed(
            f"GMRES: relative residual {residual:.2e} above {RESIDUAL_LIMIT:g} after {iterations} iterations "
            f"(PETSc reason {solver.getConvergedReason()})"
        )
    return solution, iterations
