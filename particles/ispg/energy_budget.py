"""The ledger of a step of the Galerkin scheme: what acted in it, where it ends, and the energies that are lost."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.ispg.galerkin_equations import GalerkinEquations
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.one_leg import OneLeg
from reflowshock.particles.surface.contact_line import RubbingLine


@dataclass(frozen=True, slots=True)
class EnergyLosses:
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


def total_losses(losses: Sequence[EnergyLosses]) -> EnergyLosses:
    """Losses of several flows, each by its kind."""
    return EnergyLosses(*(sum(getattr(one, entry.name) for one in losses) for entry in fields(EnergyLosses)))


@dataclass(frozen=True, slots=True)
class StepSolution:
    """What acts in a step by its equations.

    Attributes:
        force: of the surface, with that of the tension along the prediction, `(n, 3)` [N].
        start: velocity that the step starts with, `(n, 3)` [m/s].
        rubbed: velocity that friction acts on, `(n, 3)` [m/s].
        mean: velocity over the times of the method, `(n, 3)` [m/s].
        pressure: `(n,)` [Pa].
        walls: forces of walls, at particles and images; None where nothing asks for them.
    """

    force: Floats
    start: Floats
    rubbed: Floats
    mean: Floats
    pressure: Floats
    walls: tuple[Floats, Floats] | None


@dataclass(frozen=True, slots=True)
class StepEnd:
    """Where a step ends.

    Attributes:
        body: the liquid body there.
        velocity: of the particles, `(n, 3)` [m/s].
        potential: energy of the forces [J].
        history: the step, of the particles.
        plates: of the plates that moved, by their index.
        twists: mean twists of these, `(6,)`.
    """

    body: Body
    velocity: Floats
    potential: float
    history: OneLeg
    plates: dict[int, OneLeg]
    twists: dict[int, Floats]

    @property
    def transport(self) -> Floats:
        """Velocity that moved the particles, `(n, 3)` [m/s]."""
        return self.history.displacement / self.history.time_step

    @property
    def ways(self) -> dict[int, Floats]:
        """Displacements of plates, `(6,)` [m, rad]."""
        return {wall: plate.displacement for wall, plate in self.plates.items()}


@dataclass(frozen=True, slots=True)
class EnergyBudget:
    """Energies of a step.

    Attributes:
        physics: what acts on the body.
        equations: of the step.
        predicted: the body where they hold.
        given: twists of plates that are moved, `(6,)`.
        acting: what acted.
        end: where the step ends.
    """

    physics: Physics
    equations: GalerkinEquations
    predicted: Body
    given: dict[int, Floats]
    acting: StepSolution
    end: StepEnd

    def booked(
        self, losses: EnergyLosses, before: tuple[Floats, float], rubbing: Sequence[RubbingLine], tension: float
    ) -> tuple[EnergyLosses, float]:
        """Losses with those of the step, and the mean force that has moved plates [N], not a number where none was.

        What work, friction of contact lines and the change of the energy do not explain is lost to the time
        integration.

        Args:
            losses: of the steps before.
            before: velocity of the particles `(n, 3)` [m/s] and energy of the forces [J] at its start.
            rubbing: contact lines with friction.
            tension: surface tension of the liquid [N/m].
        """
        time_step, (velocity, potential) = self.end.history.time_step, before
        losses = self._with_motion(losses, velocity)
        work, (done, pull) = self._work(), self._of_plates()
        if self.given:
            work += time_step * self.equations.power(self.predicted, self.given, self._wall_forces()) - done
        slid = time_step * tension * sum(line.rubbed(self.predicted, self._way()) for line in rubbing)
        integration = losses.integration + potential - self.end.potential - work - slid
        return replace(losses, integration=integration, plates=losses.plates - done, line=losses.line + slid), pull

    def _way(self) -> Floats:
        """Velocity along which forces act, `(n, 3)` [m/s]: plates that turn take particles along arcs."""
        return self.acting.mean if self.end.plates else self.end.transport

    def _with_motion(self, losses: EnergyLosses, last: Floats) -> EnergyLosses:
        """Losses with those of friction, and what the change of momentum takes beyond that of the kinetic energy.

        This is one of the time integration.
        """
        equations, acting, time_step, way = self.equations, self.acting, self.end.history.time_step, self._way()
        power = equations.losses(acting.rubbed, way)
        acceleration = (acting.mean - acting.start) / equations.time_step
        change = time_step * float((way * equations.momentum(acceleration)).sum())
        gain = equations.kinetic(self.end.velocity) - equations.kinetic(last)
        return replace(
            losses,
            viscous=losses.viscous + time_step * power.viscous,
            smoothing=losses.smoothing + time_step * power.smoothing,
            integration=losses.integration + change - gain,
        )

    def _work(self) -> float:
        """Work of surface, pressure and loads on plates along the step [J]."""
        equations, acting, way, twists = self.equations, self.acting, self._way(), self.end.twists
        driving = acting.force - equations.time_step * equations.tension(acting.mean)
        loads = sum(float(motion.load @ twists[motion.wall][:3]) for motion in self.physics.motions)
        along = float((driving * way).sum() + acting.pressure @ equations.constraint(way))
        return self.end.history.time_step * (along + loads)

    def _of_plates(self) -> tuple[float, float]:
        """Work on plates that are moved [J], and the mean force along their way [N], not a number where none is."""
        if not self.given:
            return 0.0, float("nan")
        ways = self.end.ways
        return self.equations.work(self.predicted, {wall: ways[wall] for wall in self.given}, self._wall_forces())

    def _wall_forces(self) -> tuple[Floats, Floats]:
        """Forces of walls, which plates that are moved ask for."""
        if self.acting.walls is None:
            raise ValueError("plates that are moved need the forces of walls")
        return self.acting.walls
