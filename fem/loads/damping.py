"""Rayleigh damping C = alpha M + beta K: nodal forces and dissipated energy.

Mass-proportional damping brakes the motion relative to the table, whose velocity is zero unless a large mass moves it.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.forces.energy import InternalForce
from reflowshock.fem.forces.force import linear_terms
from reflowshock.fem.kernels.motion import add_damping, brake, power
from reflowshock.fem.loads.load import Checkpointed, Load, Loaded
from reflowshock.fem.loads.pretension import Pretension
from reflowshock.fem.model.body import Body

WEAK = 1e-4  # share of its velocity that a drag acting once in a window takes from a node


class RayleighDamping(Load):
    """Rayleigh damping: -alpha M v at the middle of the step, -beta K v half a step late; v is relative to the table.

    The mass term is implicit, -alpha M (v(t - dt/2) + v(t + dt/2)) / 2, and does not lower the critical time step. The
    stiffness term uses v(t - dt/2), because K v(t) would require a solve; it lowers the critical time step
    (``estimate.damped_critical_step``). With v(t) = (v(t - dt/2) + dt a / 2) / (1 + alpha dt / 2), a being the
    acceleration without the mass term, the scheme is explicit.

    Attributes:
        force: Damping force at the time of the motion, summed over ranks, shape (n, 3) [N].
        frame_work: Work of the damping force at the velocity of the table, which the table supplies [J].
    """

    account: ClassVar[Literal["external", "damping"]] = "damping"
    checkpointed: ClassVar[Mapping[str, Checkpointed]] = {"work": "sum", "frame_work": "sum", "force": "nodes"}

    def __init__(self, mass: float, stiffness: float, terms: Sequence[InternalForce]) -> None:
        """Store the coefficients and the force terms.

        Args:
            mass: Coefficient alpha of the mass [1/s].
            stiffness: Coefficient beta of the stiffness [s].
            terms: Force terms linear in the displacement, with the stiffness K.
        """
        self.mass, self.stiffness = mass, stiffness
        self._terms = terms if stiffness else ()
        self.force = np.empty((0, 3))
        self.frame_work = 0.0
        self._velocity, self._mobility = np.empty((0, 3)), np.empty((0, 3))
        self._frame = np.zeros((2, 3))  # body acceleration, and velocity of the table
        self._runs = np.empty((0, 2), np.int64)  # runs of nodes owned by this rank

    @classmethod
    def build(cls, body: Body, mass: float, stiffness: float) -> "RayleighDamping":
        """Return the damping of a body, with K the stiffness of its elastic elements.

        Linear force terms of the body are reused; otherwise linear terms are built for K.

        Args:
            body: Damped model.
            mass: Coefficient alpha of the mass [1/s].
            stiffness: Coefficient beta of the stiffness [s].
        """
        nonlinear = body.turns or any(term.history for term in body.terms)
        linear = [term for term in body.terms if not isinstance(term, Pretension)]
        return cls(mass, stiffness, linear_terms(body.elements) if nonlinear and stiffness else linear)

    def begin(self, motion: Loaded) -> None:
        """Allocate the arrays; nodes of a large mass move as the table does and have no drag."""
        self.force, self._mobility = np.zeros_like(motion.force), mobility_without_table(motion)
        if self._terms:
            self._velocity = np.empty_like(motion.velocity)
        edges = np.diff(motion.body.shared.owned, prepend=False, append=False)
        self._runs = np.flatnonzero(edges).reshape(-1, 2)

    def add(self, motion: Loaded) -> None:
        """Add both forces to the force of the motion, which includes all loads and elements."""
        self.force.fill(0.0)
        if self._terms:
            np.multiply(motion.velocity, self.stiffness, out=self._velocity)
            motion.body.tie.spread(self._velocity)
            for term in self._terms:
                term.add(self._velocity, self.force)
            motion.body.tie.gather(self.force)
            motion.body.shared.add(self.force)
        half = 0.5 * motion.step
        coefficients = self.mass / (1.0 + self.mass * half), half
        self._frame[:] = motion.gravity, motion.base_velocity()
        add_damping(motion.velocity, self._mobility, self._frame, coefficients, (self.force, motion.force))

    def remove(self, force: NDArray[np.float64]) -> None:
        """Subtract both forces from a copy of the force of the motion."""
        force -= self.force

    def collect(self, motion: Loaded) -> None:
        """Add the work over half a step."""
        half, base = 0.5 * motion.step, self._frame[1]
        by_frame = half * float(base @ self._counted_force()) if base.any() else 0.0
        self.work += half * power(self._runs, self.force, motion.velocity) - by_frame
        self.frame_work += by_frame

    def _counted_force(self) -> NDArray[np.float64]:
        """Return the sum of the force over the nodes that this rank owns, shape (3,) [N]."""
        return np.sum([self.force[first:end].sum(axis=0) for first, end in self._runs], axis=0)


class WindowDrag(Load):
    """Mass-proportional damping that acts once in a window of m steps, so that compiled code can take all of them.

    The impulse m dt d, d = -alpha M v, uses the mean velocity v before and after the step in which it acts, relative to
    the table. Its work m dt d.v is negative for every m dt, so it does not lower the critical time step. Only the share
    d is in the force of the motion; the others are in ``Loaded.ahead``, as with forces of path levels.

    Attributes:
        mass: Coefficient alpha of the mass [1/s].
        steps: Steps of a window, m.
        frame_work: Work of the damping force at the velocity of the table, which the table supplies [J].
    """

    account: ClassVar[Literal["external", "damping"]] = "damping"
    checkpointed: ClassVar[Mapping[str, Checkpointed]] = {"work": "sum", "frame_work": "sum", "_following": "sum"}

    def __init__(self, mass: float, steps: int) -> None:
        """Store the coefficient alpha [1/s] and the steps of a window."""
        self.mass, self.steps, self.frame_work = mass, steps, 0.0
        self._following = np.zeros(2)  # work of the coming step by the latest drag, in the frame and by the frame [J]
        self._mobility = np.empty((0, 3))

    @classmethod
    def once_a_window(cls, loads: Sequence[Load], steps: int, window: float = 0.0) -> list[Load]:
        """Return loads with weak, purely mass-proportional damping replaced by a drag that acts once in a window.

        Args:
            loads: Loads of a model.
            steps: Steps of a window.
            window: Duration of a window [s], in which the drag may change velocities by a share of ``WEAK``; zero
                if it is known to be short enough.
        """
        return [
            cls(load.mass, steps)
            if isinstance(load, RayleighDamping) and not load.stiffness and steps > 1 and load.mass * window <= WEAK
            else load
            for load in loads
        ]

    def begin(self, motion: Loaded) -> None:
        """Exclude the nodes of a large mass."""
        self._mobility = mobility_without_table(motion)

    def brake(self, motion: Loaded, part: float = 1.0) -> None:
        """Add the drag at the end of a window, or ``part`` of it, to the force of the motion and to ``ahead``."""
        mass, half = part * self.mass, 0.5 * motion.step
        coefficients = mass / (1.0 + mass * self.steps * half), motion.step, float(self.steps)
        frame = np.array([motion.gravity, motion.base_velocity()])
        forces, nodes = (motion.force, motion.ahead), (self._mobility, motion.body.shared.owned)
        before, after, force = brake(motion.velocity, forces, nodes, frame, coefficients)
        impulse = half * self.steps
        by_frame = impulse * float(frame[1] @ force)
        self.work += self._following[0] + impulse * before
        self.frame_work += self._following[1] + by_frame
        self._following = np.array([impulse * after, by_frame])


def mobility_without_table(motion: Loaded) -> NDArray[np.float64]:
    """Return the inverse nodal masses of a motion, zero at nodes of a large mass, which represents the drop table.

    Args:
        motion: Motion with its ``mobility`` (inverse mass, zero where the velocity is prescribed) and the nodes that
            carry a large mass.

    Returns:
        Inverse mass of each node and component, shape (n, 3) [1/kg]; not a copy if no node carries one.
    """
    if not len(motion.carried):
        return motion.mobility
    mobility = motion.mobility.copy()
    mobility[motion.carried] = 0.0
    return mobility
