"""Rayleigh damping C = alpha M + beta K: nodal forces and dissipated energy."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.forces.energy import InternalForce
from reflowshock.fem.forces.force import linear_terms
from reflowshock.fem.kernels.motion import add_damping, power
from reflowshock.fem.loads.load import Checkpointed, Load, Loaded
from reflowshock.fem.loads.pretension import Pretension
from reflowshock.fem.model.body import Body


class RayleighDamping(Load):
    """Rayleigh damping: -alpha M v at the middle of the step, -beta K v half a step late.

    The mass term is implicit, -alpha M (v(t - dt/2) + v(t + dt/2)) / 2, and does not lower the critical time step. The
    stiffness term uses v(t - dt/2), because K v(t) would require a solve; it lowers the critical time step
    (``estimate.damped_critical_step``). With v(t) = (v(t - dt/2) + dt a / 2) / (1 + alpha dt / 2), a being the
    acceleration without the mass term, the scheme is explicit.

    Attributes:
        force: Damping force at the time of the motion, summed over ranks, shape (n, 3) [N].
    """

    account: ClassVar[Literal["external", "damping"]] = "damping"
    checkpointed: ClassVar[Mapping[str, Checkpointed]] = {"work": "sum", "force": "nodes"}

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
        self._velocity = np.empty((0, 3))
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
        """Allocate the arrays."""
        self.force = np.zeros_like(motion.force)
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
        add_damping(motion.velocity, motion.mobility, motion.gravity, coefficients, (self.force, motion.force))

    def remove(self, force: NDArray[np.float64]) -> None:
        """Subtract both forces from a copy of the force of the motion."""
        force -= self.force

    def collect(self, motion: Loaded) -> None:
        """Add the work over half a step."""
        self.work += 0.5 * motion.step * power(self._runs, self.force, motion.velocity)
