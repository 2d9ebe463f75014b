"""Loads: objects in a list, each with its forces and the work that they do.

A step calls the methods of every load in turn: ``drive`` prescribes velocities, ``add`` adds nodal forces, ``collect``
adds the work of half a step. The work of a force over a step is the mean of its values at both ends times the
displacement between them, so that with ``ExplicitMotion.kinetic_energy`` the energy balance of a linear model is exact
at any step.
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

# A dropped package faces the ground, so the upward acceleration of the table points along -z. In the frame of the table
# the board is therefore pushed along +z, which is also the direction of its weight.
DOWN = np.array([0.0, 0.0, 1.0])
Checkpointed = Literal["sum", "same", "nodes"]


class Loaded(ABC):
    """Motion of a model under a list of loads, with explicit or implicit steps.

    Attributes:
        body: Model on this rank.
        step: Time step [s].
        time: Time of the displacement [s].
        displacement: Nodal displacement at ``time``, shape (n, 3) [m].
        velocity: Nodal velocity, shape (n, 3) [m/s]; explicit steps have it at ``time - step / 2``.
        force: Nodal force at ``time`` without body forces, shape (n, 3) [N]; summed over ranks, with the forces of
            slave nodes moved to their masters.
        gravity: Sum of the body accelerations of the loads at ``time``, shape (3,) [m/s^2].
        ahead: Force that explicit steps add to ``force`` in the coming step, shape (n, 3) or (0, 3) [N].
        mobility: Inverse mass of explicit steps, zero where the velocity is prescribed, shape (n, 3) [1/kg].
        carried: Local nodes of a large mass, which moves them as the table moves, shape (k,).
        counted_mass: Nodal mass in the energy balance of this rank, shape (n,) [kg].
    """

    body: Body
    step: float
    time: float
    displacement: NDArray[np.float64]
    velocity: NDArray[np.float64]
    force: NDArray[np.float64]
    ahead: NDArray[np.float64]
    gravity: NDArray[np.float64]
    mobility: NDArray[np.float64]
    carried: NDArray[np.integer]
    counted_mass: NDArray[np.float64]
    _loads: Sequence["Load"]

    @abstractmethod
    def hold(self, nodes: NDArray[np.integer], component: int) -> None:
        """Exclude a velocity component (0, 1 or 2) of local nodes from the equation of motion: it is prescribed."""

    @abstractmethod
    def add_mass(self, nodes: NDArray[np.integer], mass: NDArray[np.float64]) -> None:
        """Add masses ``(k,)`` [kg] to free local nodes ``(k,)``; the energy balance leaves them out."""

    @abstractmethod
    def acceleration(self, nodes: NDArray[np.integer] | slice = slice(None)) -> NDArray[np.float64]:
        """Return the acceleration ``(k, 3)`` [m/s^2] of some local nodes, zero where it does not follow from forces."""

    def body_acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the sum of all loads' accelerations ``(3,)`` [m/s^2] at a time [s]."""
        return sum((load.acceleration(time) for load in self._loads), np.zeros(3))

    def base_displacement(self) -> NDArray[np.float64]:
        """Return the displacement ``(3,)`` [m] of the frame of results; zero unless a large mass moves the base."""
        return sum((load.base_displacement(self.time) for load in self._loads), np.zeros(3))

    def base_velocity(self) -> NDArray[np.float64]:
        """Return the velocity ``(3,)`` [m/s] of the frame of results."""
        return sum((load.base_velocity(self.time) for load in self._loads), np.zeros(3))

    def internal_energy(self) -> Energy:
        """Return the energies [J] of this rank's elements."""
        return sum((term.energy(self.displacement) for term in self.body.terms), Energy())


