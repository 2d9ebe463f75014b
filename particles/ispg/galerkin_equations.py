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

Where walls move, velocities are v = q + w: w what walls prescribe, the velocity of a wall across it and of what it
holds, q what they admit. Images move with their walls (`Ghosts.drift`), friction acts on what slides on them.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.discretisation.effective_mass import EffectiveMass
from reflowshock.particles.discretisation.lagged_cholesky import (
    Apply,
    Band,
    LaggedCholesky,
    Tolerance,
    conjugate_gradients,
)
from reflowshock.particles.discretisation.schur_complement import SchurComplement, VolumeRateRows
from reflowshock.particles.ispg import step_kernels as kernels
from reflowshock.particles.ispg.galerkin_space import GalerkinSpace
from reflowshock.particles.ispg.moving_plates import FloatingModes
from reflowshock.particles.ispg.rigid_motions import rigid_part, wall_velocities
from reflowshock.particles.steps.descent import ARRIVED

Drive = Callable[[Floats, Floats], Floats]
# Of a spacing or of a particle's volume in a step: errors of the solves that are not worth an iteration.
NEGLIGIBLE = 1e-9
MOMENTUM_TOLERANCE, VOLUME_TOLERANCE = 1e-7, 1e-5


@dataclass(frozen=True, slots=True)
class LiquidProperties:
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
        walls: `(n, 3)` velocities that walls prescribe at the particles on them [m/s], zero elsewhere.
        unbalanced: `(n, 3)` gradient of the body's volume, less that of all volumes of particles [m^2].
        spacing: of the particles [m].
        time_step: [s].
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

    def slide(self, velocity: Floats, most: float) -> Floats | None:
        """The rigid part of a velocity `(n, 3)` [m/s]; None where its kinetic energy is more than the most [J]."""
        part = rigid_part(self.rigid, self.masses, velocity)
        return part if self.kinetic(part) <= most else None

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
        load = self.momentum(velocity) / self.time_step + force
        if self.walls.any() or self.space.drift.any():
            load -= self._carried_along()
        parts = (self.space.rows, self.space.images)
        operator: Apply = partial(kernels.friction_operator, *parts, (inertia, self.factors, self.admitted))
        right, begun = kernels.projected(self.admitted, load), kernels.projected(self.admitted, velocity) + self.given
        if (riders := self.space.riders) is not None:
            unheld = np.broadcast_to(np.eye(3), self.admitted.shape).copy()
            operator = self._ridden(riders, partial(kernels.friction_operator, *parts, (inertia, self.factors, unheld)))
            right = self._admitted_load(riders, load, np.zeros(len(riders.loads)))
            begun = begun + riders.along(velocity)
        solution, _ = conjugate_gradients(
            operator,
            right,
            begun,
            lambda residual: inverse * residual,
            Tolerance(MOMENTUM_TOLERANCE, mean * np.sqrt(len(force))),
        )
        return solution

    def driver(self) -> Drive:
        """How forces `(n, 3)` [N], and more on plates that float `(k,)`, move masses and surface in a step from rest.

        The velocity `(n, 3)` [m/s] is one that walls admit, with those of plates that float.
        """

        def admitted(force: Floats) -> Floats:
            return self.inertia.solve(kernels.projected(self.admitted, force).ravel()).reshape(-1, 3)

        riders = self.space.riders
        if riders is None:
            return lambda force, _: admitted(force)
        pulls = self.time_step * np.array([self.tension(field) for field in riders.fields])
        taken = np.array([admitted(pull) for pull in pulls])
        resisting = np.tensordot(pulls, riders.fields - taken, ((1, 2), (1, 2))) + np.eye(len(pulls)) / self.time_step

        def drive(force: Floats, on_plates: Floats) -> Floats:
            field = admitted(force)
            load = np.tensordot(riders.fields, force, 2) + on_plates - np.tensordot(pulls, field, 2)
            return field + np.tensordot(np.linalg.solve(resisting, load), riders.fields - taken, 1)

        return drive

    def beyond_given(self, load: Floats) -> Floats:
        """Forces `(n, 3)` [N] less what velocities that walls prescribe take of them."""
        given = self.given
        return load - self.momentum(given) / self.time_step - self.time_step * self.tension(given)

    def on_images(self, pressure: Floats) -> Floats:
        """What pressures `(n,)` [Pa] on images add to the forces on plates that float `(k,)`."""
        return self._image_rates() @ pressure

    def on_plates(self, pressure: Floats) -> Floats:
        """The same with the loads on them."""
        return self.on_images(pressure) + (0.0 if self.space.riders is None else self.space.riders.loads)

    def project(self, start: Floats, rate: float, factors: LaggedCholesky, drive: Drive) -> Floats:
        """Pressure `(n,)` [Pa] that takes the divergence away from a velocity.

        Args:
            start: the velocity, `(n, 3)` [m/s].
            rate: of the body's volume [m^3/s].
            factors: of an earlier pressure equation.
            drive: of `driver`.

        Raises:
            SolveFailed: the linear solve failed.
        """
        volumes = self.space.volumes
        missing = rate * volumes / volumes.sum() - self.constraint(start)
        enough = NEGLIGIBLE * float(volumes.mean()) / self.time_step * np.sqrt(len(missing))
        return factors.solve(*self.pressure_equation(drive), missing, Tolerance(VOLUME_TOLERANCE, enough))

    def pressure_equation(self, drive: Drive) -> tuple[Apply, Callable[[], Band]]:
        """Rates of volume under pressures, A, and what makes a band of it to factor.

        The band is without what nodal integration misses, and has K by its diagonal only. Plates that float add a rank
        each to A.
        """
        space, images, riders = self.space, self._image_rates(), self.space.riders
        rates = VolumeRateRows(*kernels.admitted_rates(space.rows, space.images, space.volumes, self.admitted))
        missed = space.volumes / space.volumes.sum(), kernels.projected(self.admitted, self.unbalanced)
        still = np.zeros_like(self.walls)
        moved = [drive(still, unit) for unit in np.eye(len(images))]
        columns = np.array([self._admitted_rates(field, images) for field in moved]).reshape(-1, len(still)).T
        core = np.zeros((0, 0)) if riders is None else np.linalg.inv([riders.rates(field) for field in moved])
        operator = SchurComplement.of(rates, missed, self.inertia, (columns, core))
        return operator, lambda: rates.band(self._stiffness_of_particles(), space.order)

    def _stiffness_of_particles(self) -> Floats:
        """The diagonal of m / dt + dt K, `(n, 3)` [kg/s]."""
        stiff = np.repeat(self.masses / self.time_step, 3)
        stiff[: self.stiffness.shape[0]] += self.time_step * self.stiffness.diagonal()
        return stiff.reshape(-1, 3)

    def _admitted_rates(self, field: Floats, images: Floats) -> Floats:
        """Rates of volume `(n,)` of a velocity that walls admit, with those of images `(k, n)` of plates that float."""
        rates = kernels.rates_of_volume(self.space.rows, self.space.images, self._parts, field)
        riders = self.space.riders
        return rates if riders is None else rates + riders.rates(field) @ images

    def _ridden(self, riders: FloatingModes, operator: Apply) -> Apply:
        """An operator on velocities `(n, 3)` that walls admit, with those of plates that float and of their images.

        The forces on images that a motion of a plate makes have a power in the others, and on the particles.
        """
        drifts, still = riders.drifts, np.zeros_like(self.walls)
        stresses = [
            kernels.resistance(*self.space.rows, np.concatenate((still, drift)), self.factors) for drift in drifts
        ]
        forces = np.array([kernels.folded(stress, *self.space.images) for stress in stresses])
        among = np.tensordot(np.array(stresses)[:, len(still) :], drifts, ((1, 2), (1, 2)))

        def ridden(field: Floats) -> Floats:
            rates = riders.rates(field)
            force = operator(field) + np.tensordot(rates, forces, 1)
            return self._admitted_load(riders, force, np.tensordot(forces, field, 2) + among @ rates)

        return ridden

    def _admitted_load(self, riders: FloatingModes, force: Floats, on_images: Floats) -> Floats:
        """Forces `(n, 3)` that walls admit; on plates that float by these, and by more `(k,)` on images and plates."""
        on_plates = np.tensordot(riders.fields, force, 2) + on_images
        return kernels.projected(self.admitted, force) + np.tensordot(on_plates, riders.momenta, 1)

    def _image_rates(self) -> Floats:
        """Rates of volume `(k, n)` that images of plates that float make."""
        if self.space.riders is None:
            return np.zeros((0, len(self.walls)))
        still, drifts = np.zeros_like(self.walls), self.space.riders.drifts
        return np.array([self._rates_of_images(np.concatenate((still, drift))) for drift in drifts])

    def _rates_of_images(self, images: Floats) -> Floats:
        """Rates of volume `(n,)` of velocities of images alone `(n + g, 3)`, none in all."""
        return self._balanced(self.space.volumes * kernels.divergence(*self.space.rows, images))

    def twists(self, velocity: Floats, floating: Collection[int]) -> dict[int, Floats]:
        """Twists `(6,)` of the plates that float, of a velocity `(n, 3)` [m/s]."""
        if (riders := self.space.riders) is None:
            return {wall: np.zeros(6) for wall in floating}
        found = np.tensordot(riders.rates(velocity), riders.twists, 1)
        return {wall: found[wall] for wall in floating}

    @property
    def given(self) -> Floats:
        """Velocities `(n, 3)` that walls prescribe [m/s]."""
        return self.walls - kernels.projected(self.admitted, self.walls)

    def _carried_along(self) -> Floats:
        """What resists particles at rest next to walls that move `(n, 3)` [N]."""
        still = np.zeros_like(self.walls)
        return self.space.resistance(still, self.factors) - self.space.shown(self.drag[:, None] * self.walls)

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
        """B v: rates of volume `(n,)` [m^3/s]; they add up to that of the enclosed volume."""
        rates = kernels.rates_of_volume(self.space.rows, self.space.images, self._parts, field)
        driven = self.space.driven(field)
        return rates + self._rates_of_images(np.concatenate((np.zeros_like(field), driven))) if driven.any() else rates

    def _balanced(self, rates: Floats) -> Floats:
        """Rates `(n,)` less their sum, which is shared out by the volumes."""
        return rates - rates.sum() / self.space.volumes.sum() * self.space.volumes

    def push(self, pressure: Floats) -> Floats:
        """B^T p, [N]."""
        return kernels.pressure_forces(self.space.rows, self.space.images, self._parts, pressure)

    def losses(self, start: Floats, field: Floats) -> LostPower:
        """What a velocity loses to the friction on v1, the start."""
        smoothing, on_walls, inside = self.space.lost_power((start, field), self.factors, self.walls)
        return LostPower(viscous=inside + on_walls, smoothing=smoothing)

    def reaction(
        self, velocities: tuple[Floats, Floats, Floats], force: Floats, pressure: Floats
    ) -> tuple[Floats, Floats]:
        """Forces of walls that hold or rub the liquid: at particles `(n, 3)` and, by stress, at images `(g, 3)` [N].

        Their power in the velocity of a wall there, `Ghosts.drift` at the images, is what it gives the liquid.

        Args:
            velocities: that the step started with, that friction acted on, and the projected one, `(n, 3)` [m/s].
            force: with that of the surface tension in the prediction, `(n, 3)` [N].
            pressure: that has acted, `(n,)` [Pa].
        """
        (before, start, now), space, count = velocities, self.space, len(force)
        rows, volumes = space.rows, space.volumes
        rub = self.drag[:, None] * (start - space.rough(start) - self.walls)
        stress = kernels.resistance(*rows, space.with_images(start), self.factors)
        stress -= space.shape.T @ (self.drag[:, None] * self.walls)
        inertia = self.momentum(now - before) / self.time_step
        pull = force - self.time_step * self.tension(now) + self.push(pressure)
        missing = inertia + kernels.folded(stress, *space.images) - pull
        thrust = np.zeros_like(stress)
        kernels.divergence_transposed(*rows, self._balanced(volumes * pressure), thrust)
        return missing - kernels.projected(self.admitted, missing) - rub, (stress - thrust)[count:]

    def power(self, body: Body, twists: Mapping[int, Floats], forces: tuple[Floats, Floats]) -> float:
        """Power [W] of the forces of `reaction` where the plates of the body have some twists `(6,)`."""
        on_walls, on_images = forces
        at_walls, at_images = wall_velocities(body, twists), self.space.drift_of(body, twists)
        return float((on_walls * at_walls).sum() + (on_images * at_images).sum())

    def work(self, body: Body, ways: Mapping[int, Floats], forces: tuple[Floats, Floats]) -> tuple[float, float]:
        """Work [J] of these forces on plates that go some ways `(6,)` [m, rad], and the mean force along them [N].

        There is no such force where they have arrived.
        """
        done, way = self.power(body, ways, forces), float(np.linalg.norm([way[:3] for way in ways.values()]))
        return done, done / way if way > ARRIVED * body.cloud.spacing else float("nan")


def admitted_stiffness(stiffness: sparse.bsr_matrix, admitted: Floats) -> sparse.bsr_matrix:
    """Stiffness `(3 s, 3 s)` by particle to velocities of the first s that walls admit by projections `(n, 3, 3)`."""
    blocks = kernels.projected_blocks(stiffness.indptr, stiffness.indices, stiffness.data, admitted)
    return sparse.bsr_matrix((blocks, stiffness.indices, stiffness.indptr), shape=stiffness.shape)
