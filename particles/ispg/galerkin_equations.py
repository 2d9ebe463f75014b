"""Linear equations of a step of the Galerkin scheme: predicted velocity, then its projection.

    (M/dt + V + S + dt N^T K N) v* = M v_n/dt + N^T f + B^T p
    dt B M^-1 B^T phi = g - B v*,     v = v* + dt M^-1 B^T phi,     p_new = p + phi - mu div v*

M = N^T m N + (1 - N)^T m (1 - N): a velocity that N reproduces has the momentum and energy of the particles, and one
that N does not show has mass as well, so that M is positive definite. (Row sums of N^T m N are exact for uniform
velocities only and, where a surface is stretched, negative.) In the projection a polynomial of M stands for M^-1, to a
percent, with the masses m of the particles as preconditioner. V is viscosity (2 mu D : D), K implicit surface tension,
S the smoothing.

The rows of B are V_I div at all particles, those on the free surface included, whose pressure is that of the surface.
They add up to the rate of the enclosed volume: what nodal integration misses of it is spread over all rows, so that a
uniform pressure balances a surface at rest exactly. B^T is the pressure gradient integrated by parts: with forces N^T f
of an energy of particles that move with N v, no mode of the linearised scheme grows. The gradient that is collocated,
as printed, has modes that do.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.ispg.galerkin import Galerkin
from reflowshock.particles.ispg.lagged_cholesky import LaggedCholesky, Tolerance, conjugate_gradients

# Of a spacing or of a particle's volume in a step: errors of the solves that are not worth an iteration.
NEGLIGIBLE = 1e-9
# M is half of m at least; the bound above is that of some power steps with a margin.
LIGHTEST, HEAVIER, POWER_STEPS, CHEBYSHEV_STEPS = 0.5, 1.2, 6, 4
MOMENTUM_TOLERANCE, VOLUME_TOLERANCE = 1e-7, 1e-5


@dataclass(frozen=True, slots=True)
class Flow:
    """What the liquid is made of, and how fast velocities that the shape functions do not show die away.

    Attributes:
        density: [kg/m^3].
        viscosity: [Pa s].
        smoothing: rate [1/s].
    """

    density: float
    viscosity: float
    smoothing: float


@dataclass(frozen=True, slots=True)
class LostPower:
    """Power that a velocity loses [W]: to viscosity, to smoothing."""

    viscous: float
    smoothing: float


@dataclass(frozen=True, slots=True)
class GalerkinEquations:
    """The equations of a body at its current positions; fields of vectors are `(n, 3)`.

    Attributes:
        space: shape functions and volumes.
        fluid: its density, viscosity and smoothing.
        basis: `(3 n, d)` admissible coefficients, orthonormal columns, by particle.
        stiffness: `(n, n)` of the surface tension, gamma K [N/m].
        unbalanced: `(n, 3)` rate of the body's volume by the coefficients, less that of all volumes [m^2].
        spacing: of the particles [m].
        time_step: [s].
    """

    space: Galerkin
    fluid: Flow
    basis: sparse.csr_matrix
    stiffness: sparse.csr_matrix
    unbalanced: Floats
    spacing: float
    time_step: float

    @property
    def masses(self) -> Floats:
        """Of the particles, `(n,)` [kg]."""
        return self.fluid.density * self.space.volumes

    def momentum(self, field: Floats) -> Floats:
        """M v, `(n, 3)` [kg m/s]."""
        velocity, masses = self.space.velocity(field), self.masses[:, None]
        rough = masses * (field - velocity)
        return rough + self.space.load_forces(masses * velocity - rough)

    def kinetic(self, field: Floats) -> float:
        """Kinetic energy of coefficients [J]."""
        return 0.5 * float((field * self.momentum(field)).sum())

    def predict(self, velocity: Floats, force: Floats, pressure: Floats) -> Floats:
        """Coefficients v* [m/s] under the last pressure.

        Args:
            velocity: coefficients that the step starts with, `(n, 3)` [m/s].
            force: on the particles at the end of the step, were they at rest, `(n, 3)` [N].
            pressure: at the particles, `(n,)` [Pa].

        Raises:
            SolveFailed: the linear solve failed.
        """
        space, basis = self.space, self.basis
        load = self.momentum(velocity) / self.time_step + self.push(pressure)
        load += space.load_forces(force)
        mean = NEGLIGIBLE * self.spacing * float(self.masses.mean()) / self.time_step**2
        inverse = self.time_step * self._inverse_masses()
        solution, _ = conjugate_gradients(
            lambda free: basis.T @ self.operator((basis @ free).reshape(-1, 3)).ravel(),
            basis.T @ load.ravel(),
            basis.T @ velocity.ravel(),
            lambda residual: inverse * residual,
            Tolerance(MOMENTUM_TOLERANCE, mean * np.sqrt(len(force))),
        )
        return (basis @ solution).reshape(-1, 3)

    def project(self, start: Floats, rate: float, factors: LaggedCholesky) -> tuple[Floats, Floats]:
        """Coefficients v [m/s] without divergence, and the change of the pressure `(n,)` [Pa].

        Args:
            start: predicted coefficients v*, `(n, 3)` [m/s].
            rate: of the body's volume [m^3/s].
            factors: of an earlier pressure equation.

        Raises:
            SolveFailed: the linear solve failed.
        """
        space, basis = self.space, self.basis
        heaviest, divergence = self._heaviest(), self.constraint(start)

        def accelerated(pressure: Floats) -> Floats:
            return self.time_step * self._accelerated(self.push(pressure), heaviest)

        def matrix() -> sparse.csr_matrix:
            rows = (sparse.diags(space.volumes) @ space.divergence_rows() @ basis).tocsr()
            return (rows @ sparse.diags(self.time_step * self._inverse_masses()) @ rows.T).tocsr()

        missing = rate * space.volumes / space.volumes.sum() - divergence
        enough = NEGLIGIBLE * float(space.volumes.mean()) / self.time_step * np.sqrt(len(missing))
        potential = factors.solve(
            lambda pressure: self.constraint(accelerated(pressure)),
            matrix,
            missing,
            Tolerance(VOLUME_TOLERANCE, enough),
        )
        change = potential - self.fluid.viscosity * divergence / space.volumes
        return start + accelerated(potential), change

    def _heaviest(self) -> float:
        """Bound on the eigenvalues of M over those of m, by power iteration."""
        inverse = self._inverse_masses()
        field, largest = np.random.default_rng(0).normal(size=self.basis.shape[1]), 1.0
        for _ in range(POWER_STEPS):
            field /= np.linalg.norm(field)
            field = inverse * (self.basis.T @ self.momentum((self.basis @ field).reshape(-1, 3)).ravel())
            largest = float(np.linalg.norm(field))
        return HEAVIER * largest

    def _accelerated(self, force: Floats, heaviest: float) -> Floats:
        """M^-1 of forces on the coefficients `(n, 3)` [N], nearly: a Chebyshev polynomial of M/m in [1/2, heaviest]."""
        basis, inverse = self.basis, self._inverse_masses()
        middle, half = 0.5 * (heaviest + LIGHTEST), 0.5 * (heaviest - LIGHTEST)
        left = basis.T @ force.ravel()
        change = inverse * left / middle
        found, ratio = change, half / middle
        for _ in range(CHEBYSHEV_STEPS):
            left = left - basis.T @ self.momentum((basis @ change).reshape(-1, 3)).ravel()
            before, ratio = ratio, 1.0 / (2.0 * middle / half - ratio)
            change = ratio * before * change + 2.0 * ratio / half * inverse * left
            found = found + change
        return (basis @ found).reshape(-1, 3)

    def _inverse_masses(self) -> Floats:
        """One over the mass of the particle of each admissible coefficient, `(d,)` [1/kg]."""
        return np.asarray(self.basis.multiply(self.basis).T @ np.repeat(1.0 / self.masses, 3)).ravel()

    def operator(self, field: Floats) -> Floats:
        """M/dt + V + S + dt N^T K N of coefficients, [N]."""
        velocity, gradient = self.space.values(field)
        inertia, rough = (self.masses / self.time_step)[:, None], field - velocity
        unseen = inertia * rough + self._friction(rough)
        tension = self.time_step * (self.stiffness @ velocity)
        return unseen + self.space.load(inertia * velocity + tension - unseen, self._stress(gradient))

    def constraint(self, field: Floats) -> Floats:
        """B v: rates of volume `(n,)` [m^3/s]."""
        volumes = self.space.volumes
        return volumes * (self.space.divergence(field) + (self.unbalanced * field).sum() / volumes.sum())

    def push(self, pressure: Floats) -> Floats:
        """B^T p, [N]."""
        parts = self.space.volumes * pressure
        return self.space.divergence_load(parts) + parts.sum() / self.space.volumes.sum() * self.unbalanced

    def losses(self, start: Floats, field: Floats) -> LostPower:
        """What coefficients lose to forces that the prediction v* has set."""
        (before, first), (velocity, gradient) = self.space.values(start), self.space.values(field)
        return LostPower(
            viscous=float((self._stress(first) * gradient).sum()),
            smoothing=float((self._friction(start - before) * (field - velocity)).sum()),
        )

    def _stress(self, gradient: Floats) -> Floats:
        """Viscous stress times volume `(n, 3, 3)` [N m]."""
        factor = self.fluid.viscosity * self.space.volumes
        return factor[:, None, None] * (gradient + gradient.transpose(0, 2, 1))

    def _friction(self, rough: Floats) -> Floats:
        """Resistance to velocities `(n, 3)` that the shape functions do not show [N]."""
        return (self.fluid.smoothing * self.masses)[:, None] * rough
