"""Loads: objects in a list, each with its part in a step and the work that it does.

A step asks every load in turn: ``drive`` prescribes velocities, ``add`` adds forces at nodes, ``collect`` takes half a
step's work. The work of a force over a step is the mean of its values at both ends times the displacement between
them, so that with ``ExplicitMotion.kinetic_energy`` the energy balance of a linear model is exact at any step.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.errors import LoadError
from reflowshock.fem.forces.energy import Energy
from reflowshock.fem.loads.pulse import HalfSine, Pulse
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.step_levels import levels_of
from reflowshock.fem.parallel.checkpoint_state import Entry, Rows, Same, State, Sum

# A package that is dropped looks towards the ground, so the table's upward acceleration points along -z and the board,
# seen from the table, is pushed along +z; so does its weight.
DOWN = np.array([0.0, 0.0, 1.0])
Kept = Literal["sum", "same", "nodes"]


class Loaded(ABC):
    """A motion under loads, explicit or implicit: what loads ask of it, and what follows from their list.

    Attributes:
        body: The model.
        step: Time step [s].
        time: [s].
        displacement: ``(n, 3)`` [m] at ``time``.
        velocity: ``(n, 3)`` [m/s], of explicit steps at ``time - step / 2``.
        force: ``(n, 3)`` [N] at ``time``, summed over ranks, slaves' moved to their masters; without body force.
        gravity: ``(3,)`` [m/s^2], sum of the loads' accelerations at ``time``.
        mobility: ``(n, 3)`` [1/kg] inverse masses, zero where the velocity is prescribed; of explicit steps.
        counted_mass: ``(n,)`` [kg] that counts in the energy balance of this rank.
    """

    body: Body
    step: float
    time: float
    displacement: NDArray[np.float64]
    velocity: NDArray[np.float64]
    force: NDArray[np.float64]
    gravity: NDArray[np.float64]
    mobility: NDArray[np.float64]
    counted_mass: NDArray[np.float64]
    _loads: Sequence["Load"]

    @abstractmethod
    def hold(self, nodes: NDArray[np.integer], component: int) -> None:
        """Let a velocity component of local nodes no longer follow from forces."""

    @abstractmethod
    def add_mass(self, nodes: NDArray[np.integer], mass: NDArray[np.float64]) -> None:
        """Add masses ``(k,)`` [kg] that the energy balance does not count to local nodes, all of them free."""

    @abstractmethod
    def acceleration(self, nodes: NDArray[np.integer] | slice = slice(None)) -> NDArray[np.float64]:
        """Return the acceleration ``(k, 3)`` [m/s^2] of some local nodes, zero where it does not follow from forces."""

    def body_acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the sum of all loads' accelerations ``(3,)`` [m/s^2] at a time [s]."""
        return sum((load.acceleration(time) for load in self._loads), np.zeros(3))

    def base_displacement(self) -> NDArray[np.float64]:
        """Return the displacement ``(3,)`` [m] of the frame in which results are given; zero but with a large mass."""
        return sum((load.base_displacement(self.time) for load in self._loads), np.zeros(3))

    def base_velocity(self) -> NDArray[np.float64]:
        """Return the velocity ``(3,)`` [m/s] of that frame."""
        return sum((load.base_velocity(self.time) for load in self._loads), np.zeros(3))

    def internal_energy(self) -> Energy:
        """Return the energies [J] of this rank's elements."""
        return sum((term.energy(self.displacement) for term in self.body.terms), Energy())