class Load:
    """Base class of the loads of one model on one rank; its methods do nothing, and each kind overrides its part.

    Attributes:
        account: Term of the energy balance that receives the work.
        checkpointed: Names of the attributes that change with time, each with its kind: a ``sum`` over ranks, the
            ``same`` on all ranks, or rows of all local ``nodes``.
        work: Work done so far on this rank's share of the model [J].
        frame_work: External work in addition: of damping at the velocity of the table [J].
    """

    account: ClassVar[Literal["external", "damping"]] = "external"
    checkpointed: ClassVar[Mapping[str, Checkpointed]] = {}
    work: float = 0.0
    frame_work: float = 0.0

    def acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the acceleration ``(3,)`` [m/s^2] of all masses at a time [s], i.e. the body force per mass."""
        return np.zeros(3)

    def base_displacement(self, time: float) -> NDArray[np.float64]:
        """Return the displacement ``(3,)`` [m] of the frame of results at the motion's time [s]."""
        return np.zeros(3)

    def base_velocity(self, time: float) -> NDArray[np.float64]:
        """Return the velocity ``(3,)`` [m/s] of the frame of results at the motion's time [s]."""
        return np.zeros(3)

    def begin(self, motion: Loaded) -> None:
        """Add masses to a motion at rest, or prescribe components of its velocity, before the first step."""

    def carry(self, body: Body) -> None:
        """Include the response of elements in step levels, after ``begin`` of all loads; collective."""

    def drive(self, velocity: NDArray[np.float64], time: float) -> None:
        """Set prescribed rows of the mean velocity ``(n, 3)`` [m/s] of the step that begins at a time [s]."""

    def add(self, motion: Loaded) -> None:
        """Add the force at the motion's time to ``motion.force``, which is already summed over ranks."""

    def remove(self, force: NDArray[np.float64]) -> None:
        """Subtract the force of the latest ``add`` from a copy of ``motion.force``, shape (n, 3) [N]."""

    def release(self, force: NDArray[np.float64]) -> None:
        """Subtract the load from a copy of ``motion.force`` if it stands for a support."""

    def collect(self, motion: Loaded) -> None:
        """Add the work of half a step, with force and velocity of the motion, after all forces are added."""

    def state(self, body: Body) -> State:
        """Return the values of the attributes that change with time, for a checkpoint."""
        nodes = partial(Rows, body.local.nodes)
        kinds: dict[Checkpointed, Callable[[Any], Entry]] = {"sum": Sum, "same": Same, "nodes": nodes}
        return {name: kinds[kind](getattr(self, name)) for name, kind in self.checkpointed.items()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Set the attributes of ``state`` from a checkpoint."""
        for name, value in state.items():
            setattr(self, name, value)


@dataclass(frozen=True)
class BodyAcceleration(Load):
    """Uniform body acceleration: gravity, or input-G in the frame of the supports, which are held.

    Attributes:
        direction: Unit vector along the force on the body, shape (3,).
        pulse: Acceleration [m/s^2].
    """

    direction: NDArray[np.float64]
    pulse: Pulse

    def acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the acceleration ``(3,)`` [m/s^2]."""
        return self.direction * self.pulse.value(time)


def half_sine_drop(peak: float, duration: float) -> BodyAcceleration:
    """Return the half-sine body acceleration of a drop with the package facing down; it acts along +z.

    Args:
        peak: Peak acceleration [m/s^2].
        duration: Duration of the half sine [s].
    """
    return BodyAcceleration(DOWN, HalfSine(peak, duration))


@dataclass
class NodalForces(Load):
    """Nodal forces of fixed direction: a pattern times a pulse.

    Attributes:
        nodes: Local nodes, shape (k,).
        pattern: Nodal forces at the pulse value one, shape (k, 3) [N]; summed over ranks, equal on all ranks that hold
            the node.
        pulse: Factor of the pattern over time.
        owned: Whether this rank owns the node and counts its work, shape (k,).
    """

    nodes: NDArray[np.int32]
    pattern: NDArray[np.float64]
    pulse: Pulse
    owned: NDArray[np.bool_]
    checkpointed: ClassVar[Mapping[str, Checkpointed]] = {"work": "sum", "_factor": "same"}
    work: float = 0.0
    _factor: float = 0.0

    @classmethod
    def build(cls, body: Body, nodes: NDArray[np.integer], forces: NDArray[np.float64], pulse: Pulse) -> "NodalForces":
        """Return the load of forces ``(k, 3)`` [N] at global nodes ``(k,)``; those on slaves move to their masters.

        Collective over the model.
        """
        local = body.local.locate(nodes)
        here = np.flatnonzero(local >= 0)
        here = here[body.shared.owned[local[here]]]
        pattern = np.zeros((len(body.mass), 3))
        pattern[local[here]] = forces[here]
        body.tie.gather(pattern)
        body.shared.add(pattern)
        rows, pattern, owned = _nodal_pattern(body, pattern)
        return cls(rows, pattern, pulse, owned)

    def carry(self, body: Body) -> None:
        """Add the reaction of the step levels to the pattern."""
        pattern = np.zeros((len(body.mass), 3))
        pattern[self.nodes] = self.pattern
        reaction = _level_reaction(body, pattern, np.zeros(3))
        self.nodes, self.pattern, self.owned = _nodal_pattern(body, pattern + reaction)

    def add(self, motion: Loaded) -> None:
        """Add the pattern times the pulse at the motion's time."""
        self._factor = self.pulse.value(motion.time)
        motion.force[self.nodes] += self._factor * self.pattern

    def remove(self, force: NDArray[np.float64]) -> None:
        """Subtract the force of the latest ``add`` from a copy of the motion's force."""
        force[self.nodes] -= self._factor * self.pattern

    def collect(self, motion: Loaded) -> None:
        """Add the work of half a step."""
        power = np.sum(self.pattern[self.owned] * motion.velocity[self.nodes[self.owned]])
        self.work += 0.5 * motion.step * self._factor * float(power)


NodalPattern = tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.bool_]]


