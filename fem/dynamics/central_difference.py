"""Central-difference (leapfrog) time integration of one model, with velocities half a step behind displacements.

v(t + dt/2) = v(t - dt/2) + dt (f(t) / m + g(t)),   u(t + dt) = u(t) + dt v(t + dt/2)

(Hughes, The Finite Element Method, Dover 2000, section 9.1). Force terms of pace r act once in r steps by an impulse of
r dt f (r-RESPA, see ``division.path_levels``).
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.dynamics.compiled_steps import CompiledSteps, no_interface
from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.forces.force import TermWithPath
from reflowshock.fem.kernels.levels import Interface, count_impulses
from reflowshock.fem.kernels.motion import add_pushed, advance
from reflowshock.fem.loads.damping import WindowDrag
from reflowshock.fem.loads.load import FineSupports, Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.step_levels import levels_of
from reflowshock.fem.parallel.checkpoint_state import Rows, Same, Shares, State, Sum


class ExplicitMotion(Motion):
    """State of one model on one rank, advanced by central differences.

    Every rank that shares a node updates it from the same sum of forces.

    Attributes:
        velocity: Velocity at ``time - dt / 2``, shape (n, 3) [m/s]; the other attributes are as in ``Motion``.
        ahead: Sum of (r - 1) f over the terms of pace r that have just acted, added in the next step, shape (n, 3) [N];
            shape (0, 3) if all terms act in every step.
    """

    def __init__(
        self, body: Body, loads: Sequence[Load], step: float, held: NDArray[np.integer], extra_mass: NDArray[np.float64]
    ) -> None:
        """Start at rest.

        Args:
            body: Elements, masses and supports of the model.
            loads: Loads and damping of the model in any order; damping acts last because it needs the other forces.
            step: Time step dt [s].
            held: Local nodes whose velocity another model prescribes; that model's energy balance counts their mass.
            extra_mass: Mass that another model adds at the interface, shape (n,) [kg].
        """
        self.body, self.step, self.time, self._body_work = body, step, 0.0, 0.0
        fine_supports = [FineSupports()] if levels_of(body.terms) else []
        self._loads = sorted([*loads, *fine_supports], key=lambda load: load.account == "damping")
        self._drags = [load for load in self._loads if isinstance(load, WindowDrag)]
        mass = body.mass + extra_mass
        free = body.free.copy()
        free[held] = False
        self.mobility = np.where(free, 1.0 / np.where(mass > 0.0, mass, np.inf)[:, None], 0.0)
        self.counted_mass = np.where(body.shared.owned, mass, 0.0)
        self.counted_mass[held] = 0.0
        self._state = np.zeros((3, len(mass), 3))
        self.displacement, self.velocity, self.force = self._state
        self._substep, self._longest = 0, max(body.schedule)
        self.ahead = np.zeros((len(mass) if self._longest > 1 or self._drags else 0, 3))
        self.carried = np.empty(0, np.int64)
        self._tied = len(body.tie.slave) > 0
        self.slave_force = np.zeros((len(body.tie.slave), 3))
        self.gravity = self.body_acceleration(0.0)
        for load in self._loads:
            load.begin(self)
        for levels in levels_of(body.terms):
            levels.follow(self.mobility)
        for load in self._loads:
            load.carry(body)
        for load in self._loads:
            load.add(self)
        for load in self._loads:
            load.drive(self.velocity, -step)
        self.velocity -= 0.5 * step * self.acceleration()
        self._compiled = CompiledSteps.of(body, self._loads)

    @property
    def external_work(self) -> float:
        """Work of all loads on this rank's share of the mass [J]."""
        of_loads = sum(load.work for load in self._loads if load.account == "external")
        return self._body_work + of_loads + sum(load.frame_work for load in self._loads)

    @property
    def damping_energy(self) -> float:
        """Energy that damping has dissipated in this rank's share [J]."""
        return -sum(load.work for load in self._loads if load.account == "damping")

    def hold(self, nodes: NDArray[np.integer], component: int) -> None:
        """Fix a velocity component of local nodes, so that forces no longer change it."""
        self.mobility[nodes, component] = 0.0

    def add_mass(self, nodes: NDArray[np.integer], mass: NDArray[np.float64]) -> None:
        """Add masses of shape (k,) [kg] to free local nodes, outside the energy balance."""
        self.mobility[nodes] = 1.0 / (1.0 / self.mobility[nodes] + mass[:, None])
        self.carried = np.append(self.carried, nodes)

    def launch(self, velocity: NDArray[np.float64]) -> None:
        """Give all free components an initial velocity of shape (3,) [m/s], damped, before the first step."""
        before = self.acceleration()
        self.velocity += np.where(self.mobility > 0.0, velocity, 0.0)
        for load in self._loads:
            if load.account == "damping":
                load.remove(self.force)
                load.add(self)
        self.velocity -= 0.5 * self.step * (self.acceleration() - before)
        for drag in self._drags:
            drag.brake(self, 0.5)  # the velocity is that of the start, not the mean of a window

    def advance(self) -> None:
        """Advance displacement and velocity, slaves with their masters, by one step; then call ``update_force``."""
        for load in self._loads:
            load.drive(self.velocity, self.time)
        if len(self.ahead):
            self.force += self.ahead
            self._substep = (self._substep + 1) % self._longest
        advance(self._state, self.mobility, self.gravity, self.step)
        for load in self._loads:
            load.collect(self)
        if self._tied:
            self.body.tie.spread(self.displacement)
        self.time += self.step
        before, self.gravity = self.gravity, self.body_acceleration(self.time)
        mean = 0.5 * (before + self.gravity)
        if mean.any():
            self._body_work += self.step * float(mean @ (self.counted_mass @ self.velocity))

    def update_force(self) -> None:
        """Evaluate the force at the current displacement, summed over ranks, exactly once per step."""
        self.force.fill(0.0)
        self.ahead.fill(0.0)
        for term, pace in self.body.paced:
            if pace == 1:
                term.add(self.displacement, self.force)
            elif self._substep % pace == 0:
                paced_force = np.zeros_like(self.force)
                term.add(self.displacement, paced_force)
                add_pushed(paced_force, pace, self.force, self.ahead)
        if self._tied:
            np.take(self.force, self.body.tie.slave, axis=0, out=self.slave_force)
            self.body.tie.gather(self.force)
        self.body.shared.add(self.force)
        if any(pace > 1 and self._substep % pace == 0 for pace in self.body.schedule):
            self.body.tie.gather(self.ahead)
            self.body.shared.add(self.ahead)
        for load in self._loads:
            load.add(self)
        for load in self._loads:
            load.collect(self)

    def take_steps(self, count: int, interface: Interface | None = None) -> None:
        """Take the ``count`` steps of a window; ``interface`` has prescribed changes and impulses of the coupling."""
        self._take_undamped_steps(count, interface)
        for drag in self._drags:
            drag.brake(self)

    def _take_undamped_steps(self, count: int, interface: Interface | None) -> None:
        """Take steps by compiled code if no message, load or rest of a cycle forbids it."""
        full_cycles = self._substep == 0 and count % self._longest == 0
        apart = self.body.shared.exchanged and self._longest > 1  # sums over ranks would have to follow the paces
        if apart or self._compiled is None or not full_cycles:
            self._take_single_steps(count, interface)
            return
        times = [self.time]
        for _ in range(count):
            times.append(times[-1] + self.step)
        accelerations = np.concatenate([self.gravity[None], self.accelerations(times[1:])])
        coupling = interface or no_interface(count)
        self._body_work += self._compiled.take(self, self._state, self.ahead, coupling, accelerations)
        self.gravity = accelerations[-1]

    def accelerations(self, times: Sequence[float]) -> NDArray[np.float64]:
        """Return the body acceleration at the ends [s] of the m steps of a window, shape (m, 3) [m/s^2]."""
        return np.array([self.body_acceleration(time) for time in times])

    def _take_single_steps(self, count: int, interface: Interface | None) -> None:
        """Take steps one by one in Python, with messages between ranks."""
        if interface is not None:
            count_impulses(interface, 0, self.push())
        for k in range(count):
            if interface is not None:
                self.velocity[interface.rows] = interface.given + interface.change[k]
            self.advance()
            self.update_force()
            if interface is not None:
                count_impulses(interface, k + 1, self.push())
        if interface is not None:
            self.velocity[interface.rows] = interface.given

    def push(self) -> NDArray[np.float64]:
        """Return the impulse of the coming step over dt, with the delayed share of paced terms, shape (n, 3) [N]."""
        return self.force + self.ahead if len(self.ahead) else self.force

    def acceleration(self, nodes: NDArray[np.integer] | slice = slice(None)) -> NDArray[np.float64]:
        """Return the acceleration of local nodes, zero in prescribed components, shape (k, 3) [m/s^2]."""
        inverse = self.mobility[nodes]
        acceleration = self.force[nodes] * inverse
        return acceleration + np.where(inverse > 0.0, self.gravity, 0.0) if self.gravity.any() else acceleration

    def kinetic_energy(self) -> float:
        """Return the kinetic energy of this rank's share at ``time``, v(t - dt/2) . M v(t + dt/2) / 2 [J].

        With this product its change over a step is exactly the work of the forces (central differences conserve it
        together with the strain energy), while m v^2 / 2 of the mean velocity is larger by m (a dt)^2 / 8.
        """
        return 0.5 * float(np.einsum("n,ni,ni->", self.counted_mass, self.velocity, self._following_velocity()))

    def present_velocity(self) -> NDArray[np.float64]:
        """Return the velocity at ``time``, half a step after ``velocity``, shape (n, 3) [m/s]; invalid at slaves."""
        return 0.5 * (self.velocity + self._following_velocity())

    def _following_velocity(self) -> NDArray[np.float64]:
        """Return the velocity at ``time + dt / 2``, shape (n, 3) [m/s]."""
        following = self.velocity + self.step * self.acceleration()
        if len(self.ahead):
            following += self.step * self.mobility * self.ahead
        for load in self._loads:
            load.drive(following, self.time)
        return following

    def reaction(self) -> NDArray[np.float64]:
        """Return the forces of supports and prescribed motion on the nodes that this rank owns, shape (n, 3) [N]."""
        force = self.force.copy()
        for load in self._loads:
            load.release(force)
        acceleration = (self._following_velocity() - self.velocity) / self.step - self.gravity
        return self.counted_mass[:, None] * acceleration - force

    def step_energy(self, foreign: NDArray[np.float64]) -> float:
        """Return dt^2 f . M^-1 f / 8 of this rank's share, f the internal force [J].

        For f = -K u this is (dt omega / 2)^2 times the strain energy in each mode of frequency omega. If the sum is
        larger than the strain energy, the step is above 2 / omega of an excited mode, and that mode grows.

        Args:
            foreign: Part of the force that belongs to another model, shape (n, 3) [N].
        """
        force = self.push() - foreign
        for load in self._loads:
            load.remove(force)
        owned = self.body.shared.owned
        return 0.125 * self.step**2 * float(owned @ np.einsum("ni,ni,ni->n", force, force, self.mobility))

    def state(self) -> State:
        """Return the time-dependent state, for a checkpoint."""
        local, tie = self.body.local, self.body.tie
        nodal = {"displacement": self.displacement, "velocity": self.velocity, "force": self.force}
        nodal |= {"ahead": self.ahead} if len(self.ahead) else {}
        rows = {name: Rows(local.nodes, value) for name, value in nodal.items()}
        at_slaves = Shares(local.nodes[tie.slave], self.slave_force, self.body.shared.owned[tie.slave])
        loads = {str(k): load.state(self.body) for k, load in enumerate(self._loads)}
        paths = {name: term.state(local.cell_numbers) for name, term in self._terms_with_path().items()}
        scalars: State = {"gravity": Same(self.gravity), "time": Same(self.time), "body_work": Sum(self._body_work)}
        return {**rows, **scalars, "slave_force": at_slaves, "paths": paths, "loads": loads}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore the values that ``state`` returned, in a motion built from the same input."""
        for name in ("displacement", "velocity", "force", "slave_force", *(["ahead"] if len(self.ahead) else [])):
            getattr(self, name)[:] = state[name]
        self.gravity, self.time, self._body_work = state["gravity"], state["time"], state["body_work"]
        for name, term in self._terms_with_path().items():
            term.restore(state["paths"][name])
        for k, load in enumerate(self._loads):
            load.restore(state["loads"][str(k)])

    def _terms_with_path(self) -> dict[str, TermWithPath]:
        """Return the path-dependent force terms, each under a name that is the same on all ranks."""
        terms = [(term, pace) for term, pace in self.body.paced if isinstance(term, TermWithPath)]
        named: dict[str, TermWithPath] = {}
        for term, pace in terms:
            suffix = f" of {pace}" if pace > 1 else ""
            named[f"{sum(pace == other for _, other in terms[: len(named)])}{suffix}"] = term
        return named
