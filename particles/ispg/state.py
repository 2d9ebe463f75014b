"""State that one step of the Galerkin scheme hands to the next, and the prediction made from it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.data_file import fields_of
from reflowshock.particles.core.body import Body
from reflowshock.particles.ispg.energy_budget import EnergyLosses
from reflowshock.particles.ispg.galerkin_equations import GalerkinEquations
from reflowshock.particles.ispg.nodal_volumes import body_moments
from reflowshock.particles.ispg.rigid_motions import constrained_part, wall_velocities, with_momenta
from reflowshock.particles.ispg.step_kernels import projected
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.backward_difference import Base
from reflowshock.particles.steps.one_leg import OneLeg

# Mesh smoothing passes per unit strain of the liquid, and per period of the grid's capillary waves.
PASSES_PER_STRAIN, PASSES_PER_PERIOD = 5.0, 1.0


@dataclass(frozen=True, slots=True)
class GalerkinState:
    """State of the particles and plates at the end of a step.

    Attributes:
        points: Positions at the end of the step, before mesh smoothing and particle shifting, shape (n, 3) [m].
        centre: Centre of mass predicted from the momentum, shape (3,) [m].
        velocity: Velocity, shape (n, 3) [m/s].
        gradient: Velocity gradient, shape (n, 3, 3) [1/s].
        kinetic: Kinetic energy [J]; None before the first step.
        potential: Potential energy before mesh smoothing [J].
        pressure: Pressure coefficients, shape (n,) [Pa].
        acceleration: Acceleration by all forces except friction, shape (n, 3) [m/s^2].
        volumes: Volumes whose mass the particles carried in the step, shape (n,) [m^3].
        smoothing_passes: Number of mesh smoothing passes due after the step.
        momenta: Linear momentum [kg m/s] and angular momentum about the origin [kg m^2/s], shape (6,).
        momenta_change: Change of these momenta in the step, shape (6,).
        history: Displacement and velocity change of the step.
        losses: Energy losses since the start of the run.
        plates: Displacement in the step [m, rad], twist at its end [m/s, rad/s] and change of that twist, shape (3, 6),
            of each moving plate by its index.
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
    smoothing_passes: float
    momenta: Floats
    momenta_change: Floats
    history: OneLeg
    losses: EnergyLosses
    plates: Mapping[int, Floats] = field(default_factory=dict)

    @property
    def plate_displacements(self) -> dict[int, Floats]:
        """Displacement and rotation of each moving plate in the step, shape (6,) [m, rad]."""
        return {wall: motion[0] for wall, motion in self.plates.items()}

    @property
    def plate_twists(self) -> dict[int, Floats]:
        """Twist of each moving plate at the end of the step, shape (6,) [m/s, rad/s]."""
        return {wall: motion[1] for wall, motion in self.plates.items()}

    @classmethod
    def start(cls, body: Body, potential: float, losses: EnergyLosses | None = None) -> "GalerkinState":
        """Return the state before the first step of a body with a velocity and a potential energy [J]."""
        count = len(body.points)
        return cls(
            points=body.points,
            centre=find_centre(body),
            velocity=body.velocity,
            gradient=np.zeros((count, 3, 3)),
            kinetic=None,
            potential=potential,
            pressure=body.pressure,
            acceleration=np.zeros((count, 3)),
            volumes=np.zeros(count),
            smoothing_passes=1.0,
            momenta=np.zeros(6),
            momenta_change=np.zeros(6),
            history=OneLeg.start(count),
            losses=losses or EnergyLosses(),
        )

    def saved(self) -> dict[str, Any]:
        """Return the data that a checkpoint keeps."""
        return fields_of(self) | {
            "history": fields_of(self.history),
            "losses": fields_of(self.losses),
            "plates": {str(wall): motion for wall, motion in self.plates.items()},
        }

    @classmethod
    def restored(cls, saved: Mapping[str, Any]) -> "GalerkinState":
        """Return the state whose data ``saved`` returned."""
        history, losses = OneLeg(**saved["history"]), EnergyLosses(**saved["losses"])
        plates = {int(wall): motion for wall, motion in saved["plates"].items()}
        return cls(**{**saved, "history": history, "losses": losses, "plates": plates})

    def losses_before(self, kinetic: float, potential: float) -> EnergyLosses:
        """Return the losses up to the start of the next step, with those of mesh smoothing and of new particle masses.

        Args:
            kinetic: Kinetic energy with the masses of the next step [J].
            potential: Potential energy after mesh smoothing [J].
        """
        transfer = 0.0 if self.kinetic is None else self.kinetic - kinetic
        evening = self.potential - potential
        losses = self.losses
        return replace(losses, transfer=losses.transfer + transfer, evening=losses.evening + evening)

    def moved_to(
        self, body: Body, physics: Physics, projections: Floats, admitted: NDArray[np.bool_]
    ) -> "GalerkinState":
        """Return the state at the positions of the body after mesh smoothing and particle shifting.

        The velocity is continued linearly to the new positions. The body is translated in place to the centre of mass
        that its momentum predicts: mesh smoothing transfers volume from one side to the other, so that a drop would
        drift along its wall.

        Args:
            body: Liquid body; translated in place.
            physics: Effects that act on the body.
            projections: Projections onto the velocities that walls admit, shape (n, 3, 3).
            admitted: Whether walls admit a translation along each axis, shape (3,).
        """
        change = projected(self.gradient, body.points - self.points)
        body.points = body.points + np.where(admitted, self.centre - find_centre(body), 0.0)
        with_plates = constrained_part(projections, wall_velocities(body, self.plate_twists))
        velocity = projected(projections, self.velocity + change) + with_plates
        history = self.history.stopped(physics.pinned(body), wall_velocities(body, self.plate_displacements))
        acceleration = projected(projections, self.acceleration)
        return replace(self, points=body.points, velocity=velocity, acceleration=acceleration, history=history)

    def with_momenta(
        self, equations: GalerkinEquations, motions: Floats, admitted: NDArray[np.bool_]
    ) -> "GalerkinState":
        """Return the state with its velocity corrected to the momenta of the last step.

        Particle shifting and new masses change the momenta; uncorrected, a drop would slide on a frictionless wall.
        Lever arms refer to the predicted positions, where the forces are evaluated: the forces have no moment about
        these only.

        Args:
            equations: Equations at the predicted positions.
            motions: Rigid-body motions at these positions, shape (6, n, 3).
            admitted: Whether walls admit each of them, shape (6,).
        """
        if not admitted.any():
            return self
        basis = motions[admitted], equations.masses, equations.rigid
        velocity = with_momenta(*basis, self.velocity, self.momenta[admitted])
        change = with_momenta(*basis, self.history.velocity_change, self.momenta_change[admitted])
        return replace(self, velocity=velocity, history=replace(self.history, velocity_change=change))

    def pinned(self, body: Body, physics: Physics, projections: Floats) -> "GalerkinState":
        """Return the state with the particles at rest that contact lines have pinned since; the plates are at rest.

        Args:
            body: Liquid body.
            physics: Effects that act on the body, with the current state of the contact lines.
            projections: Projections onto the velocities that walls admit, shape (n, 3, 3).
        """
        history = self.history.stopped(physics.pinned(body), np.zeros_like(body.points))
        velocity, acceleration = (projected(projections, each) for each in (self.velocity, self.acceleration))
        return replace(self, velocity=velocity, acceleration=acceleration, history=history)


