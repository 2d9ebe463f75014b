"""What a step of the Galerkin scheme leaves to the next one, and the energies that the steps so far have lost."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.ispg.galerkin_equations import GalerkinEquations
from reflowshock.particles.ispg.nodal_volumes import body_moments
from reflowshock.particles.ispg.rigid_motions import held, wall_velocities
from reflowshock.particles.ispg.step_kernels import projected
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.one_leg import OneLeg

# Passes that even out the triangles: by the strain of the liquid, and by the time over that of the grid's waves.
EVENED_BY_STRAIN, EVENING_RATE = 5.0, 1.0


@dataclass(frozen=True, slots=True)
class LostEnergy:
    """Energies that a flow has lost [J].

    Attributes:
        viscous: to viscosity, in the liquid and on its walls.
        smoothing: to the smoothing of velocities.
        integration: to the time integration: of the momentum, and of the way that the forces act along.
        transfer: to the shift of particles, which take the velocity where they come, and to new masses.
        evening: to what keeps triangles well shaped, at the volume.
        rebuilding: to bodies made anew, where liquids meet or part.
        line: to the friction of contact lines on walls with hysteresis.
        plates: to plates that are moved; negative where they give work to the liquid.
    """

    viscous: float = 0.0
    smoothing: float = 0.0
    integration: float = 0.0
    transfer: float = 0.0
    evening: float = 0.0
    rebuilding: float = 0.0
    line: float = 0.0
    plates: float = 0.0

    @property
    def total(self) -> float:
        """All of them."""
        return float(sum(getattr(self, entry.name) for entry in fields(self)))


def total_losses(losses: Sequence[LostEnergy]) -> LostEnergy:
    """Losses of several flows, each by its kind."""
    return LostEnergy(*(sum(getattr(one, entry.name) for one in losses) for entry in fields(LostEnergy)))


@dataclass(frozen=True, slots=True)
class GalerkinPast:
    """What the last step left.

    Attributes:
        points: `(n, 3)` where it took the particles [m].
        centre: `(3,)` to which its momentum took that of the liquid [m].
        velocity: `(n, 3)` of the particles [m/s].
        gradient: `(n, 3, 3)` of the velocity [1/s].
        kinetic, potential: energies after it, before triangles were evened out [J]; None before the first step.
        pressure: `(n,)` coefficients [Pa].
        acceleration: `(n, 3)` by all forces but friction [m/s^2].
        volumes: `(n,)` that the particles carried in it [m^3].
        evening: passes that even out the triangles after the next step.
        momenta: `(6,)` linear [kg m/s] and angular about the origin [kg m^2/s].
        momenta_change: of these in it, `(6,)`.
        history: its displacement and change of the velocity.
        losses: of all steps.
        plates: `(3, 6)` displacement in the last step, twist at its end and change of that in it, of each plate that
            moved, by its index.
    """

    points: Floats
    centre: Floats
    velocity: Floats
    gradient: Floats
    kinetic: float | None
    potential: float
    pressure: Floats
    acceleration: Floats
    volumes: Floats
    evening: float
    momenta: Floats
    momenta_change: Floats
    history: OneLeg
    losses: LostEnergy
    plates: Mapping[int, Floats] = field(default_factory=dict)

    @property
    def ways(self) -> dict[int, Floats]:
        """Displacement and rotation of plates in the last step, `(6,)` [m, rad]."""
        return {wall: moved[0] for wall, moved in self.plates.items()}

    @property
    def twists(self) -> dict[int, Floats]:
        """Twists of plates at the end of the last step, `(6,)` [m/s, rad/s]."""
        return {wall: moved[1] for wall, moved in self.plates.items()}

    @classmethod
    def start(cls, body: Body, potential: float, losses: LostEnergy | None = None) -> "GalerkinPast":
        """A body that starts with its velocity, and an energy of the forces [J]."""
        slope, start = np.zeros((len(body.points), 3, 3)), OneLeg.start(len(body.points))
        losses = losses or LostEnergy()
        still, unknown = np.zeros(6), np.zeros(len(body.points))
        at_rest = (body.pressure, np.zeros((len(body.points), 3)), unknown, 1.0, still, still)
        return cls(body.points, centre(body), body.velocity, slope, None, potential, *at_rest, start, losses)

    def carried_losses(self, kinetic: float, potential: float) -> LostEnergy:
        """Losses up to a step that starts with these energies [J], of new masses and of triangles that have moved."""
        transfer = 0.0 if self.kinetic is None else self.kinetic - kinetic
        evening = self.potential - potential
        losses = self.losses
        return replace(losses, transfer=losses.transfer + transfer, evening=losses.evening + evening)

    def carried_on(
        self, body: Body, physics: Physics, projections: Floats, admitted: NDArray[np.bool_]
    ) -> "GalerkinPast":
        """The past of particles that are now elsewhere: with the velocity there, as projections `(n, 3, 3)` have it.

        The body is put where its momentum took its centre, along axes that walls admit `(3,)`: evening out triangles
        gives volume to one side and takes it from another, and would let a drop wander over its wall.
        """
        change = projected(self.gradient, body.points - self.points)
        body.points = body.points + np.where(admitted, self.centre - centre(body), 0.0)
        with_plates = held(projections, wall_velocities(body, self.twists))
        velocity = projected(projections, self.velocity + change) + with_plates
        history = self.history.stopped(physics.pinned(body), wall_velocities(body, self.ways))
        acceleration = projected(projections, self.acceleration)
        return replace(self, points=body.points, velocity=velocity, acceleration=acceleration, history=history)

    def stopped(self, body: Body, physics: Physics, projections: Floats) -> "GalerkinPast":
        """The past of particles that edges hold now, by projections `(n, 3, 3)`: they have not moved; plates rest."""
        history = self.history.stopped(physics.pinned(body), np.zeros_like(body.points))
        velocity, acceleration = (projected(projections, each) for each in (self.velocity, self.acceleration))
        return replace(self, velocity=velocity, acceleration=acceleration, history=history)


def centre(body: Body) -> Floats:
    """Centre of the liquid `(3,)` [m]."""
    volume, first, _ = body_moments(body)
    return first / volume


@dataclass(frozen=True, slots=True)
class StepMotion:
    """What acted in a step, `(n, 3)`.

    Attributes:
        rubbed: velocity that friction acted on [m/s].
        acceleration: [m/s^2].
        transport: velocity that moved the particles [m/s].
    """

    rubbed: Floats
    acceleration: Floats
    transport: Floats


def with_step(
    losses: LostEnergy,
    equations: GalerkinEquations,
    velocities: tuple[Floats, Floats],
    acting: StepMotion,
    time_step: float,
) -> LostEnergy:
    """Losses with those of a step [s], but for the way that the forces act along.

    The velocities `(n, 3)` are those before and after it [m/s].

    Of the time integration: what the change of momentum takes beyond the change of kinetic energy.
    """
    last, now = velocities
    power = equations.losses(acting.rubbed, acting.transport)
    change = time_step * float((acting.transport * equations.momentum(acting.acceleration)).sum())
    gain = equations.kinetic(now) - equations.kinetic(last)
    return replace(
        losses,
        viscous=losses.viscous + time_step * power.viscous,
        smoothing=losses.smoothing + time_step * power.smoothing,
        integration=losses.integration + change - gain,
    )


def evening_passes(gradient: Floats, frequency: float, time_step: float) -> float:
    """Passes that even out triangles after a step [s] with a gradient of the velocity `(n, 3, 3)` [1/s].

    Uneven triangles have a little more energy. Where a whole pass follows each step, however short, it is taken from a
    swing each time that it strains them: 5 % in two periods, with 309 particles.

    Args:
        gradient: of the velocity.
        frequency: of the grid's capillary waves [1/s].
        time_step: the step.
    """
    strain = 0.5 * time_step * (gradient + gradient.transpose(0, 2, 1))
    by_strain = EVENED_BY_STRAIN * float(np.sqrt((strain**2).sum(axis=(1, 2)).mean()))
    return min(1.0, by_strain + EVENING_RATE * time_step * frequency)
