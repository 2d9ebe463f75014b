"""Implicit time integration of linear elastic models: Newmark's method with the HHT-alpha average of forces.

    M a' = (1 + alpha) (F' - C v' - K u') - alpha (F - C v - K u),
    u' = u + h v + h^2 ((1/2 - beta) a + beta a'),   v' = v + h ((1 - gamma) a + gamma a'),
    beta = (1 - alpha)^2 / 4,   gamma = 1/2 - alpha                       (Hilber, Hughes & Taylor, EESD 5, 1977)

Second order and stable at any step for -1/3 <= alpha <= 0. alpha = 0 is the trapezoidal rule, which keeps the energy of
a linear model to the last digits whatever the step: the default, because an oracle's balance then shows every mistake.
Negative alpha damps frequencies that the step does not resolve, for loads that start with a jump.

It serves as the reference for explicit runs: same body, loads and force terms, linear elastic only.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.forces.bedding import BeddedFacets
from reflowshock.fem.forces.force_assembled import AssembledElements
from reflowshock.fem.forces.force_congruent import CongruentElements
from reflowshock.fem.loads.damping import RayleighDamping
from reflowshock.fem.loads.load import Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.factorisation import Factorisation
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.checkpoint_state import Rows, Same, Shares, State, Sum


@dataclass(frozen=True, slots=True)
class HHTScheme:
    """Coefficients of the HHT-alpha method: step h [s] and alpha, from -1/3 to 0."""

    step: float
    alpha: float

    def __post_init__(self) -> None:
        """Raise ``ValueError`` if step or alpha is out of range."""
        if not self.step > 0.0:
            raise ValueError(f"implicit time step = {self.step:g} s; must be > 0")
        if not -1.0 / 3.0 <= self.alpha <= 0.0:
            raise ValueError(f"alpha of the HHT method = {self.alpha:g}; allowed: -1/3 to 0")

    @property
    def beta(self) -> float:
        """Newmark's beta."""
        return 0.25 * (1.0 - self.alpha) ** 2

    @property
    def gamma(self) -> float:
        """Newmark's gamma."""
        return 0.5 - self.alpha


