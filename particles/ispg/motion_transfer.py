"""Bodies made anew of others in the scheme ispg: they have their momenta, and what is lost of the energy is counted.

Where liquids meet or part, new surfaces and new particles replace the old ones, all at once; who makes them keeps the
volume and its centre. Here each new particle gets the velocities of the old ones around it, each continued to its place
with its gradient, so that motions that are linear in space come over as they are. The least motion that does so, a
rigid one, makes up for what is missing of the momenta. The time integration starts anew.
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
from reflowshock.particles.ispg.state import GalerkinState, centre
from reflowshock.particles.physics.physics import Physics

NEIGHBOURS = 8
NEAREST = 1e-3  # spacings


@dataclass(frozen=True, slots=True)
class MovingBody:
    """A body, what acts on it, and the solver that moves it."""

    body: Body
    physics: Physics
    solver: IspgStep

    @property
    def state(self) -> GalerkinState:
        """What its last step left; before the first, its velocity and what that makes."""
        if self.solver.state is not None:
            return self.solver.state
        equations, body = self.equations(), self.body
        state = GalerkinState.start(body, self.physics.energy(body))
        momenta = rigid_momenta(rigid_motions(body.points), equations.masses, body.velocity)
        gradient = equations.space.gradient(body.velocity)
        return replace(state, gradient=gradient, momenta=momenta, kinetic=equations.kinetic(body.velocity))

    @property
    def first_energy(self) -> float:
        """Energy of the forces before its first step [J]."""
        return self.physics.energy(self.body) if self.solver.state is None else self.solver.first_energy

    def equations(self, twists: Mapping[int, Floats] = AT_REST) -> GalerkinEquations:
        """Its masses and shape functions where it is, on plates with some twists `(6,)`."""
        state = self.solver.state or GalerkinState.start(self.body, 0.0)
        body, projections = self.body, self.physics.projections(self.body)
        admitted = admitted_motions(body.points, projections)
        step = PreparedIspgStep(self.solver, body, self.physics, state, 0.0, projections, admitted)
        return step.equations(body, 1.0, twists)


def transfer_motion(new: Sequence[MovingBody], old: Sequence[MovingBody]) -> None:
    """Give bodies, and their solvers, the motion and the ledger of those that they were made of.

    The first of the new ones gets the whole ledger: together they have that of the old ones.

    Args:
        new: not moved yet.
        old: what they were made of, as a whole.
    """
    states, twists = [part.state for part in old], [_twists(part.body, old) for part in new]
    equations = [part.equations(its) for part, its in zip(new, twists, strict=True)]
    velocities = [
        here.given + part.physics.admit(part.body, carried(part.body.points, old, states))
        for part, here in zip(new, equations, strict=True)
    ]
    momenta = sum((state.momenta for state in states), np.zeros(6))
    velocities = _with_momenta(new, equations, velocities, momenta)
    energy, behind = 0.0, _behind(old, states)
    for part, here, velocity, its in zip(new, equations, velocities, twists, strict=True):
        part.body.velocity = velocity
        own, motions = part.physics.energy(part.body), rigid_motions(part.body.points)
        part.solver.state = replace(
            GalerkinState.start(part.body, own),
            gradient=here.space.gradient(velocity),
            kinetic=here.kinetic(velocity),
            momenta=rigid_momenta(motions, here.masses, velocity),
            volumes=here.space.carried,
            centre=centre(part.body) + behind,
            plates={wall: np.stack((np.zeros(6), twist, np.zeros(6))) for wall, twist in its.items()},
        )
        part.solver.first_energy = 0.0
        energy += own + here.kinetic(velocity)
    now = [part.physics.energy(part.body) for part in old]
    evened = sum(state.potential - left for state, left in zip(states, now, strict=True))
    before = sum(now) + sum(state.kinetic or 0.0 for state in states)
    first, losses = new[0].solver, total_losses([state.losses for state in states])
    losses = replace(losses, evening=losses.evening + evened, rebuilding=losses.rebuilding + before - energy)
    first.first_energy = sum(part.first_energy for part in old)
    first.state = replace(first.state, losses=losses) if first.state else None


def _twists(body: Body, old: Sequence[MovingBody]) -> dict[int, Floats]:
    """Twists of the plates of a body, those on the same side of old ones."""
    moved = {part.body.plates[wall].side: twist for part in old for wall, twist in part.state.twists.items()}
    return {wall: moved[plate.side] for wall, plate in enumerate(body.plates) if plate.side in moved}


def _behind(old: Sequence[MovingBody], states: Sequence[GalerkinState]) -> Floats:
    """How far the centre of bodies is from where their momenta took it, `(3,)` [m]."""
    volumes = np.array([part.body.volume()[0] for part in old])
    ways = np.array([state.centre - centre(part.body) for part, state in zip(old, states, strict=True)])
    return volumes @ ways / volumes.sum()


def carried(points: Floats, old: Sequence[MovingBody], states: Sequence[GalerkinState]) -> Floats:
    """Velocities at points `(n, 3)` [m/s]: of the old particles around, weighed by the inverse distance."""
    places, velocities, gradients = (
        np.concatenate([getattr(state, name) for state in states]) for name in ("points", "velocity", "gradient")
    )
    nearness = NEAREST * min(part.body.cloud.spacing for part in old)
    distance, nearest = cKDTree(places).query(points, NEIGHBOURS)
    weight = 1.0 / np.maximum(distance, nearness)
    offset = points[:, None] - places[nearest]
    continued = velocities[nearest] + np.einsum("nkcd,nkd->nkc", gradients[nearest], offset)
    return (weight[..., None] * continued).sum(axis=1) / weight.sum(axis=1)[:, None]


def _with_momenta(
    new: Sequence[MovingBody], equations: Sequence[GalerkinEquations], velocities: Sequence[Floats], momenta: Floats
) -> list[Floats]:
    """Velocities with the momenta `(6,)` in all, as far as walls and edges admit a motion of all bodies."""
    kept = np.logical_and.reduce(
        [admitted_motions(part.body.points, part.physics.projections(part.body)) for part in new]
    )
    if not kept.any():
        return list(velocities)
    motions = [rigid_motions(part.body.points)[kept] for part in new]
    masses = [here.masses for here in equations]
    missing, inertia = momenta[kept].copy(), np.zeros((kept.sum(),) * 2)
    for motion, mass, velocity in zip(motions, masses, velocities, strict=True):
        missing -= rigid_momenta(motion, mass, velocity)
        inertia += np.array([rigid_momenta(motion, mass, one) for one in motion])
    amount = np.linalg.solve(inertia, missing)
    return [velocity + np.tensordot(amount, motion, 1) for velocity, motion in zip(velocities, motions, strict=True)]
