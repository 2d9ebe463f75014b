"""Rayleigh damping C = alpha M + beta K: a force at the nodes, and the energy that it takes."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.forces.energy import InternalForce
from reflowshock.fem.forces.force import linear_terms
from reflowshock.fem.kernels.motion import add_damping, power
from reflowshock.fem.loads.load import Kept, Load, Loaded
from reflowshock.fem.loads.pretension import Pretension
from reflowshock.fem.model.body import Body


class RayleighDamping(Load):
    """Damping of the velocity: -alpha M v at the middle of the step, -beta K v half a step late.

    The mass term is implicit, -alpha M (v(t - dt/2) + v(t + dt/2)) / 2, which needs no smaller step. The stiffness term
    takes v(t - dt/2), as K v(t) would need a solve, and lowers the critical step (``estimate.damped_critical_step``).
    With v(t) = (v(t - dt/2) + dt a / 2) / (1 + alpha dt / 2), a without drag, no equation is left to solve.

    Attributes:
        force: ``(n, 3)`` [N] at the motion's time, summed over ranks.
    """

    account: ClassVar[Literal["external", "damping"]] = "damping"
    kept: ClassVar[Mapping[str, Kept]] = {"work": "sum", "force": "nodes"}

    def __init__(self, mass: float, stiffness: float, terms: Sequence[InternalForce]) -> None:
        """Make damping from coefficients.

        Args:
            mass: alpha [1/s].
            stiffness: beta [s].
            terms: Terms that are linear in the displacement, whose stiffness is K.
        """
        self.mass, self.stiffness = mass, stiffness
        self._terms = terms if stiffness else ()
        self.force = np.empty((0, 3))
        self._velocity = np.empty((0, 3))
        self._runs = np.empty((0, 2), np.int64)  # of nodes that this rank counts

    @classmethod
    def build(cls, body: Body, coefficients: tuple[float, float]) -> "RayleighDamping":
        """Make the damping of a body from alpha [1/s] and beta [s]; K is that of its elastic elements.

        The terms of the body serve for it where they are linear.
        """
        nonlinear = body.turns or any(term.history for term in body.terms)
        linear = [term for term in body.terms if not isinstance(term, Pretension)]
        return cls(*coefficients, linear_terms(body.elements) if nonlinear and coefficients[1] else linear)

    def begin(self, motion: Loaded) -> None:
        """Make room."""
        self.force = np.zeros_like(motion.force)
        if self._terms:
            self._velocity = np.empty_like(motion.velocity)
        edges = np.diff(motion.body.shared.owned, prepend=False, append=False)
        self._runs = np.flatnonzero(edges).reshape(-1, 2)

    def add(self, motion: Loaded) -> None:
        """Add both forces; those of the loads are there, those of elements too."""
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
        """Subtract both from a copy."""
        force -= self.force

    def collect(self, motion: Loaded) -> None:
        """Add half a step's work."""
        self.work += 0.5 * motion.step * power(self._runs, self.force, motion.velocity)
