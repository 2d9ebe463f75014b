"""Energy budget of a step of the Galerkin scheme: every loss of energy is attributed to a cause."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.ispg.galerkin_equations import GalerkinEquations
from reflowshock.particles.ispg.wall_forces import StepSolution, WallForces
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.one_leg import OneLeg
from reflowshock.particles.surface.hysteresis import FrictionLine


@dataclass(frozen=True, slots=True)
class EnergyLosses:
    """Energy that a flow has lost, by cause [J]. The metric ``<name>_loss`` reports each field.

    Attributes:
        viscous: Viscous dissipation in the liquid and on its walls.
        smoothing: Dissipation by velocity smoothing.
        integration: Loss by time integration of momentum and of the work of forces.
        transfer: Loss by particle shifting and by new particle masses.
        evening: Loss by mesh smoothing at constant volume.
        rebuilding: Loss by remeshing where liquids merge or detach.
        line: Dissipation by contact-line friction on walls with hysteresis.
        plates: Work done on plates with prescribed motion; negative if they do work on the liquid.
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
        """Sum of all losses [J]."""
        return float(sum(getattr(self, entry.name) for entry in fields(self)))


def total_losses(losses: Sequence[EnergyLosses]) -> EnergyLosses:
    """Return the sum of the energy losses of several flows, cause by cause.

    Args:
        losses: Energy lost by each flow since its start [J], by cause (viscous, smoothing, integration, ...).
    """
    return EnergyLosses(*(sum(getattr(part, entry.name) for part in losses) for entry in fields(EnergyLosses)))


@dataclass(frozen=True, slots=True)
class StepEnd:
    """Body and plates at the end of a step.

    Attributes:
        body: Liquid body at the end of the step.
        velocity: Velocity of the particles, shape (n, 3) [m/s].
        potential: Potential energy [J].
        history: Displacement and velocity change of the particles.
        plates: Displacement and twist change of each moving plate.
        twists: Mean twist of each moving plate, shape (6,) [m/s, rad/s].
    """

    body: Body
    velocity: Floats
    potential: float
    history: OneLeg
    plates: dict[int, OneLeg]
    twists: dict[int, Floats]

    @property
    def transport(self) -> Floats:
        """Velocity that moves the particles over the whole step, shape (n, 3) [m/s]."""
        return self.history.displacement / self.history.time_step

    @property
    def plate_displacements(self) -> dict[int, Floats]:
        """Displacement and rotation of each moving plate, shape (6,) [m, rad]."""
        return {wall: plate.displacement for wall, plate in self.plates.items()}


@dataclass(frozen=True, slots=True)
class EnergyBudget:
    """Energy budget of a step.

    Attributes:
        physics: Effects that act on the body.
        equations: Equations of the step.
        predicted: Body at the positions where the equations hold.
        prescribed: Mean twist of each plate with prescribed motion, shape (6,) [m/s, rad/s].
        solution: Solution of the equations.
        wall_forces: Forces of the walls on the liquid; None unless plates move or contact lines have friction.
        end: Body and plates at the end of the step.
    """

    physics: Physics
    equations: GalerkinEquations
    predicted: Body
    prescribed: dict[int, Floats]
    solution: StepSolution
    wall_forces: WallForces | None
    end: StepEnd

    def update(
        self,
        losses: EnergyLosses,
        velocity: Floats,
        potential: float,
        hysteresis_lines: Sequence[FrictionLine],
        surface_tension: float,
    ) -> tuple[EnergyLosses, float]:
        """Add the losses of the step and compute the mean force on plates with prescribed motion.

        Energy that neither work nor friction explains is attributed to the time integration.

        Args:
            losses: Losses before the step.
            velocity: Velocity at the start of the step, shape (n, 3) [m/s].
            potential: Potential energy at the start of the step [J].
            hysteresis_lines: Contact lines with friction.
            surface_tension: Surface tension of the liquid [N/m].

        Returns:
            Losses after the step, and the mean force along the motion of the plates [N], NaN without such motion.
        """
        time_step = self.end.history.time_step
        losses = self._with_motion(losses, velocity)
        work, (plate_work, plate_force) = self._work(), self._plate_work()
        if self.prescribed:
            work += time_step * self._forces().power(self.predicted, self.prescribed) - plate_work
        friction = (line.friction_power(self.predicted, self._work_velocity()) for line in hysteresis_lines)
        slid = time_step * surface_tension * sum(friction)
        integration = losses.integration + potential - self.end.potential - work - slid
        plates, line = losses.plates - plate_work, losses.line + slid
        return replace(losses, integration=integration, plates=plates, line=line), plate_force

    def _work_velocity(self) -> Floats:
        """Return the velocity along which forces do work, shape (n, 3) [m/s]: rotating plates move along arcs."""
        return self.solution.mean if self.end.plates else self.end.transport

    def _with_motion(self, losses: EnergyLosses, previous: Floats) -> EnergyLosses:
        """Add the dissipation by friction and the momentum change beyond the change of the kinetic energy.

        The latter is a loss of the time integration.
        """
        equations, solution, time_step = self.equations, self.solution, self.end.history.time_step
        velocity = self._work_velocity()
        power = equations.lost_power(solution.after_friction, velocity)
        acceleration = (solution.mean - solution.start) / equations.time_step
        change = time_step * float((velocity * equations.momentum(acceleration)).sum())
        gain = equations.kinetic_energy(self.end.velocity) - equations.kinetic_energy(previous)
        return replace(
            losses,
            viscous=losses.viscous + time_step * power.viscous,
            smoothing=losses.smoothing + time_step * power.smoothing,
            integration=losses.integration + change - gain,
        )

    def _work(self) -> float:
        """Return the work of the surface, the pressure and the loads on plates in the step [J]."""
        equations, solution, velocity, twists = self.equations, self.solution, self._work_velocity(), self.end.twists
        driving = solution.force - equations.time_step * equations.tension_stiffness(solution.mean)
        loads = sum(float(motion.load @ twists[motion.wall][:3]) for motion in self.physics.motions)
        power = float((driving * velocity).sum() + solution.pressure @ equations.volume_rates(velocity))
        return self.end.history.time_step * (power + loads)

    def _plate_work(self) -> tuple[float, float]:
        """Return the work on plates with prescribed motion [J] and the mean force [N], NaN without such motion."""
        if not self.prescribed:
            return 0.0, float("nan")
        displacements = self.end.plate_displacements
        prescribed = {wall: displacements[wall] for wall in self.prescribed}
        return self._forces().work(self.predicted, prescribed)

    def _forces(self) -> WallForces:
        """Return the forces of the walls, which prescribed motion requires."""
        if self.wall_forces is None:
            raise ValueError("prescribed plate motion requires the forces of the walls")
        return self.wall_forces