class Load:
    """What acts on one model on one rank; each kind overrides its part. By itself it does nothing.

    Attributes:
        account: Where the energy balance puts the work.
        kept: What changes with time, and what it is: a ``sum`` over ranks, the ``same`` on all, or of all ``nodes``.
        work: Work done on this rank's share of the model so far [J].
    """

    account: ClassVar[Literal["external", "damping"]] = "external"
    kept: ClassVar[Mapping[str, Kept]] = {}
    work: float = 0.0

    def acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the acceleration ``(3,)`` [m/s^2] that acts on every kilogram at a time [s]."""
        return np.zeros(3)

    def base_displacement(self, time: float) -> NDArray[np.float64]:
        """Return the displacement ``(3,)`` [m] of the frame in which results are given, at the motion's time [s]."""
        return np.zeros(3)

    def base_velocity(self, time: float) -> NDArray[np.float64]:
        """Return the velocity ``(3,)`` [m/s] of that frame, at the motion's time [s]."""
        return np.zeros(3)

    def begin(self, motion: Loaded) -> None:
        """Take part in the masses and free components of a motion at rest."""

    def carry(self, body: Body) -> None:
        """Act in the small steps of levels inside the model, too, once all know what moves; collective."""

    def drive(self, velocity: NDArray[np.float64], time: float) -> None:
        """Prescribe rows of the mean velocity ``(n, 3)`` [m/s] of the step that begins at a time [s]."""

    def add(self, motion: Loaded) -> None:
        """Add the force at the motion's time to ``motion.force``, which is already summed over ranks."""

    def remove(self, force: NDArray[np.float64]) -> None:
        """Subtract from a copy of ``motion.force`` what ``add`` added last."""

    def release(self, force: NDArray[np.float64]) -> None:
        """Subtract the force of a support from a copy of ``motion.force``."""

    def collect(self, motion: Loaded) -> None:
        """Add half a step's work of the force at the motion's time at its velocity; all forces are complete."""

    def state(self, body: Body) -> State:
        """Return all that changes with time, for a checkpoint."""
        kinds: dict[Kept, Callable[[Any], Entry]] = {"sum": Sum, "same": Same, "nodes": partial(Rows, body.local.nodes)}
        return {name: kinds[kind](getattr(self, name)) for name, kind in self.kept.items()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from the values of what ``state`` returned."""
        for name, value in state.items():
            setattr(self, name, value)


@dataclass(frozen=True)
class BodyAcceleration(Load):
    """A uniform acceleration: gravity, or input-G in the frame of the supports, which are held.

    Attributes:
        direction: ``(3,)`` unit vector in which the body is pushed.
        pulse: Acceleration [m/s^2].
    """

    direction: NDArray[np.float64]
    pulse: Pulse

    def acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the acceleration ``(3,)`` [m/s^2]."""
        return self.direction * self.pulse.value(time)


def half_sine_drop(peak: float, duration: float) -> BodyAcceleration:
    """Return the input-G of a drop with the package facing down: a half sine [m/s^2, s] that pushes along +z."""
    return BodyAcceleration(DOWN, HalfSine(peak, duration))


@dataclass
class NodalForces(Load):
    """Dead forces at nodes: a pattern times a pulse.

    Attributes:
        nodes: ``(k,)`` local nodes.
        pattern: ``(k, 3)`` force [N] at a pulse of one, summed over ranks and equal on all that hold the node.
        pulse: Its course.
        owned: ``(k,)`` whether the node counts on this rank.
    """

    nodes: NDArray[np.int32]
    pattern: NDArray[np.float64]
    pulse: Pulse
    owned: NDArray[np.bool_]
    kept: ClassVar[Mapping[str, Kept]] = {"work": "sum", "_factor": "same"}
    work: float = 0.0
    _factor: float = 0.0

    @classmethod
    def build(cls, body: Body, nodes: NDArray[np.integer], forces: NDArray[np.float64], pulse: Pulse) -> "NodalForces":
        """Take forces ``(k, 3)`` [N] at input nodes ``(k,)`` to local nodes, slaves' to their masters; collective."""
        local = body.local.locate(nodes)
        here = np.flatnonzero(local >= 0)
        here = here[body.shared.owned[local[here]]]
        pattern = np.zeros((len(body.mass), 3))
        pattern[local[here]] = forces[here]
        body.tie.gather(pattern)
        body.shared.add(pattern)
        rows, pattern, owned = nodal(body, pattern)
        return cls(rows, pattern, pulse, owned)

    def carry(self, body: Body) -> None:
        """Add what levels make of the pattern."""
        pattern = np.zeros((len(body.mass), 3))
        pattern[self.nodes] = self.pattern
        self.nodes, self.pattern, self.owned = nodal(body, pattern + carried(body, pattern, np.zeros(3)))

    def add(self, motion: Loaded) -> None:
        """Add the force of the motion's time."""
        self._factor = self.pulse.value(motion.time)
        motion.force[self.nodes] += self._factor * self.pattern

    def remove(self, force: NDArray[np.float64]) -> None:
        """Subtract it from a copy."""
        force[self.nodes] -= self._factor * self.pattern

    def collect(self, motion: Loaded) -> None:
        """Add half a step's work."""
        power = np.sum(self.pattern[self.owned] * motion.velocity[self.nodes[self.owned]])
        self.work += 0.5 * motion.step * self._factor * float(power)


NodalPattern = tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.bool_]]


