"""Linear equations of a step of the Galerkin scheme: friction, then what drives the liquid, with its volumes kept.

    (m/dt + V + S) v1 = m v_n/dt + m a
    (m/dt + dt K) v = m v1/dt - m a + f + dt K v_guess + B^T p,     B v = g

v are the velocities of the particles, m their masses, f the forces on them, V viscosity (2 mu D : D), K implicit
surface tension, S the smoothing (1 - N)^T c m (1 - N), a the acceleration of the last step but for friction. Tension
and pressure act together: where a pressure accelerates masses alone, and K resists a velocity that is predicted with
the last pressure, tension lags by dt^3 K m^-1 grad dp/dt, which lets swings grow, the more the finer the particles are.
Friction acts on what has been accelerated by forces in balance: on a velocity under new forces and the last pressure,
which is rough, S takes a multiple of what it should. The shape functions N give gradients only, and the velocity
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

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.lagged_cholesky import LaggedCholesky, Tolerance, conjugate_gradients
from reflowshock.particles.discretisation.stiff_mass import StiffMass
from reflowshock.particles.ispg import step_kernels as kernels
from reflowshock.particles.ispg.galerkin import Galerkin

# Of a spacing or of a particle's volume in a step: errors of the solves that are not worth an iteration.
NEGLIGIBLE = 1e-9
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
    """Power that a velocity loses [W]: to viscosity, walls with friction included, and to smoothing."""

    viscous: float
    smoothing: float


@dataclass(frozen=True, slots=True)
class GalerkinEquations:
    """The equations of a body at its current positions; fields of vectors are `(n, 3)`.

    Attributes:
        space: shape functions and volumes.
        fluid: its density, viscosity and smoothing.
        admitted: `(n, 3, 3)` projections of the particles' velocities onto those that walls admit.
        stiffness: `(3 s, 3 s)` of the surface tension by particle, those of the surface are the first s [N/m].
        rigid: `(k, n, 3)` rigid motions that walls admit, orthonormal by the masses [1/sqrt(kg)].
        drag: `(n,)` friction on the particles on walls [kg/s].
        inertia: masses and implicit surface tension of velocities, by particle.
        unbalanced: `(n, 3)` gradient of the body's volume, less that of all volumes of particles [m^2].
        spacing: of the particles [m].
        time_step: [s].
    """

    space: Galerkin
    fluid: Flow
    admitted: Floats
    stiffness: sparse.spmatrix
    rigid: Floats
    drag: Floats
    inertia: StiffMass
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

    def rubbed(self, velocity: Floats, force: Floats) -> Floats:
        """Velocity [m/s] under friction: of viscosity, walls and smoothing.

        Args:
            velocity: that the step starts with, `(n, 3)` [m/s].
            force: on the particles besides, `(n, 3)` [N].

        Raises:
            SolveFailed: the linear solve failed.
        """
        mean = NEGLIGIBLE * self.spacing * float(self.masses.mean()) / self.time_step**2
        inertia = self.masses / self.time_step
        inverse = 1.0 / inertia[:, None]
        parts = (self.space.rows, self.space.images, (inertia, self.factors, self.admitted))
        solution, _ = conjugate_gradients(
            lambda field: kernels.friction_operator(*parts, field),
            kernels.projected(self.admitted, self.momentum(velocity) / self.time_step + force),
            kernels.projected(self.admitted, velocity),
            lambda residual: inverse * residual,
            Tolerance(MOMENTUM_TOLERANCE, mean * np.sqrt(len(force))),
        )
        return solution

    def driven(self, force: Floats) -> Floats:
        """Velocity `(n, 3)` [m/s] that forces `(n, 3)` [N] give masses and surface in a step from rest."""
        load = kernels.projected(self.admitted, force)
        return self.inertia.solve(load.ravel()).reshape(-1, 3)

    def project(self, start: Floats, rate: float, factors: LaggedCholesky) -> Floats:
        """Pressure `(n,)` [Pa] that takes the divergence away from a velocity.

        Args:
            start: the velocity, `(n, 3)` [m/s].
            rate: of the body's volume [m^3/s].
            factors: of an earlier pressure equation.

        Raises:
            SolveFailed: the linear solve failed.
        """
        volumes = self.space.volumes
        missing = rate * volumes / volumes.sum() - self.constraint(start)
        enough = NEGLIGIBLE * float(volumes.mean()) / self.time_step * np.sqrt(len(missing))
        return factors.solve(
            lambda pressure: self.constraint(self.driven(self.push(pressure))),
            self.pressure_matrix,
            missing,
            Tolerance(VOLUME_TOLERANCE, enough),
        )

    def pressure_matrix(self) -> tuple[NDArray[np.float32], Floats]:
        """Rates of volume under pressures, A, but for what nodal integration misses, and with K by its diagonal.

        Returns the lower triangle of S A S `(n, n)`, whose diagonal is about one, and S `(n,)`.
        """
        space, stiff = self.space, np.repeat(self.masses / self.time_step, 3)
        stiff[: self.stiffness.shape[0]] += self.time_step * self.stiffness.diagonal()
        roots = stiff.reshape(-1, 3, 1) ** -0.5 * self.admitted
        return kernels.pressure_matrix(space.rows, space.images, space.volumes, roots)

    @property
    def _parts(self) -> tuple[Floats, Floats]:
        """Of the constraint: volumes of the particles, and what their gradients miss."""
        return self.space.volumes, self.unbalanced

    def tension(self, field: Floats) -> Floats:
        """Change of the surface tension's force with a displacement, `(n, 3)`: none of a rigid motion, and no moment.

        K alone resists turning, which a surface does not: a drop would be left turning on its wall.
        """
        size, count = self.stiffness.shape[0], len(self.rigid)
        rigid, pull = self.rigid.reshape(count, field.size), np.zeros(field.size)
        moving = (rigid @ self.momentum(field).ravel()) @ rigid
        pull[:size] = self.stiffness @ (field.ravel() - moving)[:size]
        return pull.reshape(-1, 3) - self.momentum(((rigid @ pull) @ rigid).reshape(-1, 3))

    def constraint(self, field: Floats) -> Floats:
        """B v: rates of volume `(n,)` [m^3/s]."""
        return kernels.rates_of_volume(self.space.rows, self.space.images, self._parts, field)

    def push(self, pressure: Floats) -> Floats:
        """B^T p, [N]."""
        return kernels.pressure_forces(self.space.rows, self.space.images, self._parts, pressure)

    def losses(self, start: Floats, field: Floats) -> LostPower:
        """What a velocity loses to the friction on v1, the start."""
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


def admitted_stiffness(stiffness: sparse.bsr_matrix, admitted: Floats) -> sparse.bsr_matrix:
    """Stiffness `(3 s, 3 s)` by particle to velocities of the first s that walls admit by projections `(n, 3, 3)`."""
    rows = np.repeat(np.arange(len(stiffness.indptr) - 1), np.diff(stiffness.indptr))
    blocks = admitted[rows] @ stiffness.data @ admitted[stiffness.indices]
    return sparse.bsr_matrix((blocks, stiffness.indices, stiffness.indptr), shape=stiffness.shape)
