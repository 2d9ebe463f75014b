"""Transfer of velocity, momentum and energy losses from old bodies to remeshed ones.

Where liquids merge or detach, new surfaces and particles replace the old ones; volume and centre of volume are kept by
the remeshing. Each new particle takes the velocities of the old particles around it, continued linearly with their
gradients and weighted by the inverse distance, so that linear velocity fields are transferred exactly. A rigid-body
motion restores the total momenta. The time integration restarts, and the energy difference is a remeshing loss.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.ispg.energy_budget import total_losses
from reflowshock.particles.ispg.galerkin_equations import GalerkinEquations
from reflowshock.particles.ispg.galerkin_space import AT_REST
from reflowshock.particles.ispg.ispg_step import IspgStep, PreparedIspgStep
from reflowshock.particles.ispg.rigid_motions import admitted_motions, rigid_momenta, rigid_motions
from reflowshock.particles.ispg.state import GalerkinState, find_centre
from reflowshock.particles.physics.physics import Physics

NEIGHBOURS = 8
NEAREST = 1e-3  # spacings


@dataclass(frozen=True, slots=True)
class MovingBody:
    """Liquid body in motion.

    Attributes:
        body: Particles and surface.
        physics: Effects that act on the body.
        solver: Step solver with the state of the last step.
    """

    body: Body
    physics: Physics
    solver: IspgStep

    @property
    def state(self) -> GalerkinState:
        """State of the last step; before the first step, the state that follows from the velocity."""
        if self.solver.state is not None:
            return self.solver.state
        equations, body = self.equations(), self.body
        state = GalerkinState.start(body, self.physics.energy(body))
        momenta = rigid_momenta(rigid_motions(body.points), equations.masses, body.velocity)
        gradient, kinetic = equations.space.gradient(body.velocity), equations.kinetic_energy(body.velocity)
        return replace(state, gradient=gradient, momenta=momenta, kinetic=kinetic)

    @property
    def first_energy(self) -> float:
        """Energy before the first step [J]."""
        return self.physics.energy(self.body) if self.solver.state is None else self.solver.first_energy

    def equations(self, twists: Mapping[int, Floats] = AT_REST) -> GalerkinEquations:
        """Assemble the equations at the current positions, with their masses and shape functions.

        Args:
            twists: Twist of each moving plate by its index, shape (6,) [m/s, rad/s].
        """
        state = self.solver.state or GalerkinState.start(self.body, 0.0)
        body, projections = self.body, self.physics.projections(self.body)
        admitted = admitted_motions(body.points, projections)
        step = PreparedIspgStep(self.solver, body, self.physics, state, 0.0, projections, admitted)
        return step.equations(body, 1.0, twists)


def transfer_motion(new: Sequence[MovingBody], old: Sequence[MovingBody]) -> None:
    """Give remeshed bodies and their solvers the velocity, momentum and energy losses of the bodies that they replace.

    All losses are attributed to the first new body: only their sum over the bodies is meaningful.

    Args:
        new: Remeshed bodies (body, physics and step solver) before their first step; velocities and solver states are
            set in place.
        old: Bodies that they replace, in their last state; not changed.
    """
    states, twists = [part.state for part in old], [_plate_twists(part.body, old) for part in new]
    equations = [part.equations(of_plates) for part, of_plates in zip(new, twists, strict=True)]
    velocities = [
        system.prescribed + part.physics.admit(part.body, interpolate_velocity(part.body.points, states, _spacing(old)))
        for part, system in zip(new, equations, strict=True)
    ]
    momenta = sum((state.momenta for state in states), np.zeros(6))
    velocities = _with_momenta(new, equations, velocities, momenta)
    energy, lag = 0.0, _centre_lag(old, states)
    for part, system, velocity, of_plates in zip(new, equations, velocities, twists, strict=True):
        part.body.velocity = velocity
        potential, motions = part.physics.energy(part.body), rigid_motions(part.body.points)
        part.solver.state = replace(
            GalerkinState.start(part.body, potential),
            gradient=system.space.gradient(velocity),
            kinetic=system.kinetic_energy(velocity),
            momenta=rigid_momenta(motions, system.masses, velocity),
            volumes=system.space.carried,
            centre=find_centre(part.body) + lag,
            plates={wall: np.stack((np.zeros(6), twist, np.zeros(6))) for wall, twist in of_plates.items()},
        )
        part.solver.first_energy = 0.0
        energy += potential + system.kinetic_energy(velocity)
    potentials = [part.physics.energy(part.body) for part in old]
    by_smoothing = sum(state.potential - now for state, now in zip(states, potentials, strict=True))
    before = sum(potentials) + sum(state.kinetic or 0.0 for state in states)
    first, losses = new[0].solver, total_losses([state.losses for state in states])
    losses = replace(losses, evening=losses.evening + by_smoothing, rebuilding=losses.rebuilding + before - energy)
    first.first_energy = sum(part.first_energy for part in old)
    first.state = replace(first.state, losses=losses) if first.state else None


def _plate_twists(body: Body, old: Sequence[MovingBody]) -> dict[int, Floats]:
    """Return the twist of each plate of a body, taken from the plate of an old body on the same side."""
    moving = {part.body.plates[wall].side: twist for part in old for wall, twist in part.state.plate_twists.items()}
    return {wall: moving[plate.side] for wall, plate in enumerate(body.plates) if plate.side in moving}


def _centre_lag(old: Sequence[MovingBody], states: Sequence[GalerkinState]) -> Floats:
    """Return the vector from the centre of the bodies to the one predicted from their momenta, shape (3,) [m]."""
    volumes = np.array([part.body.volume()[0] for part in old])
    lags = np.array([state.centre - find_centre(part.body) for part, state in zip(old, states, strict=True)])
    return volumes @ lags / volumes.sum()


def _spacing(bodies: Sequence[MovingBody]) -> float:
    """Return the smallest particle spacing of some bodies [m]."""
    return min(part.body.cloud.spacing for part in bodies)


def interpolate_velocity(points: Floats, states: Sequence[GalerkinState], spacing: float) -> Floats:
    """Interpolate the velocity of old particles at new points, exactly for linear velocity fields.

    Args:
        points: New points, shape (n, 3) [m].
        states: States of the old bodies, with positions, shape (k, 3) [m], velocities and velocity gradients of their
            particles.
        spacing: Particle spacing, which bounds the inverse-distance weights [m].

    Returns:
        Velocity, shape (n, 3) [m/s].
    """
    sources, velocities, gradients = (
        np.concatenate([getattr(state, name) for state in states]) for name in ("points", "velocity", "gradient")
    )
    nearest_distance = NEAREST * spacing
    distance, nearest = cKDTree(sources).query(points, NEIGHBOURS)
    weight = 1.0 / np.maximum(distance, nearest_distance)
    offset = points[:, None] - sources[nearest]
    continued = velocities[nearest] + np.einsum("nkcd,nkd->nkc", gradients[nearest], offset)
    return (weight[..., None] * continued).sum(axis=1) / weight.sum(axis=1)[:, None]


def _with_momenta(
    new: Sequence[MovingBody], equations: Sequence[GalerkinEquations], velocities: Sequence[Floats], momenta: Floats
) -> list[Floats]:
    """Return the velocities plus a common rigid-body motion that gives the bodies the total momenta.

    Only motions that the walls and edges of all bodies admit are corrected.
    """
    admitted = np.logical_and.reduce(
        [admitted_motions(part.body.points, part.physics.projections(part.body)) for part in new]
    )
    if not admitted.any():
        return list(velocities)
    motions = [rigid_motions(part.body.points)[admitted] for part in new]
    masses = [system.masses for system in equations]
    missing, inertia = momenta[admitted].copy(), np.zeros((admitted.sum(),) * 2)
    for basis, mass, velocity in zip(motions, masses, velocities, strict=True):
        missing -= rigid_momenta(basis, mass, velocity)
        inertia += np.array([rigid_momenta(basis, mass, motion) for motion in basis])
    amount = np.linalg.solve(inertia, missing)
    return [velocity + np.tensordot(amount, basis, 1) for velocity, basis in zip(velocities, motions, strict=True)]
