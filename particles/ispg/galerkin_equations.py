"""Linear equations of a step of the Galerkin scheme: a friction solve, then a pressure correction.

    (m/dt + V + S) v1 = m v_n/dt + m a
    (m/dt + dt K) v = m v1/dt - m a + f + dt K v_p + B^T p,     B v = g

Unknowns are the particle velocities v and pressures p; v1 is the velocity after friction and v_p the predicted one.
m are the particle masses, f the forces, V the viscosity (2 mu D : D), K the implicit surface tension,
S = (1 - N)^T c m (1 - N) the velocity smoothing with the MLS shape functions N, a the acceleration of the last step
except for friction, B the rates of the nodal volumes and g the required rates. Differences from Hu et al.:

- Surface tension and pressure act together through m/dt + dt K. With a pressure that accelerates the masses alone
  (eq 25), tension lags by dt^3 K m^-1 grad dp/dt, and oscillations grow, the more the finer the particles.
- Friction acts on a velocity already accelerated by balanced forces (m a). Under new forces and the old pressure that
  velocity would be rough, and S would dissipate several times too much.
- N gives gradients, and the velocity N v that slips on walls with friction, so that wall stress also reaches the
  particles next to the wall. Moving particles with N v and applying forces as N^T f (eqs 12, 27) hides zigzag modes of
  the surface: N reduces them to a thousandth, they hardly decay, and the drop is not at rest at its least energy.
- Masses follow from the mean of the nodal volumes V and N^T V. A linear pressure pushes a surface particle with 1.3
  and 0.9 times these two; masses of V alone roughen the velocity.
- B has a row V_I div for every particle, those on the free surface included. The difference to the rate of the
  enclosed volume is distributed over all rows, so that a uniform pressure balances a surface at rest exactly.
- B^T p is the pressure gradient integrated by parts: with forces that derive from an energy, no mode of the linearised
  scheme grows. The collocated gradient (eq 17) has growing modes at any time step.

With moving walls v = q + w: w is prescribed by the walls (their normal velocity, and that of pinned particles), q is
admissible. Ghost particles move with their walls (``Ghosts.drift``), and friction acts on the slip velocity.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.effective_mass import EffectiveMass
from reflowshock.particles.discretisation.lagged_cholesky import (
    Apply,
    Band,
    LaggedCholesky,
    Tolerance,
    conjugate_gradients,
)
from reflowshock.particles.discretisation.schur_complement import LowRank, SchurComplement, VolumeRateRows
from reflowshock.particles.ispg import step_kernels as kernels
from reflowshock.particles.ispg.galerkin_space import GalerkinSpace
from reflowshock.particles.ispg.moving_plates import FloatingModes
from reflowshock.particles.ispg.rigid_motions import rigid_part

# Velocity that forces on particles and on floating plates cause in a step from rest.
Response = Callable[[Floats, Floats], Floats]
# Error of the solves that is negligible, as a share of a spacing or of a particle's volume in a step.
NEGLIGIBLE = 1e-9
MOMENTUM_TOLERANCE, VOLUME_TOLERANCE = 1e-7, 1e-5


@dataclass(frozen=True, slots=True)
class LiquidProperties:
    """Properties of the liquid, and the rate of velocity smoothing.

    Attributes:
        density: Density [kg/m^3].
        viscosity: Dynamic viscosity [Pa s].
        smoothing: Decay rate of velocities that the shape functions do not resolve [1/s].
    """

    density: float
    viscosity: float
    smoothing: float


@dataclass(frozen=True, slots=True)
class LostPower:
    """Dissipated power.

    Attributes:
        viscous: Power dissipated by viscosity and wall friction [W].
        smoothing: Power dissipated by velocity smoothing [W].
    """

    viscous: float
    smoothing: float


@dataclass(frozen=True, slots=True)
class GalerkinEquations:
    """Equations of a body at fixed positions.

    Attributes:
        space: Shape functions and nodal volumes.
        fluid: Properties of the liquid.
        admitted: Projections onto the velocities that walls admit, shape (n, 3, 3).
        stiffness: Stiffness of the surface tension, by particle; the s surface particles come first, shape (3 s, 3 s)
            [N/m].
        rigid: Mass-orthonormal rigid-body motions that walls admit, shape (k, n, 3) [1/sqrt(kg)].
        drag: Friction coefficients of the particles on walls, shape (n,) [kg/s].
        inertia: Factored effective mass m / dt + dt K.
        walls: Wall velocities at the particles on them, zero elsewhere, shape (n, 3) [m/s].
        unbalanced: Gradient of the enclosed volume minus the gradient of the sum of nodal volumes, shape (n, 3) [m^2].
        spacing: Particle spacing [m].
        time_step: Time step of the equivalent backward Euler step [s].
    """

    space: GalerkinSpace
    fluid: LiquidProperties
    admitted: Floats
    stiffness: sparse.spmatrix
    rigid: Floats
    drag: Floats
    inertia: EffectiveMass
    walls: Floats
    unbalanced: Floats
    spacing: float
    time_step: float

    @property
    def factors(self) -> Floats:
        """Coefficients of smoothing [kg/s], wall drag [kg/s] and viscosity times volume [N m s], shape (n, 3)."""
        smoothing, viscosity = self.fluid.smoothing * self.masses, self.fluid.viscosity * self.space.volumes
        return np.column_stack((smoothing, self.drag, viscosity))

    @property
    def masses(self) -> Floats:
        """Particle masses, shape (n,) [kg]."""
        return self.fluid.density * self.space.carried

    @property
    def prescribed(self) -> Floats:
        """Velocities that walls prescribe, shape (n, 3) [m/s]."""
        return self.walls - kernels.projected(self.admitted, self.walls)

    def momentum(self, field: Floats) -> Floats:
        """Return the particle momenta of a velocity field of shape (n, 3) [m/s], shape (n, 3) [kg m/s]."""
        return self.masses[:, None] * field

    def kinetic_energy(self, field: Floats) -> float:
        """Return the kinetic energy of a velocity field of shape (n, 3) [m/s], in joules."""
        return 0.5 * float((field * self.momentum(field)).sum())

    def slow_rigid_motion(self, velocity: Floats, largest_energy: float) -> Floats | None:
        """Return the rigid-body part of a velocity field, or None if its kinetic energy is too large.

        Args:
            velocity: Velocity, shape (n, 3) [m/s].
            largest_energy: Kinetic energy that the rigid-body part may have [J].
        """
        part = rigid_part(self.rigid, self.masses, velocity)
        return part if self.kinetic_energy(part) <= largest_energy else None

    def velocity_after_friction(self, velocity: Floats, force: Floats) -> Floats:
        """Solve the first equation: viscosity, wall friction and velocity smoothing.

        Args:
            velocity: Velocity at the start of the step, shape (n, 3) [m/s].
            force: Other forces on the particles, shape (n, 3) [N].

        Returns:
            Velocity, shape (n, 3) [m/s].

        Raises:
            SolveFailed: The linear solve failed.
        """
        mean = NEGLIGIBLE * self.spacing * float(self.masses.mean()) / self.time_step**2
        inertia = self.masses / self.time_step
        inverse = 1.0 / inertia[:, None]
        load = self.momentum(velocity) / self.time_step + force
        if self.walls.any() or self.space.drift.any():
            load -= self._wall_drag()
        parts = (self.space.rows, self.space.images)
        operator: Apply = partial(kernels.friction_operator, *parts, (inertia, self.factors, self.admitted))
        right = kernels.projected(self.admitted, load)
        guess = kernels.projected(self.admitted, velocity) + self.prescribed
        if (modes := self.space.floating) is not None:
            unconstrained = np.broadcast_to(np.eye(3), self.admitted.shape).copy()
            friction = partial(kernels.friction_operator, *parts, (inertia, self.factors, unconstrained))
            operator = self._with_floating_plates(modes, friction)
            right = self._admissible_load(modes, load, np.zeros(len(modes.loads)))
            guess = guess + modes.along(velocity)
        solution, _ = conjugate_gradients(
            operator,
            right,
            guess,
            lambda residual: inverse * residual,
            Tolerance(MOMENTUM_TOLERANCE, mean * np.sqrt(len(force))),
        )
        return solution

    def response(self) -> Response:
        """Return a function that maps forces to the velocity they cause in a step from rest, by effective mass.

        Its arguments are forces on the particles, shape (n, 3) [N], and generalised forces on the floating plates,
        shape (k,); it returns an admissible velocity, that of floating plates included, shape (n, 3) [m/s].
        """

        def admitted(force: Floats) -> Floats:
            return self.inertia.solve(kernels.projected(self.admitted, force).ravel()).reshape(-1, 3)

        modes = self.space.floating
        if modes is None:
            return lambda force, _: admitted(force)
        pulls = self.time_step * np.array([self.tension_stiffness(field) for field in modes.fields])
        compliant = np.array([admitted(pull) for pull in pulls])
        stiffness = np.tensordot(pulls, modes.fields - compliant, ((1, 2), (1, 2)))
        stiffness = stiffness + np.eye(len(pulls)) / self.time_step

        def respond(force: Floats, on_plates: Floats) -> Floats:
            field = admitted(force)
            load = np.tensordot(modes.fields, force, 2) + on_plates - np.tensordot(pulls, field, 2)
            return field + np.tensordot(np.linalg.solve(stiffness, load), modes.fields - compliant, 1)

        return respond

    def load_without_prescribed(self, load: Floats) -> Floats:
        """Return forces of shape (n, 3) [N] less the inertia and tension of the velocities that walls prescribe."""
        prescribed = self.prescribed
        return load - self.momentum(prescribed) / self.time_step - self.time_step * self.tension_stiffness(prescribed)

    def ghost_pressure_forces(self, pressure: Floats) -> Floats:
        """Return the generalised forces on floating plates by pressure on their ghost particles, shape (k,).

        Args:
            pressure: Pressure coefficients, shape (n,) [Pa].
        """
        return self._ghost_rates() @ pressure

    def plate_forces(self, pressure: Floats) -> Floats:
        """Return the generalised forces on floating plates by pressure and by their loads, shape (k,).

        Args:
            pressure: Pressure coefficients, shape (n,) [Pa].
        """
        modes = self.space.floating
        return self.ghost_pressure_forces(pressure) + (0.0 if modes is None else modes.loads)

    def pressure_correction(self, start: Floats, rate: float, factors: LaggedCholesky, respond: Response) -> Floats:
        """Solve for the pressure that makes a velocity field divergence-free.

        Args:
            start: Velocity before the correction, shape (n, 3) [m/s].
            rate: Required rate of the enclosed volume [m^3/s].
            factors: Factors of an earlier pressure equation, used as preconditioner and updated when outdated.
            respond: Result of ``response``.

        Returns:
            Change of the pressure coefficients, shape (n,) [Pa].

        Raises:
            SolveFailed: The linear solve failed.
        """
        volumes = self.space.volumes
        missing = rate * volumes / volumes.sum() - self.volume_rates(start)
        enough = NEGLIGIBLE * float(volumes.mean()) / self.time_step * np.sqrt(len(missing))
        return factors.solve(*self.pressure_equation(respond), missing, Tolerance(VOLUME_TOLERANCE, enough))

    def pressure_equation(self, respond: Response) -> tuple[Apply, Callable[[], Band]]:
        """Return the operator from pressures to rates of volume, and a function that assembles its preconditioner.

        The preconditioner is a band matrix without the correction of nodal integration and with the diagonal of K only.
        Each floating plate adds terms of low rank to the operator.

        Args:
            respond: Result of ``response``.
        """
        space, ghosts, modes = self.space, self._ghost_rates(), self.space.floating
        rates = VolumeRateRows(*kernels.admitted_rates(space.rows, space.images, space.volumes, self.admitted))
        shares, gradient = space.volumes / space.volumes.sum(), kernels.projected(self.admitted, self.unbalanced)
        still = np.zeros_like(self.walls)
        moved = [respond(still, unit) for unit in np.eye(len(ghosts))]
        columns = np.array([self._admissible_rates(field, ghosts) for field in moved]).reshape(-1, len(still)).T
        core = np.zeros((0, 0)) if modes is None else np.linalg.inv([modes.amplitudes(field) for field in moved])
        operator = SchurComplement.of(rates, shares, gradient, self.inertia, LowRank(columns, core))
        return operator, lambda: rates.band(self._effective_mass_diagonal(), space.order)

    def _effective_mass_diagonal(self) -> Floats:
        """Return the diagonal of m / dt + dt K, shape (n, 3) [kg/s]."""
        stiff = np.repeat(self.masses / self.time_step, 3)
        stiff[: self.stiffness.shape[0]] += self.time_step * self.stiffness.diagonal()
        return stiff.reshape(-1, 3)

    def _admissible_rates(self, field: Floats, ghosts: Floats) -> Floats:
        """Return the rates of volume of an admissible velocity, with those of ghosts at floating plates, shape (n,)."""
        rates = kernels.rates_of_volume(self.space.rows, self.space.images, self._constraint_parts, field)
        modes = self.space.floating
        return rates if modes is None else rates + modes.amplitudes(field) @ ghosts

    def _with_floating_plates(self, modes: FloatingModes, operator: Apply) -> Apply:
        """Extend an operator on admissible velocities by the motion of floating plates and their ghost particles.

        Forces on ghost particles that one plate mode causes have a power in the other modes and on the particles.
        """
        drifts, still = modes.drifts, np.zeros_like(self.walls)
        stresses = [
            kernels.resistance(*self.space.rows, np.concatenate((still, drift)), self.factors) for drift in drifts
        ]
        forces = np.array([kernels.folded(stress, *self.space.images) for stress in stresses])
        coupling = np.tensordot(np.array(stresses)[:, len(still) :], drifts, ((1, 2), (1, 2)))

        def extended(field: Floats) -> Floats:
            amplitudes = modes.amplitudes(field)
            force = operator(field) + np.tensordot(amplitudes, forces, 1)
            return self._admissible_load(modes, force, np.tensordot(forces, field, 2) + coupling @ amplitudes)

        return extended

    def _admissible_load(self, modes: FloatingModes, force: Floats, on_ghosts: Floats) -> Floats:
        """Return the load on admissible velocities of forces (n, 3) [N] and generalised forces on plates (k,)."""
        on_plates = np.tensordot(modes.fields, force, 2) + on_ghosts
        return kernels.projected(self.admitted, force) + np.tensordot(on_plates, modes.momenta, 1)

    def _ghost_rates(self) -> Floats:
        """Return the rates of volume that each mode of the floating plates causes by its ghosts, shape (k, n)."""
        if self.space.floating is None:
            return np.zeros((0, len(self.walls)))
        still, drifts = np.zeros_like(self.walls), self.space.floating.drifts
        return np.array([self._rates_of_ghosts(np.concatenate((still, drift))) for drift in drifts])

    def _rates_of_ghosts(self, velocity: Floats) -> Floats:
        """Return the rates of volume of ghost velocities (n + g, 3) [m/s], with zero sum, shape (n,) [m^3/s]."""
        return self.balanced(self.space.volumes * kernels.divergence(*self.space.rows, velocity))

    def twists(self, velocity: Floats, floating: Collection[int]) -> dict[int, Floats]:
        """Return the twists of floating plates that belong to a velocity field.

        Args:
            velocity: Velocity, shape (n, 3) [m/s].
            floating: Indices of the floating plates.

        Returns:
            Twists by the index of the plate, shape (6,) [m/s, rad/s].
        """
        if (modes := self.space.floating) is None:
            return {wall: np.zeros(6) for wall in floating}
        twists = np.tensordot(modes.amplitudes(velocity), modes.twists, 1)
        return {wall: twists[wall] for wall in floating}

    def _wall_drag(self) -> Floats:
        """Return the friction force that moving walls exert on particles at rest, shape (n, 3) [N]."""
        still = np.zeros_like(self.walls)
        return self.space.resistance(still, self.factors) - self.space.distribute(self.drag[:, None] * self.walls)

    @property
    def _constraint_parts(self) -> tuple[Floats, Floats]:
        """Nodal volumes and the gradient that they miss, for kernels."""
        return self.space.volumes, self.unbalanced

    def tension_stiffness(self, field: Floats) -> Floats:
        """Return K times a displacement field, without rigid-body motions and without a moment, shape (n, 3).

        K alone resists rotation, which a surface does not: a drop would be left turning on its wall.

        Args:
            field: Displacement, shape (n, 3) [m], or a velocity.
        """
        size, count = self.stiffness.shape[0], len(self.rigid)
        rigid, pull = self.rigid.reshape(count, field.size), np.zeros(field.size)
        moving = (rigid @ self.momentum(field).ravel()) @ rigid
        pull[:size] = self.stiffness @ (field.ravel() - moving)[:size]
        return pull.reshape(-1, 3) - self.momentum(((rigid @ pull) @ rigid).reshape(-1, 3))

    def volume_rates(self, field: Floats) -> Floats:
        """Return B v, the rates of the nodal volumes, shape (n,) [m^3/s]; they sum to the rate of the enclosed volume.

        Args:
            field: Velocity, shape (n, 3) [m/s].
        """
        rates = kernels.rates_of_volume(self.space.rows, self.space.images, self._constraint_parts, field)
        drift = self.space.ghost_drift(field)
        return rates + self._rates_of_ghosts(np.concatenate((np.zeros_like(field), drift))) if drift.any() else rates

    def balanced(self, rates: Floats) -> Floats:
        """Return rates of shape (n,) less their sum, which is distributed by volume."""
        return rates - rates.sum() / self.space.volumes.sum() * self.space.volumes

    def pressure_forces(self, pressure: Floats) -> Floats:
        """Return B^T p, the forces of pressure coefficients of shape (n,) [Pa], shape (n, 3) [N]."""
        return kernels.pressure_forces(self.space.rows, self.space.images, self._constraint_parts, pressure)

    def lost_power(self, after_friction: Floats, field: Floats) -> LostPower:
        """Return the power of the friction forces in a velocity field.

        Args:
            after_friction: Velocity v1 that causes the friction forces, shape (n, 3) [m/s].
            field: Velocity in which their power is taken, shape (n, 3) [m/s].
        """
        smoothing, on_walls, inside = self.space.lost_power(after_friction, field, self.factors, self.walls)
        return LostPower(viscous=inside + on_walls, smoothing=smoothing)
