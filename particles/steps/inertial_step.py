"""A step with inertia and volume viscosity on tetrahedra of the particles, of second order in time: BDF2.

Forces and operators are taken at the predicted positions x* = x_base + dt_eff v_n. The implicit surface tension then
acts on v - v_n only: an added mass of order dt^2, not a damping of order dt. The tetrahedra travel with their particles
until these are shifted, the surface changes or they are worn out: then they are made anew.

Moving least squares was tried first; its transpose scatters the force of the surface into noise.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.data_file import fields_of
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.discretisation.discretisation import LinearTetrahedra, particle_mass
from reflowshock.particles.discretisation.field_transfer import Transfer, interpolation
from reflowshock.particles.discretisation.incompressibility import solve
from reflowshock.particles.discretisation.inner_tetrahedra import fill
from reflowshock.particles.physics.operators import Viscosity
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.backward_difference import BackwardDifference, Base, stepped
from reflowshock.particles.steps.step_equations import StepEquations
from reflowshock.particles.steps.step_solver import Motion, SolverTraits, StepSolver
from reflowshock.particles.steps.time_step import LARGEST_DISPLACEMENT

SUPPORT = 1.5
# Shift of a particle that calls for new tetrahedra, in spacings.
SHIFT_TOLERANCE = 1e-6
NO_NEIGHBOURS = NeighbourList(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class InertialState:
    """What the last step left.

    Attributes:
        space: its tetrahedra.
        triangles: `(t, 3)` of their surface.
        points: `(n, 3)` where it took the particles [m].
        history: its displacement and change of velocity.
        plates: `(6,)` displacement and rotation of each plate that moved, by its index [m, rad].
    """

    space: LinearTetrahedra
    triangles: NDArray[np.int32]
    points: Floats
    history: BackwardDifference
    plates: dict[int, Floats]

    @classmethod
    def start(cls, body: Body, density: float, viscosity: float) -> "InertialState":
        """Fill a body that has not moved yet with tetrahedra."""
        space = LinearTetrahedra.start(body.points, fill(body), density, viscosity)
        return cls(space, body.triangles, body.points, BackwardDifference.start(len(body.points)), {})

    def saved(self) -> dict[str, Any]:
        """Return what a checkpoint keeps: the mass follows from the volumes."""
        kept = {name: getattr(self.space, name) for name in ("cells", "volumes", "viscosity")}
        plates = {str(wall): way for wall, way in self.plates.items()}
        return fields_of(self) | {"space": kept, "history": fields_of(self.history), "plates": plates}

    @classmethod
    def restored(cls, saved: Mapping[str, Any], density: float) -> "InertialState":
        """Make it again of what `saved` returned."""
        space, points = saved["space"], saved["points"]
        mass = particle_mass(space["cells"], space["volumes"], len(points))
        return cls(
            LinearTetrahedra(mass=mass, density=density, **space),
            saved["triangles"],
            points,
            BackwardDifference(**saved["history"]),
            {int(wall): way for wall, way in saved["plates"].items()},
        )

    def fits(self, body: Body) -> bool:
        """Whether the tetrahedra still fill the body well."""
        shift = float(np.abs(body.points - self.points).max())
        same_surface = np.array_equal(self.triangles, body.triangles)
        return same_surface and shift < SHIFT_TOLERANCE * body.cloud.spacing and not self.space.is_worn(body.points)

    def transferred(self, body: Body, physics: Physics) -> tuple["InertialState", Floats]:
        """The state on new tetrahedra, and the velocity `(n, 3)` of the particles where they are now [m/s]."""
        new = LinearTetrahedra.start(body.points, fill(body), self.space.density, self.space.viscosity)
        values = interpolation(self.points, self.space.cells, body.points - self.points)
        unit_fields = [physics.admit(body, np.broadcast_to(axis, body.points.shape)) for axis in np.eye(3)]
        transfer = Transfer(values, self.space.mass, new.mass, unit_fields)
        old = self.history
        history = BackwardDifference(values @ old.displacement, transfer(old.velocity_change), old.time_step)
        return InertialState(new, body.triangles, body.points, history, self.plates), transfer(body.velocity)


@dataclass(slots=True)
class InertialStep:
    """Linear tetrahedra with memory of the last step.

    Attributes:
        density: of the liquid [kg/m^3].
        state: what the last step left, None before the first.
    """

    density: float
    state: InertialState | None = None

    @property
    def traits(self) -> SolverTraits:
        """Lists serve the shift of the particles alone; viscosity and mass only slow down what the forces drive."""
        return SolverTraits(support=SUPPORT, descends=True)

    def prepare(self, body: Body, physics: Physics, _neighbours: NeighbourList) -> "PreparedInertialStep":
        """Start a step; tetrahedra need no neighbour list."""
        return self.start(body, physics)

    def start(self, body: Body, physics: Physics) -> "PreparedInertialStep":
        """Provide tetrahedra and the velocity of the particles where they are now; without inertia it is zero."""
        if self.state is None or not physics.momenta:
            viscosity = sum(part.coefficient for part in physics.operators if isinstance(part, Viscosity))
            self.state = InertialState.start(body, self.density, viscosity)
        elif not self.state.fits(body):
            self.state, body.velocity = self.state.transferred(body, physics)
        if not physics.momenta:
            body.velocity = np.zeros_like(body.velocity)
        return PreparedInertialStep(body, physics, self, self.state)

    def saved(self) -> dict[str, Any]:
        """What it remembers of earlier steps, for a checkpoint."""
        return {"state": self.state and self.state.saved()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        self.state = saved["state"] and InertialState.restored(saved["state"], self.density)

    def stop(self, body: Body) -> None:
        """Bring the body to rest."""
        body.velocity = np.zeros_like(body.velocity)
        if self.state is not None:
            self.state = replace(self.state, history=BackwardDifference.start(len(body.points)), plates={})

    @property
    def mass(self) -> sparse.csr_matrix:
        """Volumes that the particles carried in the last step, `(n, n)` [m^3]."""
        if self.state is None:
            raise ValueError("the first step gives the particles their volumes")
        return self.state.space.mass

    def kinetic_energy(self, body: Body) -> float:
        """Kinetic energy of the body with the velocity of the last step [J]."""
        return 0.5 * self.density * float((body.velocity * (self.mass @ body.velocity)).sum())


@dataclass(frozen=True, slots=True)
class PreparedInertialStep:
    """A step from the body's current positions.

    Attributes:
        body: the liquid body.
        physics: what acts on it.
        solver: remembers the step.
        state: tetrahedra at the body's positions and the step before.
    """

    body: Body
    physics: Physics
    solver: InertialStep
    state: InertialState

    def solve(self, time_step: float, volume: float) -> Motion:
        """Return the motion in a time step [s] that ends at a volume [m^3].

        Raises:
            SolveFailed: the linear solve failed.
        """
        body, state = self.body, self.state
        base = state.history.base(body.points, body.velocity, time_step)
        guess = self._guess(base)
        carried = {
            motion.wall: base.weight * state.plates.get(motion.wall, np.zeros(6)) for motion in self.physics.motions
        }
        predicted = replace(body, points=base.points + base.time_step * guess, velocity=base.velocity)
        space = state.space(predicted)
        equations = StepEquations(predicted, stepped(self.physics, guess, carried, time_step), space)
        swept = base.time_step * float((space.constraint @ guess.T.ravel()).sum())
        problem = equations.problem(base.time_step, volume + swept)
        solution = solve(replace(problem, guess=body.pressure))
        velocity, twists = equations.expand(solution.velocity, base.time_step)
        points = base.points + base.time_step * velocity
        plates = {wall: carried[wall] + base.time_step * twist for wall, twist in twists.items()}
        history = BackwardDifference(points - body.points, velocity - body.velocity, time_step)
        self.solver.state = InertialState(state.space, state.triangles, points, history, plates)
        return Motion(
            velocity=velocity,
            transport=history.displacement / time_step,
            pressure=solution.pressure,
            surface_pressure=float(space.volume_share @ solution.pressure),
            twists={wall: way / time_step for wall, way in plates.items()},
            iterations=solution.iterations,
        )

    def _guess(self, base: Base) -> Floats:
        """Velocity of the prediction `(n, 3)` [m/s]: the last one, as far as a step may go."""
        velocity = self.body.velocity
        way = base.time_step * float(np.sqrt((velocity**2).sum(axis=1).max()))
        bound = LARGEST_DISPLACEMENT * self.body.cloud.spacing
        return velocity if way <= bound else bound / way * velocity


class InertialSolver(StepSolver, Protocol):
    """A step solver whose particles carry momentum."""

    @property
    def mass(self) -> sparse.csr_matrix:
        """Volumes that the particles carried in the last step, `(n, n)` [m^3]."""

    def stop(self, body: Body) -> None:
        """Bring the body to rest."""


class InertialFlow:
    """A body without walls and its steps; triangles and particles are left as they move."""

    def __init__(self, body: Body, physics: Physics, solver: InertialSolver) -> None:
        """Remember the volume to keep.

        Args:
            body: the liquid body; changed in place.
            physics: what acts on it.
            solver: of the motion in a step; it needs no list of neighbours.
        """
        self.body, self.physics, self.solver = body, physics, solver
        self.volume = body.volume()[0]

    def saved(self) -> dict[str, Any]:
        """All that a flow of the same physics needs to continue to the same bits, for a checkpoint."""
        return {"body": self.body, "volume": self.volume, "solver": self.solver.saved()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        self.body, self.volume = saved["body"], saved["volume"]
        self.solver.restore(saved["solver"])

    @property
    def mass(self) -> sparse.csr_matrix:
        """Volumes that the particles carry, `(n, n)` [m^3], from the first step on."""
        return self.solver.mass

    def settle(self, time_step: float, steps: int) -> None:
        """Bring the body to rest: stop all motion after every step [s]."""
        for _ in range(steps):
            self.step(time_step)
            self.solver.stop(self.body)

    def step(self, time_step: float) -> int:
        """Advance one time step [s]; return the iterations of the pressure solve.

        Raises:
            SolveFailed: the linear solve failed.
        """
        body = self.body
        motion = self.solver.prepare(body, self.physics, NO_NEIGHBOURS).solve(time_step, self.volume)
        body.velocity, body.pressure = motion.velocity, motion.pressure
        body.surface_pressure = motion.surface_pressure
        body.move(time_step, motion.transport, motion.twists)
        return motion.iterations