def nodal(body: Body, pattern: NDArray[np.float64]) -> NodalPattern:
    """Return the local nodes ``(k,)`` where a pattern ``(n, 3)`` is not zero, its rows, and which this rank counts."""
    rows = np.flatnonzero(pattern.any(axis=1)).astype(np.int32)
    return rows, pattern[rows], body.shared.owned[rows]


def carried(body: Body, load: NDArray[np.float64], fall: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what levels add to a load ``(n, 3)`` [N] and a fall, see ``SubsteppedElements.carry``; collective."""
    force = sum((levels.carry(load, fall) for levels in levels_of(body.terms)), np.zeros_like(load))
    body.shared.add(force)
    return force


class FineSupports(Load):
    """How supports of elements in levels bear body forces: what levels add to them.

    Attributes:
        patterns: Per axis, for a unit acceleration of the body along it: local nodes ``(k,)``, their forces ``(k, 3)``
            [N] summed over ranks, whether they count on this rank. Most supports bear nothing along most axes.
    """

    kept: ClassVar[Mapping[str, Kept]] = {"work": "sum", "_factor": "same"}

    def __init__(self) -> None:
        """Begin without acceleration."""
        self.patterns: list[NodalPattern] = []
        self._factor = np.zeros(3)

    def carry(self, body: Body) -> None:
        """Find the patterns."""
        nothing = np.zeros((len(body.mass), 3))
        self.patterns = [nodal(body, carried(body, nothing, fall)) for fall in np.eye(3)]

    def add(self, motion: Loaded) -> None:
        """Add the force for the motion's body acceleration."""
        self._factor = motion.gravity
        for factor, (nodes, force, _) in self._acting():
            motion.force[nodes] += factor * force

    def remove(self, force: NDArray[np.float64]) -> None:
        """Subtract it from a copy."""
        for factor, (nodes, own, _) in self._acting():
            force[nodes] -= factor * own

    def collect(self, motion: Loaded) -> None:
        """Add half a step's work."""
        for factor, (nodes, force, owned) in self._acting():
            power = np.sum(force[owned] * motion.velocity[nodes[owned]])
            self.work += 0.5 * motion.step * factor * float(power)

    def _acting(self) -> Iterator[tuple[float, NodalPattern]]:
        """Yield the accelerations of nodes with supports, with their patterns."""
        for factor, pattern in zip(self._factor, self.patterns, strict=True):
            if factor and len(pattern[0]):
                yield float(factor), pattern


@dataclass
class PrescribedVelocity(Load):
    """One velocity component of some nodes follows a pulse; its work is the work of the reaction.

    Attributes:
        nodes: ``(k,)`` local nodes.
        component: 0, 1 or 2.
        pulse: Velocity [m/s].
    """

    nodes: NDArray[np.int32]
    component: int
    pulse: Pulse
    kept: ClassVar[Mapping[str, Kept]] = {"work": "sum"}
    step: float = field(default=0.0, init=False)
    work: float = field(default=0.0, init=False)

    def begin(self, motion: Loaded) -> None:
        """Take the component out of the free ones.

        Raises:
            LoadError: A node is held or tied in this component.
        """
        if not motion.body.free[self.nodes, self.component].all():
            raise LoadError(
                f"prescribed motion along {'xyz'[self.component]} acts on nodes that are held or tied there"
            )
        self.step = motion.step
        motion.hold(self.nodes, self.component)

    def drive(self, velocity: NDArray[np.float64], time: float) -> None:
        """Set the mean velocity of the step, so that displacements are exact."""
        velocity[self.nodes, self.component] = self.mean(time)

    def mean(self, time: float) -> float:
        """Return the mean velocity [m/s] of the step that begins at a time [s]; before the start, the mirror image."""
        if time < -0.5 * self.step:
            return 2.0 * self.pulse.value(0.0) - self.mean(0.0)
        return (self.pulse.integral(time + self.step) - self.pulse.integral(time)) / self.step

    def collect(self, motion: Loaded) -> None:
        """Add half a step's work of the reaction m a - f - m g."""
        before, after = self.mean(motion.time - self.step), self.mean(motion.time)
        acceleration = (after - before) / self.step - motion.gravity[self.component]
        mass = motion.counted_mass[self.nodes]
        owned = motion.body.shared.owned[self.nodes]
        reaction = mass * acceleration - np.where(owned, motion.force[self.nodes, self.component], 0.0)
        self.work += 0.5 * self.step * float(reaction @ motion.velocity[self.nodes, self.component])