class ImplicitMotion(Motion):
    """State of one model on one rank, advanced by the HHT-alpha method.

    Attributes:
        factor: Factored matrix of a step.
        velocity: Velocity at ``time``, shape (n, 3) [m/s]; the other attributes are as in ``Motion``.
    """

    def __init__(self, comm: MPI.Comm, body: Body, loads: Sequence[Load], step: float, alpha: float = 0.0) -> None:
        """Start at rest; collective.

        Args:
            comm: Communicator of the model.
            body: Elements, masses and supports of the model.
            loads: Loads and damping of the model.
            step: Time step h [s].
            alpha: Parameter of the HHT method, from -1/3 to 0.

        Raises:
            ValueError: Step or alpha out of range.
            AgreedError: The model is not linear, or memory ran out; on every rank.
        """
        self._scheme = HHTScheme(step, alpha)
        agreed(comm, lambda: self.check(body))
        self.body, self.step, self.time = body, step, 0.0
        self._loads = [load for load in loads if not isinstance(load, RayleighDamping)]
        damping = [load for load in loads if isinstance(load, RayleighDamping)]
        self._mass_damping = sum(load.mass for load in damping)
        self._stiffness_damping = sum(load.stiffness for load in damping)
        count, owned = len(body.mass), body.shared.owned
        self._state = np.zeros((6, count, 3))
        self.displacement, self.velocity, self.force, self._acceleration, self._drag, self._nodal = self._state
        self.slave_force = np.zeros((len(body.tie.slave), 3))
        self.counted_mass = np.where(owned, body.mass, 0.0)
        self._extra, self._free = np.zeros(count), body.free.copy()
        self.gravity = self.body_acceleration(0.0)
        for load in self._loads:
            load.begin(self)
        self._prescribed = body.free & ~self._free
        self._equations = Equations.of(comm, replace(body, free=self._free))
        self.factor = self._factorise()
        self._works = np.zeros(3)  # external work, damping energy, energy not counted at the start
        self._begin()

    @staticmethod
    def check(body: Body) -> None:
        """Raise ``ValueError`` if the model is not linear."""
        _check_linear(body)

    def _factorise(self) -> Factorisation:
        """Return the factorisation of M + (1 + alpha) (gamma h C + beta h^2 K), C = a M + b K; collective."""
        h, scheme = self.step, self._scheme
        weight = 1.0 + scheme.alpha
        mass = self._equations.vector(np.repeat(self.body.mass[:, None], 3, axis=1))
        extra = self._equations.vector(np.repeat(self._extra[:, None], 3, axis=1))
        matrix = self._equations.stiffness()
        matrix.scale(weight * (scheme.beta * h**2 + scheme.gamma * h * self._stiffness_damping))
        scaled = mass * (1.0 + weight * scheme.gamma * h * self._mass_damping) + extra
        matrix.setDiagonal(matrix.getDiagonal() + scaled)
        self._right, self._solution = mass, extra
        return Factorisation(matrix)

    def hold(self, nodes: NDArray[np.integer], component: int) -> None:
        """Fix a velocity component of local nodes, so that forces no longer change it."""
        self._free[nodes, component] = False

    def add_mass(self, nodes: NDArray[np.integer], mass: NDArray[np.float64]) -> None:
        """Add masses of shape (k,) [kg] to local nodes, outside the energy balance."""
        self._extra[nodes] += mass

    def acceleration(self, nodes: NDArray[np.integer] | slice = slice(None)) -> NDArray[np.float64]:
        """Return the acceleration of local nodes at ``time``, shape (k, 3) [m/s^2]."""
        return self._acceleration[nodes]

    def launch(self, velocity: NDArray[np.float64]) -> None:
        """Give all free components an initial velocity of shape (3,) [m/s] before the first step."""
        self.velocity += np.where(self._free, velocity, 0.0)
        self.restart()

    def _begin(self) -> None:
        """Apply the loads and prescribed velocities of time zero."""
        for load in self._loads:
            load.add(self)
        self._nodal[:] = self.force
        mean, following = self._driven(-self.step), self._driven(0.0)
        self.velocity += 0.5 * (mean + following)
        self.restart()

    def restart(self) -> None:
        """Start the energy balance at ``time`` from the current displacement and velocity."""
        self._update_force()
        mass = (self.body.mass + self._extra)[:, None]
        self._acceleration[:] = np.where(self._free, self._total_force() / np.where(mass > 0.0, mass, np.inf), 0.0)
        self._before, self._base = self._balance_fields(), self.base_displacement()
        self._older = self._total_force()
        self._works[:] = 0.0, 0.0, self._stored_apart()

    def advance(self) -> None:
        """Advance by one step, from ``time`` to ``time + h``; call ``update_force`` afterwards; collective."""
        h, scheme, before = self.step, self._scheme, self._total_force()
        mean, following = self._driven(self.time), self._driven(self.time + h)
        start = self.displacement[self._prescribed]
        self.displacement += h * self.velocity + h**2 * (0.5 - scheme.beta) * self._acceleration
        self.velocity += h * (1.0 - scheme.gamma) * self._acceleration
        self.displacement[self._prescribed] = start + h * mean[self._prescribed]
        self.velocity[self._prescribed] = 0.5 * (mean + following)[self._prescribed]
        self.time += h
        self.gravity = self.body_acceleration(self.time)
        self.force.fill(0.0)
        for load in self._loads:
            load.add(self)
        self._nodal[:] = self.force
        self._solve(before)
        self._acceleration[self._prescribed] = ((following - mean) / h)[self._prescribed]

    def _solve(self, before: NDArray[np.float64]) -> None:
        """Solve for the acceleration and correct the prediction; ``before`` is the total force of the last step."""
        h, scheme = self.step, self._scheme
        self._update_force()
        right = (1.0 + scheme.alpha) * self._total_force() - scheme.alpha * before
        self._right.array = right[self._equations.owned]
        self.factor.solve(self._right, self._solution)
        self._equations.spread(self._solution, self._acceleration)
        self.displacement += h**2 * scheme.beta * self._acceleration
        self.velocity += h * scheme.gamma * self._acceleration

    def update_force(self) -> None:
        """Evaluate the force at ``time``, summed over ranks, and add the work of the last step."""
        self._update_force()
        before, self._before = self._before, self._balance_fields()
        change, mean = self._before - before, 0.5 * (before + self._before)
        solved, prescribed = self._equations.owned, self._prescribed & self.body.shared.owned[:, None]
        moved, held = change[0], mean[4] + mean[5]
        base, self._base = self._base, self.base_displacement()
        dragged, by_table = mean[4][self.body.shared.owned], self._base - base
        supplied = float(dragged.sum(axis=0) @ by_table)
        self._works[0] += float(mean[3][solved] @ moved[solved] - held[prescribed] @ moved[prescribed]) + supplied
        self._works[1] -= float(np.sum(dragged * moved[self.body.shared.owned])) - supplied + self._gain(change, mean)
        self._older = before[3:].sum(axis=0)

    def _gain(self, change: NDArray[np.float64], mean: NDArray[np.float64]) -> float:
        """Return the energy that alpha adds to this rank's share in a step, negative for dissipation [J].

        With R all forces except inertia, bars for means over the step and D for changes, Newmark's formulas give
        D(v.Mv)/2 - R_bar.Du = h v_bar.(M a_bar - R_bar + (gamma - 1/2) M Da) - h^2 (beta - gamma/2) R_bar.Da, and the
        HHT method gives M a_bar - R_bar = alpha (R' - R_older) / 2, where R_older is two steps old.

        Args:
            change: Change of ``_balance_fields`` over the step, shape (6, n, 3).
            mean: Mean of ``_balance_fields`` over the step, shape (6, n, 3).
        """
        h, scheme, solved = self.step, self._scheme, self._equations.owned
        if not scheme.alpha:
            return 0.0
        mass = (self.body.mass + self._extra)[:, None]
        unbalanced = 0.5 * scheme.alpha * (self._before[3:].sum(axis=0) - self._older)
        unbalanced += (scheme.gamma - 0.5) * mass * change[2]
        apart = h**2 * (scheme.beta - 0.5 * scheme.gamma) * mean[3:].sum(axis=0) * change[2]
        return float(np.sum((h * mean[1] * unbalanced - apart)[solved]))

    def _balance_fields(self) -> NDArray[np.float64]:
        """Return displacement, velocity, acceleration and forces of loads, damping and elements, shape (6, n, 3)."""
        elastic = self.force - self._nodal - self._drag
        external = self._total_force() - elastic - self._drag
        return np.array([self.displacement, self.velocity, self._acceleration, external, self._drag, elastic])

    def _stored_apart(self) -> float:
        """Return the kinetic energy of prescribed components minus that of uncounted masses [J]."""
        owned = self.body.shared.owned[:, None]
        mass = np.where(self._prescribed, self.body.mass[:, None], 0.0) - self._extra[:, None]
        return 0.5 * float(np.sum(np.where(owned, mass, 0.0) * self.velocity**2))

    def _driven(self, time: float) -> NDArray[np.float64]:
        """Return the mean prescribed velocity over the step that begins at ``time``, shape (n, 3) [m/s]."""
        velocity = np.zeros_like(self.velocity)
        for load in self._loads:
            load.drive(velocity, time)
        return velocity

    def _total_force(self) -> NDArray[np.float64]:
        """Return the total force except inertia, shape (n, 3) [N]."""
        return self.force + (self.body.mass + self._extra)[:, None] * self.gravity

    def _update_force(self) -> None:
        """Update the force of elements, damping and nodal loads; slaves follow their masters."""
        self.body.tie.spread(self.displacement)
        self.body.tie.spread(self.velocity)
        self.slave_force = self._add_internal(self.displacement, self.force)
        self._drag[:] = -self._mass_damping * self.body.mass[:, None] * (self.velocity - self.base_velocity())
        if self._stiffness_damping:
            elastic = np.empty_like(self._drag)
            self._add_internal(self.velocity, elastic)
            self._drag += self._stiffness_damping * elastic
        self.force += self._drag + self._nodal

    def _add_internal(self, field: NDArray[np.float64], force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Write -K times a field into ``force``, summed over ranks; return this rank's contribution at the slaves."""
        force.fill(0.0)
        for term in self.body.terms:
            term.add(field, force)
        at_slaves = force[self.body.tie.slave]
        self.body.tie.gather(force)
        self.body.shared.add(force)
        return at_slaves

    def present_velocity(self) -> NDArray[np.float64]:
        """Return the velocity at ``time``, shape (n, 3) [m/s]."""
        return self.velocity

    @property
    def external_work(self) -> float:
        """Work of all loads on this rank's share [J]; for a large mass, the work that it transmits to the model."""
        return float(self._works[0] + self._stored_apart() - self._works[2])

    @property
    def damping_energy(self) -> float:
        """Energy that damping and a negative alpha have dissipated in this rank's share [J]."""
        return float(self._works[1])

    def reaction(self) -> NDArray[np.float64]:
        """Return the forces of supports and prescribed motion on the nodes that this rank owns, shape (n, 3) [N]."""
        force = self.force.copy()
        for load in self._loads:
            load.release(force)
        return self.counted_mass[:, None] * (self._acceleration - self.gravity) - force

    def kinetic_energy(self) -> float:
        """Return the kinetic energy of this rank's share [J]."""
        return 0.5 * float(self.counted_mass @ np.sum(self.velocity**2, axis=1))

    def step_energy(self, foreign: NDArray[np.float64]) -> float:
        """Return zero: every step is stable."""
        return 0.0

    def state(self) -> State:
        """Return the time-dependent state, for a checkpoint."""
        nodes, tie = self.body.local.nodes, self.body.tie
        nodal = {"state": self._state.transpose(1, 0, 2), "before": self._before.transpose(1, 0, 2)}
        rows = {name: Rows(nodes, value) for name, value in (nodal | {"older": self._older}).items()}
        at_slaves = Shares(nodes[tie.slave], self.slave_force, self.body.shared.owned[tie.slave])
        loads = {str(k): load.state(self.body) for k, load in enumerate(self._loads)}
        scalars: State = {"time": Same(self.time), "works": Sum(self._works)}
        return {**rows, **scalars, "slave_force": at_slaves, "loads": loads}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore the values that ``state`` returned, in a motion built from the same input."""
        self._state[:], self._works[:] = state["state"].transpose(1, 0, 2), state["works"]
        self._before = state["before"].transpose(1, 0, 2)
        self.slave_force, self._older, self.time = state["slave_force"], state["older"], state["time"]
        self.gravity = self.body_acceleration(self.time)
        for k, load in enumerate(self._loads):
            load.restore(state["loads"][str(k)])
        self._base = self.base_displacement()


def _check_linear(body: Body) -> None:
    """Raise ``ValueError`` if the force of an element is not a constant matrix times the displacement."""
    nonlinear = [
        term for term in body.terms if not isinstance(term, CongruentElements | AssembledElements | BeddedFacets)
    ]
    if nonlinear:
        names = ", ".join(type(term).__name__ for term in nonlinear)
        raise ValueError(
            f"the implicit solver is linear and does not support {names}; use elastic materials and small kinematics,"
            " or the explicit solver"
        )
