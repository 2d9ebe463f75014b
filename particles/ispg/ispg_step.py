"""Stable ISPG step: the particles, MLS and pressure correction of Hu et al. in a Galerkin form.

Particles move with their own velocities v, which the shape functions N differentiate; nothing is interpolated from step
to step. Only mesh smoothing and particle shifting move particles relative to the liquid, and these take the velocity at
their new positions. Velocity smoothing is part of the equations (``galerkin_equations.py``): a friction on v - N v,
which vanishes for linear velocity fields and so keeps linear and angular momentum. Its rate is a multiple of the
frequency of the grid's capillary waves, whatever the time step (eq 28 relaxes once per step).

Forces and operators are evaluated at predicted positions, and the implicit surface tension acts on the change of the
velocity only; ``steps/one_leg.py`` integrates in time. Momenta along the rigid-body motions that walls admit are kept
exactly, and the centre of mass follows its momentum, so that a drop on a frictionless wall comes to rest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.core.surface_measure import area_stiffness
from reflowshock.particles.discretisation.effective_mass import EffectiveMass
from reflowshock.particles.discretisation.lagged_cholesky import LaggedCholesky
from reflowshock.particles.ispg.energy_budget import EnergyBudget, EnergyLosses, StepEnd
from reflowshock.particles.ispg.galerkin_equations import GalerkinEquations, LiquidProperties
from reflowshock.particles.ispg.galerkin_space import AT_REST, GalerkinSpace
from reflowshock.particles.ispg.moving_plates import FloatingModes, PlateHistory
from reflowshock.particles.ispg.nodal_volumes import wall_shares
from reflowshock.particles.ispg.normal_forces import has_friction, normal_surface_force, tangential_share
from reflowshock.particles.ispg.rigid_motions import (
    TURN,
    admitted_motions,
    constrained_part,
    edges_are_coaxial,
    orthonormalise,
    rigid_momenta,
    rigid_motions,
    wall_velocities,
)
from reflowshock.particles.ispg.state import GalerkinState, Prediction, find_centre, smoothing_passes
from reflowshock.particles.ispg.step_kernels import admitted_stiffness, projected
from reflowshock.particles.ispg.wall_forces import StepSolution, WallForces
from reflowshock.particles.physics.forces import SurfaceTension
from reflowshock.particles.physics.operators import Mass, NavierSlip, NoSlip, Viscosity
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.backward_difference import Base
from reflowshock.particles.steps.step_solver import Motion, SolverTraits
from reflowshock.particles.steps.time_step import LARGEST_DISPLACEMENT
from reflowshock.particles.surface.hysteresis import FrictionLine

SUPPORT = 1.5
# Age, in steps, of the velocity that predicts the forces: with newer ones, modes that resist less than their stiffness
# K grow (linear analysis: from 0.17 on with RADIUS = 0.5, whatever the share of K).
PREDICTION_AGE = 0.25
# Rate of velocity smoothing over the frequency sqrt(gamma / (rho h^3)). At 1 an oscillation loses three to five times
# as much energy; at 20 a zigzag of the surface decays slowly.
SMOOTHING = 10.0
# Vertices of a cube's triangulation alternate between eight and four triangles, which is Delaunay. A vertex with eight
# stands out of a surface at rest by 4 % of a spacing, and drops of 5 particles per edge are 1 % too high with one on
# top.
FLIP_WORTH = 0.1
# Rigid-body motions with less than this share of the potential energy do not delay rest on frictionless walls.
SLIDING = 1e-6


@dataclass(slots=True)
class IspgStep:
    """Step solver of the Galerkin scheme.

    Attributes:
        state: State at the end of the last step; None before the first.
        first_energy: Potential and kinetic energy before the first step [J].
        factors: Factors of the pressure equation.
    """

    state: GalerkinState | None = None
    first_energy: float = 0.0
    factors: LaggedCholesky = field(default_factory=LaggedCholesky)

    @property
    def traits(self) -> SolverTraits:
        """Properties of the scheme; it does not descend, because kinetic energy becomes surface energy."""
        passes = 1.0 if self.state is None else self.state.smoothing_passes
        return SolverTraits(SUPPORT, passes, FLIP_WORTH)

    def prepare(self, body: Body, physics: Physics, _neighbours: NeighbourList) -> "PreparedIspgStep":
        """Move the state to the current positions; without inertia the velocity is zero."""
        projections = physics.projections(body)
        if self.state is None:
            self.first_energy = physics.energy(body)
            self.state = GalerkinState.start(body, self.first_energy)
        elif not physics.momenta:
            body.velocity = np.zeros_like(body.velocity)
            self.state = GalerkinState.start(body, physics.energy(body), self.state.losses)
        admitted = admitted_motions(body.points, projections)
        if self.state.kinetic is not None:
            self.state = self.state.moved_to(body, physics, projections, admitted[:3])
        return PreparedIspgStep(self, body, physics, self.state, physics.energy(body), projections, admitted)

    @property
    def mass(self) -> sparse.csr_matrix:
        """Volumes that the particles carried in the last step, shape (n, n) [m^3]."""
        if self.state is None:
            raise ValueError("the particles carry no volumes before the first step")
        return sparse.diags(self.state.volumes, format="csr")

    def stop(self, body: Body) -> None:
        """Bring the body to rest and forget the last step."""
        body.velocity, self.state = np.zeros_like(body.velocity), None

    def saved(self) -> dict[str, Any]:
        """Return the data that a checkpoint keeps."""
        state = self.state and self.state.saved()
        return {"state": state, "first_energy": self.first_energy, "factors": self.factors.saved()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self.state = saved["state"] and GalerkinState.restored(saved["state"])
        self.first_energy = saved["first_energy"]
        self.factors.restore(saved["factors"])


@dataclass(frozen=True, slots=True)
class PreparedIspgStep:
    """Step from the body's current positions.

    Attributes:
        solver: Step solver, which keeps the state after the step.
        body: Liquid body.
        physics: Effects that act on the body.
        state: State of the last step at the current positions.
        energy: Potential energy at the current positions [J].
        projections: Projections onto the velocities that walls admit, shape (n, 3, 3).
        admitted: Whether walls admit each rigid-body motion, shape (6,).
    """

    solver: IspgStep
    body: Body
    physics: Physics
    state: GalerkinState
    energy: float
    projections: Floats
    admitted: NDArray[np.bool_]

    def solve(self, time_step: float, volume: float) -> Motion:
        """Compute the motion in a time step.

        With contact-line friction the step is repeated until the set of pinned vertices is consistent with the forces;
        vertices may be released in the first attempt only.

        Args:
            time_step: Time step [s].
            volume: Enclosed volume at the end of the step [m^3].

        Raises:
            SolveFailed: A linear solve failed.
            DegenerateStencil: A particle has too few neighbours.
            NoNodalVolumes: No positive nodal volumes match the volume and the centre of the body.
        """
        lines, releases = [line for line in self.physics.lines if isinstance(line, FrictionLine)], True
        while True:
            motion = (self._pinned() if lines else self)._attempt(time_step, volume, lines, releases)
            if motion is not None:
                return motion
            releases = False

    def _pinned(self) -> "PreparedIspgStep":
        """Return the step with the vertices at rest that contact lines pin now."""
        projections = self.physics.projections(self.body)
        return replace(
            self,
            body=replace(self.body, velocity=projected(projections, self.body.velocity)),
            state=self.state.pinned(self.body, self.physics, projections),
            projections=projections,
            admitted=admitted_motions(self.body.points, projections),
        )

    def _attempt(self, time_step: float, volume: float, lines: Sequence[FrictionLine], releases: bool) -> Motion | None:
        """Return the motion with the pinned vertices as they are, or None if contact-line friction changes their set.

        Args:
            time_step: Time step [s].
            volume: Enclosed volume at the end of the step [m^3].
            lines: Contact lines with friction.
            releases: Whether pinned vertices may be released.
        """
        start = self._predicted(time_step)
        solution, walls = self._solution(start, time_step, volume), None
        if start.prescribed or lines:
            walls = WallForces.of(start.equations, solution)
            pull = walls.on_particles / self.tension
            changed = [line.update_states(start.body, solution.mean, pull, releases) for line in lines]
            if any(changed):
                return None
        end = self._end(start, solution, time_step)
        kinetic = start.equations.kinetic_energy(start.state.velocity)
        if start.state.kinetic is None and kinetic:  # the body starts in motion
            self.solver.first_energy = self.energy + kinetic
        budget = EnergyBudget(self.physics, start.equations, start.body, start.prescribed, solution, walls, end)
        losses = start.state.losses_before(kinetic, self.energy)
        losses, plate_force = budget.update(losses, start.state.velocity, self.energy, lines, self.tension)
        self.solver.state = self._next_state(start, solution, end, losses)
        return self._motion(start.equations, solution, end, plate_force)

    def _predicted(self, time_step: float) -> Prediction:
        """Predict the positions where the equations of a step [s] hold."""
        body, state = self.body, self.state
        base = state.history.base(body.points, state.velocity, time_step)
        share = self._predicted_share(base)
        prescribed = self._plates.prescribed_twists(self.physics.motions, body, time_step)
        floating = self._plates.predicted_twists(self.physics.motions, share)
        velocity = self._predicted_velocity(share, prescribed | floating)
        plates = self._plates.predicted_displacements(prescribed | floating, time_step)
        predicted = body.placed(base.points + base.time_step * velocity, plates)
        equations = self.equations(predicted, base.time_step, prescribed)
        motions = rigid_motions(predicted.points)
        if state.kinetic is not None:
            state = state.with_momenta(equations, motions, self.admitted)
            base = state.history.base(body.points, state.velocity, time_step)
        return Prediction(state, base, prescribed, floating, velocity, predicted, equations, motions)

    def _solution(self, start: Prediction, time_step: float, volume: float) -> StepSolution:
        """Solve the equations of a step [s] that ends at a volume [m^3]."""
        equations, state, before = start.equations, start.state, start.base.velocity
        tension = start.base.time_step * equations.tension_stiffness(start.velocity)
        force = self._surface_force(start.body, equations) + tension
        expected = equations.momentum(state.acceleration)
        after_friction = equations.velocity_after_friction(before, expected)
        push = equations.pressure_forces(state.pressure)
        load = equations.momentum(after_friction) / start.base.time_step + force + push - expected
        respond = equations.response()
        plate_forces = equations.plate_forces(state.pressure)
        uncorrected = equations.prescribed + respond(equations.load_without_prescribed(load), plate_forces)
        rate = self._volume_rate(start, time_step, volume)
        change = equations.pressure_correction(uncorrected, rate, self.solver.factors, respond)
        correction = respond(equations.pressure_forces(change), equations.ghost_pressure_forces(change))
        return StepSolution(force, before, after_friction, uncorrected + correction, state.pressure + change)

    def _end(self, start: Prediction, solution: StepSolution, time_step: float) -> StepEnd:
        """Return positions and velocities of the body and its plates at the end of a step [s]."""
        body, state = self.body, start.state
        twists = start.prescribed | start.equations.twists(solution.mean, start.floating)
        plates = self._plates.next(twists, time_step)
        history = state.history.followed_by(state.velocity, solution.mean, time_step)
        velocity = state.velocity + history.velocity_change
        displacements = {wall: plate.displacement for wall, plate in plates.items()}
        moved = body.placed(body.points + history.displacement, displacements)
        history = replace(history, displacement=moved.points - body.points)
        return StepEnd(moved, velocity, self.physics.energy(moved), history, plates, twists)

    def _next_state(
        self, start: Prediction, solution: StepSolution, end: StepEnd, losses: EnergyLosses
    ) -> GalerkinState:
        """Return the state that the next step starts from."""
        equations, state, body = start.equations, start.state, self.body
        momenta = rigid_momenta(start.motions, equations.masses, end.velocity)
        if state.kinetic is not None and not self.admitted[TURN] and edges_are_coaxial(body, self.physics):
            momenta[TURN] = state.momenta[TURN]
        gradient, time_step = equations.space.gradient(end.velocity), end.history.time_step
        return GalerkinState(
            points=end.body.points,
            centre=find_centre(body) + equations.masses @ end.history.displacement / equations.masses.sum(),
            velocity=end.velocity,
            gradient=gradient,
            kinetic=equations.kinetic_energy(end.velocity),
            potential=end.potential,
            pressure=solution.pressure,
            acceleration=state.acceleration + (solution.mean - solution.after_friction) / equations.time_step,
            volumes=equations.space.carried,
            smoothing_passes=smoothing_passes(gradient, equations.fluid.smoothing / SMOOTHING, time_step),
            momenta=momenta,
            momenta_change=np.zeros(6) if state.kinetic is None else momenta - state.momenta,
            history=end.history,
            losses=losses,
            plates=self._plates.after(end.plates),
        )

    def _motion(self, equations: GalerkinEquations, solution: StepSolution, end: StepEnd, plate_force: float) -> Motion:
        """Return the motion of the body in the step; ``plate_force`` is the mean force on moving plates [N]."""
        drift = None
        if not has_friction(self.physics):
            drift = equations.slow_rigid_motion(end.velocity, SLIDING * abs(self.energy))
        return Motion(
            velocity=end.velocity,
            transport=end.transport,
            pressure=equations.space.averages(solution.pressure),
            surface_pressure=float(np.average(solution.pressure, weights=equations.space.volumes)),
            twists={wall: change / end.history.time_step for wall, change in end.plate_displacements.items()},
            iterations=self.solver.factors.iterations,
            pull=plate_force,
            drift=drift,
        )

    def _volume_rate(self, start: Prediction, time_step: float, volume: float) -> float:
        """Return the rate [m^3/s] at the predicted positions with which a step [s] ends at a volume [m^3]."""
        state, velocity = self.state, start.velocity
        displacement = state.history.followed_by(state.velocity, velocity, time_step).displacement
        plates = self._plates.next(start.plate_twists, time_step)
        displacements = {wall: plate.displacement for wall, plate in plates.items()}
        enclosed = self.body.placed(self.body.points + displacement, displacements).volume()[0]
        rate = float((start.body.volume()[1] * velocity).sum())
        return (volume - enclosed) / state.history.leg(time_step) + rate

    def _surface_force(self, body: Body, equations: GalerkinEquations) -> Floats:
        """Return the forces of the surface of a body at other positions, shape (n, 3) [N]."""
        if has_friction(self.physics):
            share = tangential_share(self.state.gradient, equations.fluid.smoothing / SMOOTHING)
            return normal_surface_force(body, self.physics, equations.masses, share)
        return self.physics.force(body)

    @property
    def _plates(self) -> PlateHistory:
        return PlateHistory(self.state.plates, self.state.history.time_step)

    def _predicted_share(self, base: Base) -> float:
        """Return the share of the last velocity with which no particle moves too far in the prediction."""
        distance = base.time_step * float(np.sqrt((self._earlier_velocity() ** 2).sum(axis=1).max()))
        bound = LARGEST_DISPLACEMENT * self.body.cloud.spacing
        return 1.0 if distance <= bound else bound / distance

    def _earlier_velocity(self) -> Floats:
        """Return the velocity a quarter of a step before the current time, shape (n, 3) [m/s]."""
        velocity = self.body.velocity - PREDICTION_AGE * self.state.history.velocity_change
        return velocity if self.physics.momenta else np.zeros_like(velocity)

    def _predicted_velocity(self, share: float, twists: Mapping[int, Floats]) -> Floats:
        """Return a share of the earlier velocity, with the twists (6,) of the plates, shape (n, 3) [m/s]."""
        velocity = share * self._earlier_velocity()
        if not twists:
            return velocity
        carried = constrained_part(self.projections, wall_velocities(self.body, twists))
        return projected(self.projections, velocity) + carried

    def fluid(self, spacing: float) -> LiquidProperties:
        """Return the properties of the liquid for a particle spacing [m], which sets the rate of smoothing."""
        parts = self.physics.operators
        density = sum(part.density for part in parts if isinstance(part, Mass))
        viscosity = sum(part.coefficient for part in parts if isinstance(part, Viscosity))
        return LiquidProperties(density, viscosity, SMOOTHING * float(np.sqrt(self.tension / (density * spacing**3))))

    @property
    def tension(self) -> float:
        """Surface tension of the liquid [N/m]."""
        return sum(part.coefficient for part in self.physics.operators if isinstance(part, SurfaceTension))

    def equations(self, body: Body, time_step: float, twists: Mapping[int, Floats] = AT_REST) -> GalerkinEquations:
        """Assemble the equations of a body at other positions.

        Args:
            body: Liquid body at these positions.
            time_step: Time step of the equivalent backward Euler step [s].
            twists: Twist of each plate on a prescribed path by its index, shape (6,) [m/s, rad/s].
        """
        fluid = self.fluid(body.cloud.spacing)
        friction = sum(part.coefficient for part in self.physics.frictions if isinstance(part, NavierSlip))
        sticks = any(isinstance(hold, NoSlip) for hold in self.physics.holds)
        slip = fluid.viscosity / friction if friction else np.inf
        space, spacing = GalerkinSpace.of(body, 0.0 if sticks else slip, twists), body.cloud.spacing
        masses, motions = fluid.density * space.carried, self.physics.motions
        space = replace(space, floating=FloatingModes.of(motions, body, self.projections, masses, space.drift_of))
        rigid = orthonormalise(rigid_motions(body.points)[self.admitted], masses)
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