@dataclass(frozen=True, slots=True)
class Prediction:
    """Predicted positions of a step, where forces and operators are evaluated.

    Attributes:
        state: State at the end of the last step, with momentum restored.
        base: Start of the equivalent backward Euler step.
        prescribed: Mean twist of each plate on a prescribed path, shape (6,) [m/s, rad/s].
        floating: Predicted mean twist of each floating plate, shape (6,) [m/s, rad/s].
        velocity: Predicted velocity, shape (n, 3) [m/s].
        body: Liquid body at the predicted positions.
        equations: Equations at the predicted positions.
        motions: Rigid-body motions at the predicted positions, shape (6, n, 3).
    """

    state: GalerkinState
    base: Base
    prescribed: dict[int, Floats]
    floating: dict[int, Floats]
    velocity: Floats
    body: Body
    equations: GalerkinEquations
    motions: Floats

    @property
    def plate_twists(self) -> dict[int, Floats]:
        """Mean twist of each moving plate, shape (6,) [m/s, rad/s]."""
        return self.prescribed | self.floating


def find_centre(body: Body) -> Floats:
    """Return the centre of the volume of a liquid body, shape (3,) [m]."""
    volume, first, _ = body_moments(body)
    return first / volume


def smoothing_passes(gradient: Floats, frequency: float, time_step: float) -> float:
    """Return the number of mesh smoothing passes due after a step, a fraction of one pass or one.

    Distorted triangles have slightly more energy. A whole pass after every step, however short, would take that energy
    from an oscillation each time it distorts them: 5 % in two periods with 309 particles.

    Args:
        gradient: Velocity gradient, shape (n, 3, 3) [1/s].
        frequency: Frequency of the grid's capillary waves [1/s].
        time_step: Time step [s]; the number grows with the strain in it.
    """
    strain = 0.5 * time_step * (gradient + gradient.transpose(0, 2, 1))
    by_strain = PASSES_PER_STRAIN * float(np.sqrt((strain**2).sum(axis=(1, 2)).mean()))
    return min(1.0, by_strain + PASSES_PER_PERIOD * time_step * frequency)