def _nodal_pattern(body: Body, pattern: NDArray[np.float64]) -> NodalPattern:
    """Return the local nodes ``(k,)`` where a pattern ``(n, 3)`` is not zero, its rows there, and which are owned."""
    rows = np.flatnonzero(pattern.any(axis=1)).astype(np.int32)
    return rows, pattern[rows], body.shared.owned[rows]


def _level_reaction(body: Body, load: NDArray[np.float64], fall: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the forces ``(n, 3)`` [N] that step levels add to a steady load; collective over the model.

    Args:
        body: Model on this rank.
        load: Steady nodal load, shape (n, 3) [N].
        fall: Steady body acceleration, shape (3,) [m/s^2], see ``SubsteppedElements.carry``.
    """
    force = sum((levels.carry(load, fall) for levels in levels_of(body.terms)), np.zeros_like(load))
    body.shared.add(force)
    return force


class FineSupports(Load):
    """Forces that step levels with supports add under a body acceleration.

    Attributes:
        patterns: Forces for a unit body acceleration along each axis: local nodes ``(k,)``, nodal forces ``(k, 3)`` [N]
            summed over ranks, and whether this rank owns the node. Along most axes most supports add none.
    """

    checkpointed: ClassVar[Mapping[str, Checkpointed]] = {"work": "sum", "_factor": "same"}

    def __init__(self) -> None:
        """Start without patterns and acceleration."""
        self.patterns: list[NodalPattern] = []
        self._factor = np.zeros(3)

    def carry(self, body: Body) -> None:
        """Compute the patterns."""
        no_load = np.zeros((len(body.mass), 3))
        self.patterns = [_nodal_pattern(body, _level_reaction(body, no_load, fall)) for fall in np.eye(3)]

    def add(self, motion: Loaded) -> None:
        """Add the force for the motion's body acceleration."""
        self._factor = motion.gravity
        for factor, (nodes, force, _) in self._acting():
            motion.force[nodes] += factor * force

    def remove(self, force: NDArray[np.float64]) -> None:
        """Subtract the force of the latest ``add`` from a copy of the motion's force."""
        for factor, (nodes, pattern, _) in self._acting():
            force[nodes] -= factor * pattern

    def collect(self, motion: Loaded) -> None:
        """Add the work of half a step."""
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
    """Velocity component of some nodes that follows a pulse; its work is the work of the reaction.

    Attributes:
        nodes: Local nodes, shape (k,).
        component: Component 0, 1 or 2 of the velocity.
        pulse: Velocity [m/s].
        step: Time step of the motion, set by ``begin`` [s].
    """

    nodes: NDArray[np.int32]
    component: int
    pulse: Pulse
    checkpointed: ClassVar[Mapping[str, Checkpointed]] = {"work": "sum"}
    step: float = field(default=0.0, init=False)
    work: float = field(default=0.0, init=False)

    def begin(self, motion: Loaded) -> None:
        """Prescribe the component in the motion.

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
        """Set the mean velocity of the step, so that displacements at its end are exact."""
        velocity[self.nodes, self.component] = self.mean(time)

    def mean(self, time: float) -> float:
        """Return the mean velocity [m/s] of the step that begins at a time [s]; before zero, the pulse is mirrored."""
        if time < -0.5 * self.step:
            return 2.0 * self.pulse.value(0.0) - self.mean(0.0)
        return (self.pulse.integral(time + self.step) - self.pulse.integral(time)) / self.step

    def collect(self, motion: Loaded) -> None:
        """Add the work of the reaction m a - f - m g over half a step."""
        before, after = self.mean(motion.time - self.step), self.mean(motion.time)
        acceleration = (after - before) / self.step - motion.gravity[self.component]
        mass = motion.counted_mass[self.nodes]
        owned = motion.body.shared.owned[self.nodes]
        reaction = mass * acceleration - np.where(owned, motion.force[self.nodes, self.component], 0.0)
        self.work += 0.5 * self.step * float(reaction @ motion.velocity[self.nodes, self.component])
