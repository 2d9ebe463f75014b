"""ISPG that holds: the paper's particles, MLS and pressure correction in a Galerkin form, by a one-leg method in time.

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
from reflowshock.particles.core.surface_measure import area_stiffness
from reflowshock.particles.discretisation.effective_mass import EffectiveMass
from reflowshock.particles.discretisation.lagged_cholesky import LaggedCholesky
from reflowshock.particles.ispg.energy_budget import EnergyBudget, EnergyLosses, StepEnd, StepSolution
from reflowshock.particles.ispg.galerkin_equations import GalerkinEquations, LiquidProperties, admitted_stiffness
from reflowshock.particles.ispg.galerkin_space import AT_REST, GalerkinSpace
from reflowshock.particles.ispg.moving_plates import FloatingModes, PlateHistory
from reflowshock.particles.ispg.nodal_volumes import wall_shares
from reflowshock.particles.ispg.normal_forces import has_friction, normal_pull, tangential_share
from reflowshock.particles.ispg.rigid_motions import (
    TURN,
    admitted_motions,
    edges_are_coaxial,
    held,
    orthonormal,
    rigid_momenta,
    rigid_motions,
    wall_velocities,
)
from reflowshock.particles.ispg.state import GalerkinState, Prediction, centre, smoothing_passes
from reflowshock.particles.ispg.step_kernels import projected
from reflowshock.particles.physics.forces import SurfaceTension
from reflowshock.particles.physics.operators import Mass, NavierSlip, NoSlip, Viscosity
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.backward_difference import Base
from reflowshock.particles.steps.one_leg import OneLeg
from reflowshock.particles.steps.step_solver import Motion, SolverTraits
from reflowshock.particles.steps.time_step import LARGEST_DISPLACEMENT
from reflowshock.particles.surface.contact_line import RubbingLine

SUPPORT = 1.5
# Forces are predicted with the velocity of this part of a step before: with later ones modes that resist less than
# their stiffness K grow (linear analysis: from 0.17 on with RADIUS = 0.5, whatever the share of K).
GUESS_BEFORE = 0.25
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
        state: what the last step left, None before the first.
        first_energy: of the forces and the motion before the first step [J].
        factors: of the pressure equation.
    """

    state: GalerkinState | None = None
    first_energy: float = 0.0
    factors: LaggedCholesky = field(default_factory=LaggedCholesky)

    @property
    def traits(self) -> SolverTraits:
        """It does not descend: the energy that falls is one of the surface and of the velocities."""
        evening = 1.0 if self.state is None else self.state.evening
        return SolverTraits(SUPPORT, evening, FLIP_WORTH)

    def prepare(self, body: Body, physics: Physics, _neighbours: NeighbourList) -> "PreparedIspgStep":
        """Carry the velocity to where the particles are now; without inertia it is zero."""
        projections = physics.projections(body)
        if self.state is None:
            self.first_energy = physics.energy(body)
            self.state = GalerkinState.start(body, self.first_energy)
        elif not physics.momenta:
            body.velocity = np.zeros_like(body.velocity)
            self.state = GalerkinState.start(body, physics.energy(body), self.state.losses)
        admitted = admitted_motions(body.points, projections)
        if self.state.kinetic is not None:
            self.state = self.state.carried_on(body, physics, projections, admitted[:3])
        return PreparedIspgStep(self, body, physics, self.state, physics.energy(body), projections, admitted)

    @property
    def mass(self) -> sparse.csr_matrix:
        """Volumes that the particles carried in the last step, `(n, n)` [m^3]."""
        if self.state is None:
            raise ValueError("the first step gives the particles their volumes")
        return sparse.diags(self.state.volumes, format="csr")

    def stop(self, body: Body) -> None:
        """Bring the body to rest."""
        body.velocity, self.state = np.zeros_like(body.velocity), None

    def saved(self) -> dict[str, Any]:
        """What it remembers of earlier steps, for a checkpoint."""
        state = self.state
        kept = state and fields_of(state) | {
            "history": fields_of(state.history),
            "losses": fields_of(state.losses),
            "plates": {str(wall): moved for wall, moved in state.plates.items()},
        }
        return {"state": kept, "first_energy": self.first_energy, "factors": self.factors.saved()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        state = saved["state"]
        if state:
            history, losses = OneLeg(**state["history"]), EnergyLosses(**state["losses"])
            plates = {int(wall): moved for wall, moved in state["plates"].items()}
            state = GalerkinState(**{**state, "history": history, "losses": losses, "plates": plates})
        self.state, self.first_energy = state, saved["first_energy"]
        self.factors.restore(saved["factors"])


@dataclass(frozen=True, slots=True)
class PreparedIspgStep:
    """A step from the body's current positions.

    Attributes:
        solver: remembers the step.
        body: the liquid body.
        physics: what acts on it.
        state: of the particles where they are now.
        energy: of the forces there [J].
        projections: `(n, 3, 3)` of velocities onto those that walls admit.
        admitted: `(6,)` which rigid motions walls admit.
    """

    solver: IspgStep
    body: Body
    physics: Physics
    state: GalerkinState
    energy: float
    projections: Floats
    admitted: NDArray[np.bool_]

    def solve(self, time_step: float, volume: float) -> Motion:
        """Return the motion in a time step [s] that ends at a volume [m^3].

        Again until those vertices stand that the friction of a wall holds; only the first time are any let go.

        Raises:
            SolveFailed: a linear solve failed.
            DegenerateStencil: a particle has too few neighbours.
            NoNodalVolumes: the particles do not fill the body.
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
            state=self.state.stopped(self.body, self.physics, projections),
            projections=projections,
            admitted=admitted_motions(self.body.points, projections),
        )

    def _attempt(
        self, time_step: float, volume: float, rubbing: Sequence[RubbingLine], releases: bool
    ) -> Motion | None:
        """The motion with the vertices held that are; None where others are to be, and may be released."""
        start = self._predicted(time_step)
        acting = self._acting(start, (time_step, volume), bool(start.given or rubbing))
        if acting.walls is not None:
            pull = acting.walls[0] / self.tension
            changed = [line.settle(start.body, acting.mean, pull, releases) for line in rubbing]
            if any(changed):
                return None
        end = self._end(start, acting, time_step)
        kinetic = start.equations.kinetic(start.state.velocity)
        if start.state.kinetic is None and kinetic:  # it starts in motion
            self.solver.first_energy = self.energy + kinetic
        ledger = EnergyBudget(self.physics, start.equations, start.body, start.given, acting, end)
        losses, before = start.state.carried_losses(kinetic, self.energy), (start.state.velocity, self.energy)
        losses, force = ledger.booked(losses, before, rubbing, self.tension)
        self.solver.state = self._left(start, acting, end, losses)
        return self._motion(start.equations, acting, end, force)

    def _predicted(self, time_step: float) -> Prediction:
        """Where the equations of a step [s] hold."""
        body, state = self.body, self.state
        base = state.history.base(body.points, state.velocity, time_step)
        pace = self._pace(base)
        given = self._plates.given(self.physics.motions, body, time_step)
        guessed = self._plates.guessed(self.physics.motions, pace)
        guess = self._guess(pace, given | guessed)
        ways = self._plates.middle_ways(given | guessed, time_step)
        predicted = body.placed(base.points + base.time_step * guess, ways)
        equations = self.equations(predicted, base.time_step, given)
        motions = rigid_motions(predicted.points)
        if state.kinetic is not None:
            state = state.with_momenta(equations, motions, self.admitted)
            base = state.history.base(body.points, state.velocity, time_step)
        return Prediction(state, base, given, guessed, guess, predicted, equations, motions)

    def _acting(self, start: Prediction, end: tuple[float, float], of_walls: bool) -> StepSolution:
        """What acts in a step [s] that ends at a volume [m^3], both in `end`, and whether forces of walls are asked."""
        equations, state, before = start.equations, start.state, start.base.velocity
        force = self._surface_force(start.body, equations) + start.base.time_step * equations.tension(start.guess)
        expected = equations.momentum(state.acceleration)
        rubbed = equations.rubbed(before, expected)
        load = equations.momentum(rubbed) / start.base.time_step + force + equations.push(state.pressure) - expected
        drive = equations.driver()
        reached = equations.given + drive(equations.beyond_given(load), equations.on_plates(state.pressure))
        rate = self._rate_of_volume(start.guess, start.body, start.given | start.guessed, end)
        change = equations.project(reached, rate, self.solver.factors, drive)
        mean = reached + drive(equations.push(change), equations.on_images(change))
        pressure = state.pressure + change
        walls = equations.reaction((before, rubbed, mean), force, pressure) if of_walls else None
        return StepSolution(force, before, rubbed, mean, pressure, walls)

    def _end(self, start: Prediction, acting: StepSolution, time_step: float) -> StepEnd:
        """Where the body and its plates are after a step [s], and how fast."""
        body, state = self.body, start.state
        twists = start.given | start.equations.twists(acting.mean, start.guessed)
        plates = self._plates.next(twists, time_step)
        history = state.history.followed_by(state.velocity, acting.mean, time_step)
        velocity = state.velocity + history.velocity_change
        moved = body.placed(body.points + history.displacement, {w: plate.displacement for w, plate in plates.items()})
        history = replace(history, displacement=moved.points - body.points)
        return StepEnd(moved, velocity, self.physics.energy(moved), history, plates, twists)

    def _left(self, start: Prediction, acting: StepSolution, end: StepEnd, losses: EnergyLosses) -> GalerkinState:
        """What the step leaves to the next one."""
        equations, state, body = start.equations, start.state, self.body
        momenta = rigid_momenta(start.motions, equations.masses, end.velocity)
        if state.kinetic is not None and not self.admitted[TURN] and edges_are_coaxial(body, self.physics):
            momenta[TURN] = state.momenta[TURN]
        gradient, time_step = equations.space.gradient(end.velocity), end.history.time_step
        return GalerkinState(
            points=end.body.points,
            centre=centre(body) + equations.masses @ end.history.displacement / equations.masses.sum(),
            velocity=end.velocity,
            gradient=gradient,
            kinetic=equations.kinetic(end.velocity),
            potential=end.potential,
            pressure=acting.pressure,
            acceleration=state.acceleration + (acting.mean - acting.rubbed) / equations.time_step,
            volumes=equations.space.carried,
            evening=smoothing_passes(gradient, equations.fluid.smoothing / SMOOTHING, time_step),
            momenta=momenta,
            momenta_change=np.zeros(6) if state.kinetic is None else momenta - state.momenta,
            history=end.history,
            losses=losses,
            plates=self._plates.kept(end.plates),
        )

    def _motion(self, equations: GalerkinEquations, acting: StepSolution, end: StepEnd, pull: float) -> Motion:
        """The motion that the step asks of the body; plates are pulled by a force [N]."""
        slides = None if has_friction(self.physics) else equations.slide(end.velocity, SLIDING * abs(self.energy))
        return Motion(
            velocity=end.velocity,
            transport=end.transport,
            pressure=equations.space.averages(acting.pressure),
            surface_pressure=float(np.average(acting.pressure, weights=equations.space.volumes)),
            twists={wall: way / end.history.time_step for wall, way in end.ways.items()},
            iterations=self.solver.factors.iterations,
            pull=pull,
            drift=slides,
        )

    def _rate_of_volume(
        self, guess: Floats, predicted: Body, twists: Mapping[int, Floats], end: tuple[float, float]
    ) -> float:
        """Rate [m^3/s] with which a step [s] ends at a volume [m^3], both in `end`; slopes are those predicted."""
        (time_step, volume), state = end, self.state
        way = state.history.followed_by(state.velocity, guess, time_step).displacement
        ways = {wall: plate.displacement for wall, plate in self._plates.next(twists, time_step).items()}
        enclosed = self.body.placed(self.body.points + way, ways).volume()[0]
        return (volume - enclosed) / state.history.leg(time_step) + float((predicted.volume()[1] * guess).sum())

    def _surface_force(self, body: Body, equations: GalerkinEquations) -> Floats:
        """Forces of the surface of a body at other positions, `(n, 3)` [N]."""
        if has_friction(self.physics):
            kept = tangential_share(self.state.gradient, equations.fluid.smoothing / SMOOTHING)
            return normal_pull(body, self.physics, equations.masses, kept)
        return self.physics.force(body)

    @property
    def _plates(self) -> PlateHistory:
        return PlateHistory(self.state.plates, self.state.history.time_step)

    def _pace(self, base: Base) -> float:
        """Share of the last velocity that the prediction has: with more a particle would go too far in a step."""
        way = base.time_step * float(np.sqrt((self._before() ** 2).sum(axis=1).max()))
        bound = LARGEST_DISPLACEMENT * self.body.cloud.spacing
        return 1.0 if way <= bound else bound / way

    def _before(self) -> Floats:
        """Velocity of a part of a step ago `(n, 3)` [m/s]."""
        moving = self.body.velocity - GUESS_BEFORE * self.state.history.velocity_change
        return moving if self.physics.momenta else np.zeros_like(moving)

    def _guess(self, pace: float, twists: Mapping[int, Floats]) -> Floats:
        """Velocity of the prediction `(n, 3)` [m/s]: that before, at a share of its pace, and that of plates."""
        velocity = pace * self._before()
        if not twists:
            return velocity
        return projected(self.projections, velocity) + held(self.projections, wall_velocities(self.body, twists))

    def fluid(self, spacing: float) -> LiquidProperties:
        """What the liquid is made of, of particles at a spacing [m]."""
        parts = self.physics.operators
        density = sum(part.density for part in parts if isinstance(part, Mass))
        viscosity = sum(part.coefficient for part in parts if isinstance(part, Viscosity))
        return LiquidProperties(density, viscosity, SMOOTHING * float(np.sqrt(self.tension / (density * spacing**3))))

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
        space, spacing = GalerkinSpace.of(body, 0.0 if clings else slip, twists), body.cloud.spacing
        masses, motions = fluid.density * space.carried, self.physics.motions
        space = replace(space, riders=FloatingModes.of(motions, body, self.projections, masses, space.drift_of))
        rigid = orthonormal(rigid_motions(body.points)[self.admitted], masses)
        stiffness = self.tension * area_stiffness(body.points, body.triangles, body.cloud.surface_count)
        free = admitted_stiffness(stiffness, self.projections)
        return GalerkinEquations(
            space=space,
            fluid=fluid,
            admitted=self.projections,
            stiffness=stiffness,
            spacing=spacing,
            rigid=rigid,
            walls=wall_velocities(body, twists),
            drag=friction * wall_shares(body, space.volumes) if friction else np.zeros(len(space.volumes)),
            unbalanced=body.volume()[1] - space.divergence_load(space.volumes),
            time_step=time_step,
            inertia=EffectiveMass.of(np.repeat(masses, 3), free, rigid.reshape(len(rigid), 3 * len(masses)), time_step),
        )
