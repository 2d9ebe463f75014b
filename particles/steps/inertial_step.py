"""Step with inertia and viscosity on linear tetrahedra between the particles, by BDF2.

Forces and operators are evaluated at the predicted positions x* = x_base + dt_eff v_n. The implicit surface tension
then acts on v - v_n only: an added mass of order dt^2 instead of a damping of order dt. The tetrahedra move with their
particles and are rebuilt when particles are shifted, the surface changes or a tetrahedron degenerates. Moving least
squares are unsuitable here: their transpose scatters the force of the surface into noise.
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
from reflowshock.particles.discretisation.field_transfer import Transfer, interpolation_matrix
from reflowshock.particles.discretisation.incompressibility import solve_saddle_point
from reflowshock.particles.discretisation.inner_tetrahedra import fill_with_tetrahedra
from reflowshock.particles.physics.operators import Viscosity
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.backward_difference import BackwardDifference, Base, prepare_physics
from reflowshock.particles.steps.step_equations import StepEquations
from reflowshock.particles.steps.step_solver import Motion, SolverTraits, StepSolver
from reflowshock.particles.steps.time_step import LARGEST_DISPLACEMENT

SUPPORT = 1.5
# Shift of a particle, in spacings, from which tetrahedra are rebuilt.
SHIFT_TOLERANCE = 1e-6
NO_NEIGHBOURS = NeighbourList(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class InertialState:
    """State that one step hands to the next.

    Attributes:
        space: Tetrahedra of the last step.
        triangles: Triangles of their surface, shape (t, 3).
        points: Positions at the end of the step, shape (n, 3) [m].
        history: Displacement and velocity change of the step.
        plates: Displacement and rotation of each moving plate by its index, shape (6,) [m, rad].
    """

    space: LinearTetrahedra
    triangles: NDArray[np.int32]
    points: Floats
    history: BackwardDifference
    plates: dict[int, Floats]

    @classmethod
    def start(cls, body: Body, density: float, viscosity: float) -> "InertialState":
        """Fill a body with tetrahedra before its first step.

        Args:
            body: Liquid body.
            density: Density [kg/m^3].
            viscosity: Dynamic viscosity [Pa s].
        """
        space = LinearTetrahedra.start(body.points, fill_with_tetrahedra(body), density, viscosity)
        return cls(space, body.triangles, body.points, BackwardDifference.start(len(body.points)), {})

    def saved(self) -> dict[str, Any]:
        """Return the data that a checkpoint keeps; the mass follows from the volumes."""
        space = {name: getattr(self.space, name) for name in ("cells", "volumes", "viscosity")}
        plates = {str(wall): displacement for wall, displacement in self.plates.items()}
        return fields_of(self) | {"space": space, "history": fields_of(self.history), "plates": plates}

    @classmethod
    def restored(cls, saved: Mapping[str, Any], density: float) -> "InertialState":
        """Return the state whose data ``saved`` returned, for a density [kg/m^3]."""
        space, points = saved["space"], saved["points"]
        mass = particle_mass(space["cells"], space["volumes"], len(points))
        return cls(
            LinearTetrahedra(mass=mass, density=density, **space),
            saved["triangles"],
            points,
            BackwardDifference(**saved["history"]),
            {int(wall): displacement for wall, displacement in saved["plates"].items()},
        )

    def fits(self, body: Body) -> bool:
        """Return whether the tetrahedra still fill the body and none is degenerate."""
        shift = float(np.abs(body.points - self.points).max())
        same_surface = np.array_equal(self.triangles, body.triangles)
        return same_surface and shift < SHIFT_TOLERANCE * body.cloud.spacing and not self.space.is_worn(body.points)

    def transferred(self, body: Body, physics: Physics) -> tuple["InertialState", Floats]:
        """Return the state on new tetrahedra, and the velocity at the current positions, shape (n, 3) [m/s]."""
        new = LinearTetrahedra.start(body.points, fill_with_tetrahedra(body), self.space.density, self.space.viscosity)
        values = interpolation_matrix(self.points, self.space.cells, body.points - self.points)
        unit_fields = [physics.admit(body, np.broadcast_to(axis, body.points.shape)) for axis in np.eye(3)]
        transfer = Transfer(values, self.space.mass, new.mass, unit_fields)
        old = self.history
        history = BackwardDifference(values @ old.displacement, transfer(old.velocity_change), old.time_step)
        return InertialState(new, body.triangles, body.points, history, self.plates), transfer(body.velocity)


@dataclass(slots=True)
class InertialStep:
    """Step solver on linear tetrahedra.

    Attributes:
        density: Density [kg/m^3].
        state: State at the end of the last step; None before the first.
    """

    density: float
    state: InertialState | None = None

    @property
    def traits(self) -> SolverTraits:
        """Properties of the scheme; it descends, because viscosity and mass only slow the motion along the forces."""
        return SolverTraits(support=SUPPORT, descends=True)

    def prepare(self, body: Body, physics: Physics, _neighbours: NeighbourList) -> "PreparedInertialStep":
        """Start a step; tetrahedra need no neighbour list."""
        return self.start(body, physics)

    def start(self, body: Body, physics: Physics) -> "PreparedInertialStep":
        """Provide tetrahedra and the velocity at the current positions; without inertia it is zero."""
        if self.state is None or not physics.momenta:
            viscosity = sum(part.coefficient for part in physics.operators if isinstance(part, Viscosity))
            self.state = InertialState.start(body, self.density, viscosity)
        elif not self.state.fits(body):
            self.state, body.velocity = self.state.transferred(body, physics)
        if not physics.momenta:
            body.velocity = np.zeros_like(body.velocity)
        return PreparedInertialStep(body, physics, self, self.state)

    def saved(self) -> dict[str, Any]:
        """Return the data that a checkpoint keeps."""
        return {"state": self.state and self.state.saved()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self.state = saved["state"] and InertialState.restored(saved["state"], self.density)

    def stop(self, body: Body) -> None:
        """Bring the body to rest."""
        body.velocity = np.zeros_like(body.velocity)
        if self.state is not None:
            self.state = replace(self.state, history=BackwardDifference.start(len(body.points)), plates={})

    @property
    def mass(self) -> sparse.csr_matrix:
        """Mass matrix of the last step over the density, shape (n, n) [m^3]."""
        if self.state is None:
            raise ValueError("the particles carry no volumes before the first step")
        return self.state.space.mass

    def kinetic_energy(self, body: Body) -> float:
        """Return the kinetic energy of the body with the masses of the last step [J]."""
        return 0.5 * self.density * float((body.velocity * (self.mass @ body.velocity)).sum())


@dataclass(frozen=True, slots=True)
class PreparedInertialStep:
    """Step from the body's current positions.

    Attributes:
        body: Liquid body.
        physics: Effects that act on the body.
        solver: Step solver, which keeps the state after the step.
        state: State of the last step, with tetrahedra at the current positions.
    """

    body: Body
    physics: Physics
    solver: InertialStep
    state: InertialState

    def solve(self, time_step: float, volume: float) -> Motion:
        """Compute the motion in a time step.

        Args:
            time_step: Time step [s].
            volume: Enclosed volume at the end of the step [m^3].

        Raises:
            SolveFailed: The linear solve failed.
        """
        body, state = self.body, self.state
        base = state.history.base(body.points, body.velocity, time_step)
        guess = self._guess(base)
        carried = {
            motion.wall: base.weight * state.plates.get(motion.wall, np.zeros(6)) for motion in self.physics.motions
        }
        predicted = replace(body, points=base.points + base.time_step * guess, velocity=base.velocity)
        space = state.space(predicted)
        equations = StepEquations(predicted, prepare_physics(self.physics, guess, carried, time_step), space)
        swept = base.time_step * float((space.constraint @ guess.T.ravel()).sum())
        problem = equations.problem(base.time_step, volume + swept)
        solution = solve_saddle_point(replace(problem, guess=body.pressure))
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
            twists={wall: displacement / time_step for wall, displacement in plates.items()},
            iterations=solution.iterations,
        )

    def _guess(self, base: Base) -> Floats:
        """Return the predicted velocity, shape (n, 3) [m/s]: the last one, reduced if particles would move too far."""
        velocity = self.body.velocity
        distance = base.time_step * float(np.sqrt((velocity**2).sum(axis=1).max()))
        bound = LARGEST_DISPLACEMENT * self.body.cloud.spacing
        return velocity if distance <= bound else bound / distance * velocity


class InertialSolver(StepSolver, Protocol):
    """Step solver whose particles carry momentum."""

    @property
    def mass(self) -> sparse.csr_matrix:
        """Mass matrix of the last step over the density, shape (n, n) [m^3]."""

    def stop(self, body: Body) -> None:
        """Bring the body to rest."""


class InertialFlow:
    """Flow of a body without walls, without mesh smoothing and particle shifting."""

    def __init__(self, body: Body, physics: Physics, solver: InertialSolver) -> None:
        """Remember the volume to keep.

        Args:
            body: Liquid body; changed in place.
            physics: Effects that act on the body.
            solver: Step solver that needs no neighbour list.
        """
        self.body, self.physics, self.solver = body, physics, solver
        self.volume = body.volume()[0]

    def saved(self) -> dict[str, Any]:
        """Return the data that a checkpoint keeps; a flow of the same physics continues from it to the same bits."""
        return {"body": self.body, "volume": self.volume, "solver": self.solver.saved()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self.body, self.volume = saved["body"], saved["volume"]
        self.solver.restore(saved["solver"])

    @property
    def mass(self) -> sparse.csr_matrix:
        """Mass matrix over the density from the first step on, shape (n, n) [m^3]."""
        return self.solver.mass

    def settle(self, time_step: float, steps: int) -> None:
        """Relax the body by a number of steps [s], each from rest."""
        for _ in range(steps):
            self.step(time_step)
            self.solver.stop(self.body)

    def step(self, time_step: float) -> int:
        """Advance one time step [s]; return the number of iterations of the pressure solve.

        Raises:
            SolveFailed: The linear solve failed.
        """
        body = self.body
        motion = self.solver.prepare(body, self.physics, NO_NEIGHBOURS).solve(time_step, self.volume)
        body.velocity, body.pressure = motion.velocity, motion.pressure
        body.surface_pressure = motion.surface_pressure
        body.move(time_step, motion.transport, motion.twists)
        return motion.iterations
