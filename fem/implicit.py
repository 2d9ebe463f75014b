"""Implicit time integration of linear elastic models: Newmark's method with the HHT-alpha average of forces.

    M a' + (1 + alpha) K u' - alpha K u = (1 + alpha) F' - alpha F,
    u' = u + h v + h^2 ((1/2 - beta) a + beta a'),   v' = v + h ((1 - gamma) a + gamma a'),
    beta = (1 - alpha)^2 / 4,   gamma = 1/2 - alpha                       (Hilber, Hughes & Taylor, EESD 5, 1977)

Second order and stable at any step for -1/3 <= alpha <= 0. alpha = 0 is the trapezoidal rule, which keeps the energy of
a linear model to the last digits whatever the step: the default, because an oracle's balance then shows every mistake.
Negative alpha damps what the step does not resolve, for loads that start with a jump.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fem.body import Body
from fem.factorisation import Factorisation
from fem.global_matrix import Equations
from fem.loads import Load


class ImplicitMotion:
    """The state of one model on one rank, and its step; the surface of ``motion.Motion``.

    Attributes:
        body: The model.
        step: h [s].
        time: [s].
        displacement: ``(n, 3)`` [m] at ``time``.
        velocity: ``(n, 3)`` [m/s] at ``time``.
        force: ``(n, 3)`` [N] at ``time`` after ``update_force``: internal, summed over ranks, slaves' moved to masters.
        external_work: Work of the loads on this rank's share of the nodes [J].
        factor: The factored matrix of a step.
    """

    def __init__(self, equations: Equations, loads: Sequence[Load], step: float, alpha: float = 0.0) -> None:
        """Start at rest; collective.

        Args:
            equations: The model.
            loads: Body accelerations.
            step: h [s].
            alpha: Of the HHT method, from -1/3 to 0.

        Raises:
            ValueError: Step or alpha out of range.
        """
        if not step > 0.0:
            raise ValueError(f"the implicit time step is {step:g} s, must be > 0")
        if not -1.0 / 3.0 <= alpha <= 0.0:
            raise ValueError(f"alpha of the HHT method is {alpha:g}, allowed are -1/3 to 0")
        self.body: Body = equations.body
        self.step, self.time, self.external_work = step, 0.0, 0.0
        self._equations, self._loads, self._alpha = equations, loads, alpha
        self._beta, self._gamma = 0.25 * (1.0 - alpha) ** 2, 0.5 - alpha
        mass = equations.mass()
        matrix = equations.stiffness()
        matrix.scale((1.0 + alpha) * self._beta * step**2)
        matrix.setDiagonal(matrix.getDiagonal() + mass)
        self.factor = Factorisation(matrix)
        self._right, self._solution = mass.duplicate(), mass.duplicate()
        self.displacement, self.velocity, self.force, self._acceleration = np.zeros((4, len(self.body.mass), 3))
        self._external = self.external_force(0.0)
        self.restart()

    def restart(self) -> None:
        """Take displacement and velocity as they are now for the state at ``time``."""
        self.body.tie.spread(self.displacement)
        self.body.tie.spread(self.velocity)
        self.update_force()
        mass = np.where(self.body.mass > 0.0, self.body.mass, np.inf)[:, None]
        self._acceleration[:] = np.where(self.body.free, (self._external + self.force) / mass, 0.0)
        self.body.tie.spread(self._acceleration)

    def external_force(self, time: float) -> NDArray[np.float64]:
        """Return the force of all loads ``(n, 3)`` [N] at a time [s]."""
        acceleration = sum((load.acceleration(time) for load in self._loads), np.zeros(3))
        return self.body.mass[:, None] * acceleration

    def advance(self) -> None:
        """Move from ``time`` to ``time + h``; the force is then out of date. Collective."""
        h, alpha, before = self.step, self._alpha, self.displacement.copy()
        self.displacement += h * self.velocity + h**2 * (0.5 - self._beta) * self._acceleration
        self.velocity += h * (1.0 - self._gamma) * self._acceleration
        self.time += h
        external, force = self._external, self.force.copy()
        self._external = self.external_force(self.time)
        self.update_force()  # of the predicted displacement
        total = (1.0 + alpha) * (self._external + self.force) - alpha * (external + force)
        self._right.array = total[self._equations.own]
        self.factor.solve(self._right, self._solution)
        self._equations.spread(self._solution, self._acceleration)
        self.velocity += h * self._gamma * self._acceleration
        self.displacement += h**2 * self._beta * self._acceleration
        change = (self.displacement - before)[self._equations.own]
        self.external_work += 0.5 * float((external + self._external)[self._equations.own] @ change)

    def update_force(self) -> None:
        """Evaluate the internal force at the present displacement, summed over ranks."""
        self.force.fill(0.0)
        for term in self.body.terms:
            term.add(self.displacement, self.force)
        self.body.tie.gather(self.force)
        self.body.shared.add(self.force)

    def kinetic_energy(self) -> float:
        """Return the kinetic energy [J] of this rank's share."""
        owned = self.body.shared.owned
        return 0.5 * float(self.body.mass[owned] @ np.sum(self.velocity[owned] ** 2, axis=1))

    def strain_energy(self, foreign: NDArray[np.float64]) -> float:
        """Return the strain energy [J] of this rank's share; ``foreign (n, 3)`` [N] is no part of the model's force."""
        owned = self.body.shared.owned
        return -0.5 * float(np.sum(self.displacement[owned] * (self.force - foreign)[owned]))
