"""What a step of the Galerkin scheme leaves to the next one, and where the equations of that one hold."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.ispg.energy_budget import EnergyLosses
from reflowshock.particles.ispg.galerkin_equations import GalerkinEquations
from reflowshock.particles.ispg.nodal_volumes import body_moments
from reflowshock.particles.ispg.rigid_motions import held, wall_velocities, with_momenta
from reflowshock.particles.ispg.step_kernels import projected
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.backward_difference import Base
from reflowshock.particles.steps.one_leg import OneLeg

# Passes that even out the triangles: by the strain of the liquid, and by the time over that of the grid's waves.
EVENED_BY_STRAIN, EVENING_RATE = 5.0, 1.0


@dataclass(frozen=True, slots=True)
class GalerkinState:
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
    losses: EnergyLosses
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
    def start(cls, body: Body, potential: float, losses: EnergyLosses | None = None) -> "GalerkinState":
        """A body that starts with its velocity, and an energy of the forces [J]."""
        slope, start = np.zeros((len(body.points), 3, 3)), OneLeg.start(len(body.points))
        losses = losses or EnergyLosses()
        still, unknown = np.zeros(6), np.zeros(len(body.points))
        at_rest = (body.pressure, np.zeros((len(body.points), 3)), unknown, 1.0, still, still)
        return cls(body.points, centre(body), body.velocity, slope, None, potential, *at_rest, start, losses)

    def carried_losses(self, kinetic: float, potential: float) -> EnergyLosses:
        """Losses up to a step that starts with these energies [J], of new masses and of triangles that have moved."""
        transfer = 0.0 if self.kinetic is None else self.kinetic - kinetic
        evening = self.potential - potential
        losses = self.losses
        return replace(losses, transfer=losses.transfer + transfer, evening=losses.evening + evening)

    def carried_on(
        self, body: Body, physics: Physics, projections: Floats, admitted: NDArray[np.bool_]
    ) -> "GalerkinState":
        """The state of particles that are now elsewhere: with the velocity there, as projections `(n, 3, 3)` have it.

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

    def with_momenta(self, equations: GalerkinEquations, motions: Floats, kept: NDArray[np.bool_]) -> "GalerkinState":
        """The state with the momenta of the last steps along those of the rigid motions `(6, n, 3)` that are kept.

        Shifted particles and their new masses would change them: a drop would slide away on a wall with free slip.
        Levers are those of the positions that the forces are taken at, about which these have no moment: with others a
        drop would be left turning.
        """
        if not kept.any():
            return self
        along = motions[kept], equations.masses, equations.rigid
        velocity = with_momenta(*along, self.velocity, self.momenta[kept])
        change = with_momenta(*along, self.history.velocity_change, self.momenta_change[kept])
        return replace(self, velocity=velocity, history=replace(self.history, velocity_change=change))

    def stopped(self, body: Body, physics: Physics, projections: Floats) -> "GalerkinState":
        """The state of particles that edges hold now, by projections `(n, 3, 3)`: they have not moved; plates rest."""
        history = self.history.stopped(physics.pinned(body), np.zeros_like(body.points))
        velocity, acceleration = (projected(projections, each) for each in (self.velocity, self.acceleration))
        return replace(self, velocity=velocity, acceleration=acceleration, history=history)


@dataclass(frozen=True, slots=True)
class Prediction:
    """Where the equations of a step hold.

    Attributes:
        state: what the last step left, with the momenta along rigid motions that it had.
        base: start of the equivalent backward Euler step.
        given, guessed: mean twists of plates that are moved, and those predicted of plates that float, `(6,)`.
        guess: velocity of the prediction, `(n, 3)` [m/s].
        body: at the predicted positions.
        equations: there.
        motions: rigid ones there, `(6, n, 3)`.
    """

    state: GalerkinState
    base: Base
    given: dict[int, Floats]
    guessed: dict[int, Floats]
    guess: Floats
    body: Body
    equations: GalerkinEquations
    motions: Floats


def centre(body: Body) -> Floats:
    """Centre of the liquid `(3,)` [m]."""
    volume, first, _ = body_moments(body)
    return first / volume


def smoothing_passes(gradient: Floats, frequency: float, time_step: float) -> float:
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
