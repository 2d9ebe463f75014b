"""Velocity under viscosity and the last pressure, implicit in the viscosity (Hu et al., eqs 3 and 12-17)."""

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.krylov import solve_gmres
from reflowshock.particles.ispg.collocation import Operators


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
