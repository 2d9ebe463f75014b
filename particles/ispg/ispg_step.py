"""ISPG that holds: the paper's particles, MLS and pressure correction in a Galerkin form, with BDF2 in time.

Particles move with their own velocities v, which the shape functions N differentiate; nothing is interpolated from step
to step. What evening out and the shift of particles below the surface displace takes the velocity there. The smoothing
is part of the equations: a friction on v - N v, which vanishes for linear velocities, so that momentum and angular
momentum stay; its rate is a multiple of the frequency of the grid's capillary waves, whatever the time step.

As in `inertial_step`, forces and operators are taken at predicted positions, and the implicit surface tension acts on
the change of the velocity only.
"""

from collections.abc import Mapping, Sequence
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
from reflowshock.particles.ispg.galerkin import AT_REST, Galerkin
from reflowshock.particles.ispg.galerkin_equations import Flow, GalerkinEquations
from reflowshock.particles.ispg.nodal_volumes import wall_shares
from reflowshock.particles.ispg.normal_pull import has_friction, kept_share, normal_pull
from reflowshock.particles.ispg.past import GalerkinPast, LostEnergy, centre, evening_passes, with_step
from reflowshock.particles.ispg.rigid_motions import (
    TURN,
    Riders,
    admitted_motions,
    edges_turn,
    held,
    orthonormal,
    rigid_momenta,
    rigid_motions,
    rigid_part,
    wall_velocities,
    with_momenta,
)
from reflowshock.particles.ispg.step_kernels import projected
from reflowshock.particles.physics.forces import SurfaceTension
from reflowshock.particles.physics.operators import Mass, NavierSlip, NoSlip, Viscosity
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.backward_difference import BackwardDifference, Base
from reflowshock.particles.steps.descent import ARRIVED
from reflowshock.particles.steps.step_solver import Motion
from reflowshock.particles.steps.time_step import LARGEST_DISPLACEMENT
from reflowshock.particles.surface.contact_line import RubbingLine

