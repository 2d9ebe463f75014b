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

import numpy as np

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.discretisation.lagged_cholesky import LaggedCholesky, Tolerance, conjugate_gradients
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
        surface: triangles `(t, 3)` and the half cotangents of their corners times the surface tension `(t, 3)` [N/m].
        rigid: `(k, n, 3)` rigid motions that walls admit, orthonormal by the masses [1/sqrt(kg)].
        drag: `(n,)` friction on the particles on walls [kg/s].
        unbalanced: `(n, 3)` gradient of the body's volume, less that of all volumes of particles [m^2].
        spacing: of the particles [m].
        time_step: [s].
    """

    space: Galerkin
    fluid: Flow
    admitted: Floats
    surface: tuple[Indices, Floats]
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
        load = self.momentum(velocity) / self.time_step + self.push(pressure) + force
        mean = NEGLIGIBLE * self.spacing * float(self.masses.mean()) / self.time_step**2
        inertia = self.masses / self.time_step
        inverse = 1.0 / inertia[:, None]
        implicit = (self.surface, self.rigid, self.masses, self.time_step)
        parts = (self.space.rows, self.space.images, (inertia, self.factors, self.admitted), implicit)
        solution, _ = conjugate_gradients(
            lambda field: kernels.momentum_operator(*parts, field),
            kernels.projected(self.admitted, load),
            kernels.projected(self.admitted, velocity),
            lambda residual: inverse * residual,
            Tolerance(MOMENTUM_TOLERANCE, mean * np.sqrt(len(force))),
        )
        return solution

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
        mobility = (self.time_step / self.masses)[:, None, None] * self.admitted
        roots = np.sqrt(self.time_step / self.masses)[:, None, None] * self.admitted
        missing = rate * space.volumes / space.volumes.sum() - divergence
        enough = NEGLIGIBLE * float(space.volumes.mean()) / self.time_step * np.sqrt(len(missing))
        parts = (space.rows, space.images, self._parts, mobility)
        potential = factors.solve(
            lambda pressure: kernels.pressure_operator(*parts, pressure),
            lambda: kernels.pressure_matrix(space.rows, space.images, space.volumes, roots),
            missing,
            Tolerance(VOLUME_TOLERANCE, enough),
        )
        change = potential - self.fluid.viscosity * divergence / space.volumes
        return start + kernels.projected(mobility, self.push(potential)), change

    def holding(self, base: Floats, force: Floats, velocity: Floats, pressure: Floats) -> Floats:
        """Force `(n, 3)` [N] that walls and edges hold the particles with at the end of a step.

        Args:
            base: velocity that the step started with, `(n, 3)` [m/s].
            force: as in `predict`.
            velocity: at its end, `(n, 3)` [m/s].
            pressure: at its end, `(n,)` [Pa].
        """
        rows, images = self.space.rows, self.space.images
        free = np.broadcast_to(np.eye(3), self.admitted.shape)
        resisted, implicit = (self.masses / self.time_step, self.factors, free), (self.surface, self.rigid, self.masses)
        taken = kernels.momentum_operator(rows, images, resisted, (*implicit, self.time_step), velocity)
        return taken - self.momentum(base) / self.time_step - self.push(pressure) - force

    def pulled(self, start: Floats, _end: Floats) -> Floats:
        """Which of the predicted and the projected velocity the implicit surface tension has resisted."""
        return start

    @property
    def _parts(self) -> tuple[Floats, Floats]:
        """Of the constraint: volumes of the particles, and what their gradients miss."""
        return self.space.volumes, self.unbalanced

    def tension(self, field: Floats) -> Floats:
        """Change of the surface tension's force with a displacement, `(n, 3)`: none of a rigid motion, and no moment.

        K alone resists turning, which a surface does not: a drop would be left turning on its wall.
        """
        return kernels.pull_back(self.surface, self.rigid, self.masses, field)

    def constraint(self, field: Floats) -> Floats:
        """B v: rates of volume `(n,)` [m^3/s]."""
        return kernels.rates_of_volume(self.space.rows, self.space.images, self._parts, field)

    def push(self, pressure: Floats) -> Floats:
        """B^T p, [N]."""
        return kernels.pressure_forces(self.space.rows, self.space.images, self._parts, pressure)

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
