"""ISPG that holds: the paper's particles, MLS and pressure correction in a Galerkin form, with BDF2 in time.

Particles move with their own velocities v, which the shape functions N differentiate; nothing is interpolated from step
to step. What evening out and the shift of particles below the surface displace takes the velocity there. The smoothing
is part of the equations: a friction on v - N v, which vanishes for linear velocities, so that momentum and angular
momentum stay; its rate is a multiple of the frequency of the grid's capillary waves, whatever the time step.

As in `inertial_step`, forces and operators are taken at predicted positions, and the implicit surface tension acts on
the change of the velocity only.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.data_file import fields_of
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.core.surface_measure import cotangents
from reflowshock.particles.discretisation.lagged_cholesky import LaggedCholesky
from reflowshock.particles.ispg.galerkin import Galerkin
from reflowshock.particles.ispg.galerkin_equations import Flow, GalerkinEquations
from reflowshock.particles.ispg.nodal_volumes import wall_shares
from reflowshock.particles.ispg.normal_pull import has_friction, kept_share, normal_pull
from reflowshock.particles.ispg.past import GalerkinPast, LostEnergy, centre, with_step
from reflowshock.particles.ispg.rigid_motions import (
    TURN,
    admitted_motions,
    edges_turn,
    orthonormal,
    rigid_momenta,
    rigid_motions,
)
from reflowshock.particles.ispg.step_kernels import projected
from reflowshock.particles.physics.forces import SurfaceTension
from reflowshock.particles.physics.operators import Mass, NavierSlip, NoSlip, Viscosity
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.backward_difference import BackwardDifference, Base
from reflowshock.particles.steps.step_solver import Motion
from reflowshock.particles.steps.time_step import LARGEST_DISPLACEMENT
from reflowshock.particles.surface.contact_line import RubbingLine

SUPPORT = 1.5
# Of the frequency sqrt(gamma / (rho h^3)): what is rough follows what drives it, and the less the larger this rate is.
# At one frequency a swing loses three to five times as much; at twenty a zigzag of the surface dies away slowly.
SMOOTHING = 10.0
# Passes that even out the triangles: by the strain of the liquid, and by the time over that of the grid's waves.
EVENED_BY_STRAIN, EVENING_RATE = 5.0, 1.0
# A cube's vertices have eight and four triangles by turns, which are Delaunay: a vertex that keeps its eight stands out
# of a surface at rest by 4 % of a spacing, and drops of 5 an edge are 1 % too high with one at the top.
FLIP_WORTH = 0.1
# Of the energy of the forces: a rigid motion with less does not count where walls, being smooth, never end it.
SLIDING = 1e-6


@dataclass(slots=True)
class IspgStep:
    """The Galerkin scheme with memory of the last step.

    Attributes:
        past: what the last step left, None before the first.
        first_energy: of the forces and the motion before the first step [J].
        factors: of the pressure equation.
    """

    past: GalerkinPast | None = None
    first_energy: float = 0.0
    factors: LaggedCholesky = field(default_factory=LaggedCholesky)

    @property
    def support(self) -> float:
        """Radius of the neighbour list, in spacings: what the shift of the particles needs."""
        return SUPPORT

    @property
    def smoothing_passes(self) -> float:
        """How often the triangles are evened out after a step: the liquid takes them along."""
        return 1.0 if self.past is None else self.past.evening

    @property
    def flip_worth(self) -> float:
        """Enough to flip edges of squares."""
        return FLIP_WORTH

    @property
    def descends(self) -> bool:
        """No: the energy that falls is one of the surface and of the velocities."""
        return False

    @property
    def keeps_time(self) -> bool:
        """Always."""
        return True

    @property
    def flaw(self) -> None:
        """None."""
        return None

    def prepare(self, body: Body, physics: Physics, _neighbours: NeighbourList) -> "PreparedIspgStep":
        """Carry the velocity to where the particles are now; without inertia it is zero."""
        projections = physics.projections(body)
        if self.past is None:
            self.first_energy = physics.energy(body)
            self.past = GalerkinPast.start(body, self.first_energy)
        elif not physics.momenta:
            body.velocity = np.zeros_like(body.velocity)
            self.past = GalerkinPast.start(body, physics.energy(body), self.past.losses)
        admitted = admitted_motions(body.points, projections)
        if self.past.kinetic is not None:
            self.past = self.past.carried_on(body, physics, projections, admitted[:3])
        return PreparedIspgStep(self, body, physics, self.past, physics.energy(body), projections, admitted)

    @property
    def mass(self) -> sparse.csr_matrix:
        """Volumes that the particles carried in the last step, `(n, n)` [m^3]."""
        if self.past is None:
            raise ValueError("the first step gives the particles their volumes")
        return sparse.diags(self.past.volumes, format="csr")

    def stop(self, body: Body) -> None:
        """Bring the body to rest."""
        body.velocity, self.past = np.zeros_like(body.velocity), None

    def saved(self) -> dict[str, Any]:
        """What it remembers of earlier steps, for a checkpoint."""
        past = self.past
        kept = past and fields_of(past) | {"history": fields_of(past.history), "losses": fields_of(past.losses)}
        return {"past": kept, "first_energy": self.first_energy, "factors": self.factors.saved()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        past = saved["past"]
        if past:
            history, losses = BackwardDifference(**past["history"]), LostEnergy(**past["losses"])
            past = GalerkinPast(**{**past, "history": history, "losses": losses})
        self.past, self.first_energy = past, saved["first_energy"]
        self.factors.restore(saved["factors"])


@dataclass(frozen=True, slots=True)
class PreparedIspgStep:
    """A step from the body's current positions.

    Attributes:
        solver: remembers the step.
        body: the liquid body.
        physics: what acts on it.
        past: of the particles where they are now.
        energy: of the forces there [J].
        projections: `(n, 3, 3)` of velocities onto those that walls admit.
        admitted: `(6,)` which rigid motions walls admit.
    """

    solver: IspgStep
    body: Body
    physics: Physics
    past: GalerkinPast
    energy: float
    projections: Floats
    admitted: NDArray[np.bool_]

    def solve(self, time_step: float, volume: float) -> Motion:
        """Return the motion in a time step [s] that ends at a volume [m^3].

        Where contact lines rub on a wall, again until those vertices stand that its friction holds. Only the first time
        are any let go, so that this ends: others wait for the next step.

        Raises:
            SolveFailed: a linear solve failed.
            DegenerateStencil: a particle has too few neighbours.
            NoVolumes: the particles do not fill the body.
        """
        releases = True
        while True:
            motion = (self._held() if self._rubbing else self)._attempt(time_step, volume, releases)
            if motion is not None:
                return motion
            releases = False

    @property
    def _rubbing(self) -> list[RubbingLine]:
        return [line for line in self.physics.lines if isinstance(line, RubbingLine)]

    def _held(self) -> "PreparedIspgStep":
        """The step with what its contact lines hold now."""
        projections = self.physics.projections(self.body)
        return replace(
            self,
            body=replace(self.body, velocity=projected(projections, self.body.velocity)),
            past=self.past.held(self.body, self.physics, projections),
            projections=projections,
            admitted=admitted_motions(self.body.points, projections),
        )

    def _attempt(self, time_step: float, volume: float, releases: bool) -> Motion | None:
        """The motion with the vertices held that are; None where others are to be, and may be released."""
        body, past = self.body, self.past
        base = past.history.base(body.points, past.velocity, time_step)
        guess = self._guess(base)
        predicted = replace(body, points=base.points + base.time_step * guess)
        enclosed, slope = predicted.volume()
        equations = self.equations(predicted, base.time_step)
        motions = rigid_motions(predicted.points)
        if past.kinetic is not None:
            past, base = self._with_momenta(equations, base, motions)
        force = self._surface_force(predicted, equations) + base.time_step * equations.tension(guess)
        start = equations.predict(base.velocity, force, past.pressure)
        rate = (volume - enclosed) / base.time_step + float((slope * guess).sum())
        velocity, change = equations.project(start, rate, self.solver.factors)
        pressure = past.pressure + change
        if self._rubbing:
            needed = equations.holding(base.velocity, force, velocity, pressure) / self.tension
            changed = [line.settle(predicted, velocity, needed, releases) for line in self._rubbing]
            if any(changed):
                return None
        rubbed = time_step * self._line_loss(predicted, velocity)
        points = base.points + base.time_step * velocity
        history = BackwardDifference(points - body.points, velocity - past.velocity, time_step)
        mean_pressure = float(pressure @ equations.space.volumes / equations.space.volumes.sum())
        momenta = rigid_momenta(motions, equations.masses, velocity)
        if past.kinetic is not None and not self.admitted[TURN] and edges_turn(body, self.physics):
            momenta[TURN] = past.momenta[TURN]
        losses = self._carried_losses(equations, past.velocity)
        losses = with_step(losses, equations, base, (past.velocity, start, velocity), time_step)
        potential = self.physics.energy(replace(body, points=points))
        pull = force - base.time_step * equations.tension(equations.pulled(start, velocity))
        work = time_step * (float((pull * velocity).sum()) + rate * mean_pressure)
        gradient = equations.space.gradient(velocity)
        gain = np.zeros(6) if past.kinetic is None else momenta - past.momenta
        self.solver.past = GalerkinPast(
            points=points,
            centre=centre(body) + equations.masses @ history.displacement / equations.masses.sum(),
            velocity=velocity,
            gradient=gradient,
            kinetic=equations.kinetic(velocity),
            potential=potential,
            pressure=pressure,
            volumes=equations.space.carried,
            evening=_passes(gradient, equations.fluid, time_step),
            momenta=momenta,
            momenta_change=gain,
            history=history,
            losses=replace(
                losses,
                integration=losses.integration + self.energy - potential - work - rubbed,
                line=losses.line + rubbed,
            ),
        )
        return Motion(
            velocity=velocity,
            transport=history.displacement / time_step,
            pressure=equations.space.averages(pressure),
            surface_pressure=mean_pressure,
            twists={},
            iterations=self.solver.factors.iterations,
            drift=self._drift(equations, velocity),
        )

    def _drift(self, equations: GalerkinEquations, velocity: Floats) -> Floats | None:
        """The rigid part of a velocity `(n, 3)` [m/s]; None if walls end it or it could change the shape."""
        shares = rigid_momenta(equations.rigid, equations.masses, velocity)  # of an orthonormal basis
        if has_friction(self.physics) or 0.5 * float(shares @ shares) > SLIDING * abs(self.energy):
            return None
        return np.tensordot(shares, equations.rigid, axes=1)

    def _line_loss(self, body: Body, velocity: Floats) -> float:
        """Power [W] that the friction of contact lines takes from velocities `(n, 3)` [m/s]."""
        pulls = ((line.friction(body), body.cloud.rings[line.wall]) for line in self._rubbing)
        return -self.tension * sum(float((friction * velocity[ring]).sum()) for friction, ring in pulls)

    def _with_momenta(self, equations: GalerkinEquations, base: Base, motions: Floats) -> tuple[GalerkinPast, Base]:
        """The last velocity, and that of the base, with the momenta of the last steps along rigid motions `(6, n, 3)`.

        Shifted particles and their new masses would change them: a drop would slide away on a wall with free slip.
        Levers are those of the positions that the forces are taken at, about which these have no moment: with others a
        drop would be left turning.
        """
        past, kept, masses, basis = self.past, self.admitted, equations.masses, equations.rigid
        motions = motions[kept]
        # Momenta along the motions of the basis, by columns.
        moved = np.array([rigid_momenta(motions, masses, motion) for motion in basis]).T

        def corrected(velocity: Floats, momenta: Floats) -> Floats:
            missing = momenta[kept] - rigid_momenta(motions, masses, velocity)
            return velocity + np.tensordot(np.linalg.solve(moved, missing), basis, axes=1)

        if not kept.any():
            return past, base
        start = corrected(base.velocity, past.momenta + base.weight * past.momenta_change)
        return replace(past, velocity=corrected(past.velocity, past.momenta)), replace(base, velocity=start)

    def _surface_force(self, body: Body, equations: GalerkinEquations) -> Floats:
        """Forces of the surface of a body at other positions, `(n, 3)` [N]."""
        if has_friction(self.physics):
            kept = kept_share(self.past.gradient, equations.fluid.smoothing / SMOOTHING)
            return normal_pull(body, self.physics, equations.masses, kept)
        return self.physics.force(body)

    def _guess(self, base: Base) -> Floats:
        """Velocity of the prediction `(n, 3)` [m/s]: the last one, as far as a step may go."""
        velocity = self.body.velocity if self.physics.momenta else np.zeros_like(self.body.points)
        way = base.time_step * float(np.sqrt((velocity**2).sum(axis=1).max()))
        bound = LARGEST_DISPLACEMENT * self.body.cloud.spacing
        return velocity if way <= bound else bound / way * velocity

    def fluid(self, spacing: float) -> Flow:
        """What the liquid is made of, of particles at a spacing [m]."""
        parts = self.physics.operators
        density = sum(part.density for part in parts if isinstance(part, Mass))
        viscosity = sum(part.coefficient for part in parts if isinstance(part, Viscosity))
        return Flow(density, viscosity, SMOOTHING * float(np.sqrt(self.tension / (density * spacing**3))))

    @property
    def tension(self) -> float:
        """Surface tension of the liquid [N/m]."""
        return sum(part.coefficient for part in self.physics.operators if isinstance(part, SurfaceTension))

    def equations(self, body: Body, time_step: float) -> GalerkinEquations:
        """The equations of a body at other positions, for a time step [s]."""
        fluid = self.fluid(body.cloud.spacing)
        friction = sum(part.coefficient for part in self.physics.frictions if isinstance(part, NavierSlip))
        held = any(isinstance(hold, NoSlip) for hold in self.physics.holds)
        slip = fluid.viscosity / friction if friction else np.inf
        space, spacing = Galerkin.of(body, 0.0 if held else slip), body.cloud.spacing
        rigid = rigid_motions(body.points)[self.admitted]
        return GalerkinEquations(
            space=space,
            fluid=fluid,
            admitted=self.projections,
            surface=(body.triangles, 0.5 * self.tension * cotangents(body.points, body.triangles)),
            spacing=spacing,
            rigid=orthonormal(rigid, fluid.density * space.carried),
            drag=friction * wall_shares(body, space.volumes) if friction else np.zeros(len(space.volumes)),
            unbalanced=body.volume()[1] - space.divergence_load(space.volumes),
            time_step=time_step,
        )

    def _carried_losses(self, equations: GalerkinEquations, velocity: Floats) -> LostEnergy:
        """Losses up to this step, which starts with new masses and a velocity `(n, 3)` [m/s]."""
        past, kinetic = self.past, equations.kinetic(velocity)
        if past.kinetic is None and kinetic:  # it starts in motion
            self.solver.first_energy = self.energy + kinetic
        transfer = 0.0 if past.kinetic is None else past.kinetic - kinetic
        evening = past.potential - self.energy
        losses = past.losses
        return replace(losses, transfer=losses.transfer + transfer, evening=losses.evening + evening)


def _passes(gradient: Floats, fluid: Flow, time_step: float) -> float:
    """Passes that even out triangles after a step [s] with a gradient of the velocity `(n, 3, 3)` [1/s].

    Uneven triangles have a little more energy. Where a whole pass follows each step, however short, it is taken from a
    swing each time that it strains them: 5 % in two periods, with 309 particles.
    """
    strain = 0.5 * time_step * (gradient + gradient.transpose(0, 2, 1))
    return min(
        1.0,
        EVENED_BY_STRAIN * float(np.sqrt((strain**2).sum(axis=(1, 2)).mean()))
        + EVENING_RATE * time_step * fluid.smoothing / SMOOTHING,
    )
