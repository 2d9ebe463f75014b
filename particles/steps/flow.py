"""Flow of a liquid body: one implicit step of Lagrangian Navier-Stokes after the other (Hu et al., eqs 1 to 7).

A step: contact line events; forces; solve for velocity and pressure; move; smooth and flip the surface; correct the
volume along its gradient; shift the interior particles. Each part has its own module. A body that relaxes ends each
step with no more energy than before (``descent.py``).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import Cloud
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.core.plate import Pad, Plate
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.physics.plate_motion import PlateMotion
from reflowshock.particles.steps.descent import MeshSmoothing, StepStart, correct_volume, highest_energy, smooth_surface
from reflowshock.particles.steps.interior_shift import interior_shift
from reflowshock.particles.steps.shape import Snapshot
from reflowshock.particles.steps.step_solver import Motion, PreparedStep, StepSolver
from reflowshock.particles.steps.time_step import StepCollapsed, TimeStep
from reflowshock.particles.surface.profile import Profile, fit_profile
from reflowshock.particles.surface.surface_quality import vertex_normals

SKIN = 0.2
FLIP_INTERVAL = 2
STEADY = 0.02  # relative change per step below which a motion is steady
FLOW_RECORDS = (Body, Cloud, Plate, Pad, TimeStep)  # dataclasses in a checkpoint of a flow
SAVED = ("body", "time_step", "volume", "time", "steps", "pace")


@dataclass(frozen=True, slots=True)
class StepRecord:
    """Record of a step.

    Attributes:
        step: Number of the step.
        time: Time at its end [s].
        time_step: Its size [s].
        binding: Criterion that bounds its size.
        height: Height of the body after the step [m].
        volume: Volume after the step [m^3].
        energy: Potential energy after the step [J].
        speed: Largest normal velocity of the surface, smoothing and correction included, less slow rigid drift [m/s].
        displacement: That velocity times the time step, over the spacing.
        flips: Number of flipped edges.
        iterations: Number of iterations of the pressure solve.
        standoff: Height of the second plate's origin above the first plate [m]; NaN with fewer plates.
        pull: Mean force on plates with prescribed motion, along it [N]; NaN without such motion.
    """

    step: int
    time: float
    time_step: float
    binding: str
    height: float
    volume: float
    energy: float
    speed: float
    displacement: float
    flips: int
    iterations: int
    standoff: float
    pull: float


class LiquidFlow:
    """Liquid body that flows under its physics.

    Attributes:
        records: Dataclasses in a checkpoint.
    """

    records: ClassVar[tuple[type, ...]] = FLOW_RECORDS

    def __init__(self, body: Body, physics: Physics, time_step: TimeStep, solver: StepSolver) -> None:
        """Set up the neighbour list of the solver and remember the volume to keep.

        Args:
            body: Liquid body; changed in place.
            physics: Effects that act on the body.
            time_step: Step size control.
            solver: Step solver.
        """
        spacing = body.cloud.spacing
        self.body, self.physics, self.time_step, self.solver = body, physics, time_step, solver
        self.volume = body.volume()[0]
        self.neighbours = NeighbourList(solver.traits.support * spacing, SKIN * spacing)
        self.time, self.steps = 0.0, 0
        self.pace = np.zeros((body.cloud.surface_count, 3))  # mean velocity of the surface in the last step [m/s]

    def saved(self) -> dict[str, Any]:
        """Return the data that a checkpoint keeps; a flow of the same physics continues from it to the same bits."""
        return {name: getattr(self, name) for name in SAVED} | {
            "lines": [line.saved() for line in self.physics.lines],
            "solver": self.solver.saved(),
            "neighbours": self.neighbours.saved(),
        }

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        for name in SAVED:
            setattr(self, name, saved[name])
        for line, state in zip(self.physics.lines, saved["lines"], strict=True):
            line.restore(state)
        self.solver.restore(saved["solver"])
        self.neighbours.restore(saved["neighbours"])

    def set_plate_motions(self, motions: Sequence[PlateMotion]) -> None:
        """Set the motions of the plates for the following steps; plates without a motion rest."""
        self.physics = replace(self.physics, motions=motions)

    def motions_after_split(self, side: float) -> tuple[PlateMotion, ...]:
        """Return the motions that the plate of a drop continues after the body has split.

        Args:
            side: Side of the drop's plate, as ``Plate.side``.
        """
        plates = self.body.plates
        motions = [m.after_split(0) for m in self.physics.motions if plates[m.wall].side == side]
        return tuple(motion for motion in motions if motion is not None)

    def step(self) -> StepRecord:
        """Advance one time step.

        Raises:
            SolveFailed: The linear solve failed.
            FloatingPointError: A position is not finite.
            StepCollapsed: A particle would move too far in the shortest step.
        """
        body = self.body
        for event in self.physics.events:
            event.update(body)
        correct_volume(body, self.physics, self.volume)  # events move the vertices that they pin
        before = body.points[: body.cloud.surface_count].copy()
        motion, flips = self._descend()
        self.neighbours.update(body.points)
        body.points[body.cloud.surface_count :] += interior_shift(body, self.neighbours, self.outward())
        self.steps += 1
        self.time += self.time_step.size
        self.pace = (body.points[: len(before)] - before) / self.time_step.size
        record = self._record(flips, motion)
        # With inertia the next step will be as fast.
        self.time_step.grow(motion.top_speed if self.physics.momenta else 0.0)
        return record

    def outward(self) -> Floats:
        """Return the outward unit normals at the vertices of the surface, shape (s, 3)."""
        return vertex_normals(self.body.points, self.body.triangles, self.body.cloud.surface_count)

    def profile(self) -> Profile:
        """Return the areas of the horizontal cross-sections against height."""
        body = self.body
        return fit_profile(body.points, body.triangles, body.span(), body.cloud.parts)

    def snapshot(self) -> Snapshot:
        """Return a copy of the current particles and surface."""
        body = self.body.whole()
        return Snapshot(self.time, body.points.copy(), body.triangles.copy())

    def _descend(self) -> tuple[Motion, int]:
        """Move so that the energy does not rise; return the motion and the number of flips."""
        body, start = self.body, StepStart.of(self.body, self.physics.lines)
        highest = highest_energy(body, self.physics, self.solver, self.time_step.size)
        traits = self.solver.traits
        smoothing = MeshSmoothing(traits.smoothing_passes, self.steps % FLIP_INTERVAL == 0, traits.flip_worth, highest)
        attempted = [event.attempt(body) for event in self.physics.events]
        if any(attempted):
            correct_volume(body, self.physics, self.volume)
            time_step = replace(self.time_step)
            done = self._move(smoothing)
            if done is not None:
                return done
            start.restore(body, self.physics.lines)
            self.time_step = time_step
        while True:
            done = self._move(smoothing)
            if done is not None:
                return done
            start.restore(body, self.physics.lines)
            self.time_step.cut_for_energy()

    def _move(self, smoothing: MeshSmoothing) -> tuple[Motion, int] | None:
        """Move the body by one step; return the motion and the number of flips, or None if its energy is too high."""
        body = self.body
        motion = self._accelerate(self.solver.prepare(body, self.physics, self.neighbours))
        steps = 1.0 if np.isinf(smoothing.highest) else self._steady_steps(motion)
        if steps > 1.0:
            start, time_step = StepStart.of(body, self.physics.lines), replace(self.time_step)
            self.time_step.prolong(steps)
            flips = self._follow(motion, smoothing)
            if flips is not None:
                return motion, flips
            start.restore(body, self.physics.lines)
            self.time_step = time_step
        flips = self._follow(motion, smoothing)
        return None if flips is None else (motion, flips)

    def _follow(self, motion: Motion, smoothing: MeshSmoothing) -> int | None:
        """Move the body and smooth its surface; return the number of flips, or None if its energy is too high."""
        self.body.move(self.time_step.size, motion.transport, motion.twists)
        return smooth_surface(self.body, self.physics, self.volume, smoothing)

    def _steady_steps(self, motion: Motion) -> float:
        """Return the number of steps for which a steady motion may continue at once.

        The motion may change at its present rate until nothing of it is left. A body that has overflowed both pads
        slides as a whole, resisted only by a mass term that grows with smaller steps, and would creep. The motion must
        equal the last motion, smoothing included: where smoothing undoes the motion by the forces, the
        forces cause the same motion in each step, too, but to no effect.
        """
        if self.solver.traits.keeps_time:
            return 1.0
        normal = self._normals()
        last, now = ((field[: len(normal)] * normal).sum(axis=1) for field in (self.pace, motion.transport))
        change, whole = float(np.linalg.norm(now - last)), float(np.linalg.norm(now))
        if change >= STEADY * whole:
            return 1.0
        return min(
            whole / max(change, float(np.finfo(float).tiny)), self.time_step.steps_within_reach(motion.top_speed)
        )

    def _accelerate(self, prepared: PreparedStep) -> Motion:
        """Solve for velocity and pressure, with a smaller step if a particle would move too far."""
        body = self.body
        while True:
            motion = prepared.solve(self.time_step.size, self.volume)
            if self._accepts(motion):
                break
        body.velocity, body.pressure = motion.velocity, motion.pressure
        body.surface_pressure = motion.surface_pressure
        return motion

    def _accepts(self, motion: Motion) -> bool:
        """Return whether no particle moves too far; a collapsed time step raises an error with the position."""
        try:
            return self.time_step.accepts(motion.top_speed)
        except StepCollapsed as error:
            particle = int((motion.transport**2).sum(axis=1).argmax())
            position = ", ".join(f"{coordinate:.4g}" for coordinate in self.body.points[particle])
            where = f"step {self.steps + 1} at time {self.time:.4g} s, particle {particle} at ({position}) m"
            raise StepCollapsed(f"{where}: {error}") from error

    def _standoff(self) -> float:
        """Return the height of the second plate above the first one [m], NaN with fewer plates."""
        first, *others = self.body.plates or (None,)
        return float(first.local(others[0].origin[None])[0, 2]) if first and others else float("nan")

    def _normals(self) -> Floats:
        """Return unit normals of the surface, within walls on contact lines, zero at pinned vertices, (s, 3)."""
        normal = self.physics.admit(self.body, self.body.volume()[1])[: self.body.cloud.surface_count]
        return normal / np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)[:, None]

    def _record(self, flips: int, motion: Motion) -> StepRecord:
        body, size = self.body, self.time_step.size
        pace = self.pace if motion.drift is None else self.pace - motion.drift[: len(self.pace)]
        speed = float(np.abs((pace * self._normals()).sum(axis=1)).max())
        return StepRecord(
            step=self.steps,
            time=self.time,
            time_step=size,
            binding=self.time_step.binding,
            height=float(np.ptp(body.points[: body.cloud.surface_count, 2])),
            volume=body.cloud.parts * body.volume()[0],
            energy=body.cloud.parts * self.physics.energy(body),
            speed=speed,
            displacement=speed * size / body.cloud.spacing,
            flips=flips,
            iterations=motion.iterations,
            standoff=self._standoff(),
            pull=motion.pull,
        )
