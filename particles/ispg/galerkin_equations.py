"""Linear equations of a step of the Galerkin scheme: predicted velocity, then its projection.

    (m/dt + V + S + dt K) v* = m v_n/dt + f + B^T p
    dt B m^-1 B^T phi = g - B v*,     v = v* + dt m^-1 B^T phi,     p_new = p + phi - mu div v*

v are the velocities of the particles, m their masses, f the forces on them, V viscosity (2 mu D : D), K implicit
surface tension, S the smoothing (1 - N)^T c m (1 - N). The shape functions N give gradients only, and the velocity
N v that slips on walls with friction: the stress that acts on a wall reaches the particles next to it, too. Where
particles move with N v and forces act as N^T f, as printed, a zigzag of the surface does not show: N reduces it to a
thousandth. What evening out and flips leave of it then hardly ever dies away, and the drop is not at rest where its
energy is least.

Masses are those of the mean of the volumes V and of N^T V, of which a pressure that is linear in space pushes a
particle on the surface with 1.3 and 0.9 times the first and the second: with masses of V alone it roughens velocities.

The rows of B are V_I div at all particles, those on the free surface included, whose pressure is that of the surface.
They add up to the rate of the enclosed volume: what nodal integration misses of it is spread over all rows, so that a
uniform pressure balances a surface at rest exactly. B^T is the pressure gradient integrated by parts: with forces of an
energy of the particles, no mode of the linearised scheme grows. The gradient that is collocated, as printed, has modes
that do.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.ispg.lagged_cholesky import LaggedCholesky, Tolerance, conjugate_gradients

# Of a spacing or of a particle's volume in a step: errors of the solves that are not worth an iteration.
NEGLIGIBLE = 1e-9
MOMENTUM_TOLERANCE, VOLUME_TOLERANCE = 1e-7, 1e-5


class Space(Protocol):
    """Shape functions and volumes at n particles; `Galerkin` says what its operators are."""

    @property
    def volumes(self) -> Floats: ...  # noqa: D102

    @property
    def carried(self) -> Floats: ...  # noqa: D102

    def averages(self, coefficients: Floats) -> Floats: ...  # noqa: D102

    def rough(self, field: Floats) -> Floats: ...  # noqa: D102

    def gradient(self, field: Floats) -> Floats: ...  # noqa: D102

    def resistance(self, field: Floats, factors: Floats) -> Floats: ...  # noqa: D102

    def divergence(self, field: Floats) -> Floats: ...  # noqa: D102

    def divergence_load(self, factor: Floats) -> Floats: ...  # noqa: D102

    def divergence_rows(self) -> sparse.csr_matrix: ...  # noqa: D102


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
    """Power that a velocity loses [W]: to viscosity, walls with friction included, and to smoothing."""

    viscous: float
    smoothing: float


@dataclass(frozen=True, slots=True)
class GalerkinEquations:
    """The equations of a body at its current positions; fields of vectors are `(n, 3)`.

    Attributes:
        space: shape functions and volumes.
        fluid: its density, viscosity and smoothing.
        basis: `(3 n, d)` admissible velocities, orthonormal columns, by particle.
        stiffness: `(n, n)` of the surface tension, gamma K [N/m].
        rigid: `(k, 3 n)` rigid motions that walls admit, by particle, orthonormal by the masses [1/sqrt(kg)].
        drag: `(n,)` friction on the particles on walls [kg/s].
        unbalanced: `(n, 3)` gradient of the body's volume, less that of all volumes of particles [m^2].
        spacing: of the particles [m].
        time_step: [s].
    """

    space: Space
    fluid: Flow
    basis: sparse.csr_matrix
    stiffness: sparse.csr_matrix
    rigid: Floats
    drag: Floats
    unbalanced: Floats
    spacing: float
    time_step: float

    @property
    def factors(self) -> Floats:
        """Of what resists velocities, `(n, 3)`: smoothing [kg/s], drag [kg/s] and viscosity [N m s]."""
        smoothing, viscosity = self.fluid.smoothing * self.masses, self.fluid.viscosity * self.space.volumes
        return np.column_stack((smoothing, self.drag, viscosity))

    @property
    def masses(self) -> Floats:
        """Of the particles, `(n,)` [kg]."""
        return self.fluid.density * self.space.carried

    def momentum(self, field: Floats) -> Floats:
        """Momenta of the particles, `(n, 3)` [kg m/s]."""
        return self.masses[:, None] * field

    def kinetic(self, field: Floats) -> float:
        """Kinetic energy [J]."""
        return 0.5 * float((field * self.momentum(field)).sum())

    def predict(self, velocity: Floats, force: Floats, pressure: Floats) -> Floats:
        """Velocity v* [m/s] under the last pressure.

        Args:
            velocity: that the step starts with, `(n, 3)` [m/s].
            force: on the particles at the end of the step, were they at rest, `(n, 3)` [N].
            pressure: at the particles, `(n,)` [Pa].

        Raises:
            SolveFailed: the linear solve failed.
        """
        basis, across = self.basis, self.basis.T
        load = self.momentum(velocity) / self.time_step + self.push(pressure) + force
        mean = NEGLIGIBLE * self.spacing * float(self.masses.mean()) / self.time_step**2
        inverse = self.time_step * self._inverse_masses()
        solution, _ = conjugate_gradients(
            lambda free: across @ self.operator((basis @ free).reshape(-1, 3)).ravel(),
            across @ load.ravel(),
            across @ velocity.ravel(),
            lambda residual: inverse * residual,
            Tolerance(MOMENTUM_TOLERANCE, mean * np.sqrt(len(force))),
        )
        return (basis @ solution).reshape(-1, 3)

    def project(self, start: Floats, rate: float, factors: LaggedCholesky) -> tuple[Floats, Floats]:
        """Velocity v [m/s] without divergence, and the change of the pressure `(n,)` [Pa].

        Args:
            start: predicted velocity v*, `(n, 3)` [m/s].
            rate: of the body's volume [m^3/s].
            factors: of an earlier pressure equation.

        Raises:
            SolveFailed: the linear solve failed.
        """
        space, divergence = self.space, self.constraint(start)
        missing = rate * space.volumes / space.volumes.sum() - divergence
        enough = NEGLIGIBLE * float(space.volumes.mean()) / self.time_step * np.sqrt(len(missing))
        potential = factors.solve(
            lambda pressure: self.constraint(self.accelerated(pressure)),
            self.pressure_matrix,
            missing,
            Tolerance(VOLUME_TOLERANCE, enough),
        )
        change = potential - self.fluid.viscosity * divergence / space.volumes
        return start + self.accelerated(potential), change

    def pulled(self, start: Floats, _end: Floats) -> Floats:
        """Which of the predicted and the projected velocity the implicit surface tension has resisted."""
        return start

    def accelerated(self, pressure: Floats) -> Floats:
        """Change of the velocity in a step under a pressure `(n,)` [Pa], dt m^-1 B^T p."""
        moved = self.time_step * self._inverse_masses() * (self.basis.T @ self.push(pressure).ravel())
        return (self.basis @ moved).reshape(-1, 3)

    def pressure_matrix(self) -> sparse.csr_matrix:
        """Rates of volume under such changes, `(n, n)` [m^3/(s Pa)], but for what nodal integration misses."""
        rows = (sparse.diags(self.space.volumes) @ self.space.divergence_rows() @ self.basis).tocsr()
        return (rows @ sparse.diags(self.time_step * self._inverse_masses()) @ rows.T).tocsr()

    def _inverse_masses(self) -> Floats:
        """One over the mass of the particle of each admissible velocity, `(d,)` [1/kg]."""
        return np.asarray(self.basis.multiply(self.basis).T @ np.repeat(1.0 / self.masses, 3)).ravel()

    def operator(self, field: Floats) -> Floats:
        """m/dt + V + S + dt K of a velocity, [N]."""
        direct = self.momentum(field) / self.time_step + self.time_step * self.tension(field)
        return direct + self.space.resistance(field, self.factors)

    def tension(self, field: Floats) -> Floats:
        """Change of the surface tension's force with a displacement, `(n, 3)`: none of a rigid motion, and no moment.

        K alone resists turning, which a surface does not: a drop would be left turning on its wall.
        """
        rigid = self.rigid
        moving = (rigid @ self.momentum(field).ravel()) @ rigid
        pull = self.pull(field - moving.reshape(-1, 3))
        return pull - self.momentum(((rigid @ pull.ravel()) @ rigid).reshape(-1, 3))

    def pull(self, field: Floats) -> Floats:
        """Pull gamma K x of a displacement, `(n, 3)`."""
        return self.stiffness @ field

    def constraint(self, field: Floats) -> Floats:
        """B v: rates of volume `(n,)` [m^3/s]."""
        volumes = self.space.volumes
        return volumes * (self.space.divergence(field) + (self.unbalanced * field).sum() / volumes.sum())

    def push(self, pressure: Floats) -> Floats:
        """B^T p, [N]."""
        parts = self.space.volumes * pressure
        return self.space.divergence_load(parts) + parts.sum() / self.space.volumes.sum() * self.unbalanced

    def losses(self, start: Floats, field: Floats) -> LostPower:
        """What a velocity loses to forces that the prediction v* has set."""
        space = self.space
        before, after = space.rough(start), space.rough(field)
        inside = float((self._stress(space.gradient(start)) * space.gradient(field)).sum())
        on_walls = float((self.drag[:, None] * (start - before) * (field - after)).sum())
        return LostPower(viscous=inside + on_walls, smoothing=float((self._friction(before) * after).sum()))

    def _stress(self, gradient: Floats) -> Floats:
        """Viscous stress times volume `(n, 3, 3)` [N m]."""
        factor = self.fluid.viscosity * self.space.volumes
        return factor[:, None, None] * (gradient + gradient.transpose(0, 2, 1))

    def _friction(self, rough: Floats) -> Floats:
        """Resistance to velocities `(n, 3)` that the shape functions do not show [N]."""
        return (self.fluid.smoothing * self.masses)[:, None] * rough