SUPPORT = 1.5
# Of the frequency sqrt(gamma / (rho h^3)): what is rough follows what drives it, and the less the larger this rate is.
# At one frequency a swing loses three to five times as much; at twenty a zigzag of the surface dies away slowly.
SMOOTHING = 10.0
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
        kept = past and fields_of(past) | {
            "history": fields_of(past.history),
            "losses": fields_of(past.losses),
            "plates": {str(wall): moved for wall, moved in past.plates.items()},
        }
        return {"past": kept, "first_energy": self.first_energy, "factors": self.factors.saved()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        past = saved["past"]
        if past:
            history, losses = BackwardDifference(**past["history"]), LostEnergy(**past["losses"])
            plates = {int(wall): moved for wall, moved in past["plates"].items()}
            past = GalerkinPast(**{**past, "history": history, "losses": losses, "plates": plates})
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

        Again until those vertices stand that the friction of a wall holds; only the first time are any let go.

        Raises:
            SolveFailed: a linear solve failed.
            DegenerateStencil: a particle has too few neighbours.
            NoVolumes: the particles do not fill the body.
        """
        rubbing, releases = [line for line in self.physics.lines if isinstance(line, RubbingLine)], True
        while True:
            motion = (self._held() if rubbing else self)._attempt(time_step, volume, rubbing, releases)
            if motion is not None:
                return motion
            releases = False

    def _held(self) -> "PreparedIspgStep":
        """The step with what its contact lines hold now."""
        projections = self.physics.projections(self.body)
        return replace(
            self,
            body=replace(self.body, velocity=projected(projections, self.body.velocity)),
            past=self.past.stopped(self.body, self.physics, projections),
            projections=projections,
            admitted=admitted_motions(self.body.points, projections),
        )

    def _attempt(
        self, time_step: float, volume: float, rubbing: Sequence[RubbingLine], releases: bool
    ) -> Motion | None:
        """The motion with the vertices held that are; None where others are to be, and may be released."""
        body, past = self.body, self.past
        base = past.history.base(body.points, past.velocity, time_step)
        pace = self._pace(base)
        given, guessed = self._given_twists(base, time_step), self._guessed_twists(pace)
        twists = given | guessed
        guess = self._guess(pace, twists)
        predicted = body.placed(base.points + base.time_step * guess, self._ways(base, twists))
        enclosed, slope = predicted.volume()
        equations = self.equations(predicted, base.time_step, given)
        motions = rigid_motions(predicted.points)
        if past.kinetic is not None:
            past, base = self._with_momenta(equations, base, motions)
        force = self._surface_force(predicted, equations) + base.time_step * equations.tension(guess)
        start = equations.predict(base.velocity, force, past.pressure)
        rate = (volume - enclosed) / base.time_step + float((slope * guess).sum())
        velocity, change = equations.project(start, rate, self.solver.factors)
        pressure = past.pressure + change
        volumes = equations.space.volumes
        if given or rubbing:
            acting = pressure + equations.fluid.viscosity * equations.constraint(start) / volumes
            forces = equations.reaction((base.velocity, start, velocity), force, acting)
            changed = [line.settle(predicted, velocity, forces[0] / self.tension, releases) for line in rubbing]
            if any(changed):
                return None
        rubbed = time_step * self.tension * sum(line.rubbed(predicted, velocity) for line in rubbing)
        twists = given | equations.twists(velocity, guessed)
        ways = self._ways(base, twists)
        moved = body.placed(base.points + base.time_step * velocity, ways)
        history = BackwardDifference(moved.points - body.points, velocity - past.velocity, time_step)
        mean_pressure = float(pressure @ volumes / volumes.sum())
        momenta = rigid_momenta(motions, equations.masses, velocity)
        if past.kinetic is not None and not self.admitted[TURN] and edges_turn(body, self.physics):
            momenta[TURN] = past.momenta[TURN]
        losses = self._carried_losses(equations, past.velocity)
        losses = with_step(losses, equations, base, (past.velocity, start, velocity), time_step)
        potential = self.physics.energy(moved)
        driving = force - base.time_step * equations.tension(equations.pulled(start, velocity))
        loads = sum(float(motion.load @ twists[motion.wall][:3]) for motion in self.physics.motions)
        work = time_step * (float((driving * velocity).sum()) + rate * mean_pressure + loads)
        done, pull = 0.0, float("nan")
        if given:
            done, pull = self._plate_work(predicted, equations, {wall: ways[wall] for wall in given}, forces)
            work += time_step * equations.power(predicted, given, forces) - done
        integration = losses.integration + self.energy - potential - work - rubbed
        losses = replace(losses, integration=integration, plates=losses.plates - done, line=losses.line + rubbed)
        gradient = equations.space.gradient(velocity)
        gain = np.zeros(6) if past.kinetic is None else momenta - past.momenta
        self.solver.past = GalerkinPast(
            points=moved.points,
            centre=centre(body) + equations.masses @ history.displacement / equations.masses.sum(),
            velocity=velocity,
            gradient=gradient,
            kinetic=equations.kinetic(velocity),
            potential=potential,
            pressure=pressure,
            volumes=equations.space.carried,
            evening=evening_passes(gradient, equations.fluid.smoothing / SMOOTHING, time_step),
            momenta=momenta,
            momenta_change=gain,
            history=history,
            losses=losses,
            plates={wall: np.stack((ways[wall], twist)) for wall, twist in twists.items()},
        )
        return Motion(
            velocity=velocity,
            transport=history.displacement / time_step,
            pressure=equations.space.averages(pressure),
            surface_pressure=mean_pressure,
            twists={wall: way / time_step for wall, way in ways.items()},
            iterations=self.solver.factors.iterations,
            pull=pull,
            drift=self._drift(equations, velocity),
        )

    def _drift(self, equations: GalerkinEquations, velocity: Floats) -> Floats | None:
        """The rigid part of a velocity `(n, 3)` [m/s]; None if walls end it or it could change the shape."""
        drift = rigid_part(equations.rigid, equations.masses, velocity)
        is_free = not has_friction(self.physics) and equations.kinetic(drift) <= SLIDING * abs(self.energy)
        return drift if is_free else None

    def _plate_work(
        self, body: Body, equations: GalerkinEquations, ways: dict[int, Floats], forces: tuple[Floats, Floats]
    ) -> tuple[float, float]:
        """Work of plates on their ways `(6,)` [J] by the forces of `GalerkinEquations.reaction`, mean force along them.

        There is no such force where they have arrived.
        """
        done, way = equations.power(body, ways, forces), float(np.linalg.norm([way[:3] for way in ways.values()]))
        return done, done / way if way > ARRIVED * body.cloud.spacing else float("nan")

    def _with_momenta(self, equations: GalerkinEquations, base: Base, motions: Floats) -> tuple[GalerkinPast, Base]:
        """The last velocity, and that of the base, with the momenta of the last steps along rigid motions `(6, n, 3)`.

        Shifted particles and their new masses would change them: a drop would slide away on a wall with free slip.
        Levers are those of the positions that the forces are taken at, about which these have no moment: with others a
        drop would be left turning.
        """
        past, kept, masses, basis = self.past, self.admitted, equations.masses, equations.rigid
        if not kept.any():
            return past, base
        along, carried = (motions[kept], masses, basis), past.momenta + base.weight * past.momenta_change
        velocity = with_momenta(*along, past.velocity, past.momenta[kept])
        return replace(past, velocity=velocity), replace(
            base, velocity=with_momenta(*along, base.velocity, carried[kept])
        )

    def _surface_force(self, body: Body, equations: GalerkinEquations) -> Floats:
        """Forces of the surface of a body at other positions, `(n, 3)` [N]."""
        if has_friction(self.physics):
            kept = kept_share(self.past.gradient, equations.fluid.smoothing / SMOOTHING)
            return normal_pull(body, self.physics, equations.masses, kept)
        return self.physics.force(body)

    def _carried(self, base: Base, wall: int) -> Floats:
        """How far the last step carries a plate on, `(6,)` [m, rad]."""
        return base.weight * self.past.ways.get(wall, np.zeros(6))

    def _given_twists(self, base: Base, time_step: float) -> dict[int, Floats]:
        """Twists `(6,)` of plates that are moved: after the whole step [s] these are where they should be."""
        moved = [motion for motion in self.physics.motions if not len(motion.directions)]
        ways = {motion.wall: time_step * motion.given(self.body.plates[motion.wall], time_step) for motion in moved}
        return {wall: (way - self._carried(base, wall)) / base.time_step for wall, way in ways.items()}

    def _guessed_twists(self, pace: float) -> dict[int, Floats]:
        """Twists `(6,)` of plates that float, in the prediction: the last ones, at a share of their pace."""
        walls = [motion.wall for motion in self.physics.motions if len(motion.directions)]
        return {wall: pace * self.past.twists.get(wall, np.zeros(6)) for wall in walls}

    def _ways(self, base: Base, twists: Mapping[int, Floats]) -> dict[int, Floats]:
        """Displacements and rotations of plates in the whole step `(6,)` [m, rad]."""
        return {wall: self._carried(base, wall) + base.time_step * twist for wall, twist in twists.items()}

    def _pace(self, base: Base) -> float:
        """Share of the last velocity that the prediction has: with more a particle would go too far in a step."""
        way = base.time_step * float(np.sqrt((self.body.velocity**2).sum(axis=1).max()))
        bound = LARGEST_DISPLACEMENT * self.body.cloud.spacing
        return 1.0 if way <= bound else bound / way

    def _guess(self, pace: float, twists: Mapping[int, Floats]) -> Floats:
        """Velocity of the prediction `(n, 3)` [m/s]: the last one, at a share of its pace, and that of plates."""
        velocity = pace * self.body.velocity if self.physics.momenta else np.zeros_like(self.body.points)
        if not twists:
            return velocity
        return projected(self.projections, velocity) + held(self.projections, wall_velocities(self.body, twists))

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

    def equations(self, body: Body, time_step: float, twists: Mapping[int, Floats] = AT_REST) -> GalerkinEquations:
        """The equations of a body at other positions, for a time step [s]; its plates move with twists `(6,)`."""
        fluid = self.fluid(body.cloud.spacing)
        friction = sum(part.coefficient for part in self.physics.frictions if isinstance(part, NavierSlip))
        clings = any(isinstance(hold, NoSlip) for hold in self.physics.holds)
        slip = fluid.viscosity / friction if friction else np.inf
        space, spacing = Galerkin.of(body, 0.0 if clings else slip, twists), body.cloud.spacing
        riders = Riders.of(self.physics.motions, body, self.projections, fluid.density * space.carried)
        if riders is not None:
            drifts = np.array([space.drift_of(body, dict(enumerate(twist))) for twist in riders.twists])
            space = replace(space, riding=(riders.momenta, drifts))
        rigid = rigid_motions(body.points)[self.admitted]
        return GalerkinEquations(
            space=space,
            fluid=fluid,
            admitted=self.projections,
            surface=(body.triangles, 0.5 * self.tension * cotangents(body.points, body.triangles)),
            spacing=spacing,
            rigid=orthonormal(rigid, fluid.density * space.carried),
            walls=wall_velocities(body, twists),
            riders=riders,
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
