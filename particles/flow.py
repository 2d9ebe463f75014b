"""One implicit step of the molten solder, and the loop to rest. Lagrangian Navier-Stokes after Hu et al., eqs 1-7.

A step: contact line events; forces; saddle-point solve for velocity and pressure; move; smooth and flip the surface;
shift the interior; correct the volume along its gradient. The spatial operators live in their own modules.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from particles.body import Body
from particles.contact_line import ContactLine
from particles.force_surface_tension import SurfaceTension
from particles.incompressibility import Flow, SaddlePoint, solve
from particles.interior_shift import interior_shift
from particles.mls import SUPPORT, derivatives
from particles.neighbours import NeighbourList
from particles.surface_quality import flip_to_delaunay, smoothing_offsets
from particles.time_step import TimeStep
from particles.viscosity import Viscosity

Floats = NDArray[np.float64]

SKIN = 0.2
VOLUME_PASSES = 2
FLIP_INTERVAL = 2
CALM_STEPS = 3
CALM_DISPLACEMENT = 1e-3


class NoRest(RuntimeError):
    """The flow did not come to rest within its steps."""


class Force(Protocol):
    """A conservative force on the surface."""

    def energy(self, body: Body) -> float:
        """Energy [J]."""

    def force(self, body: Body) -> Floats:
        """Force -dE/dx, `(n, 3)` [N]."""


@dataclass(frozen=True, slots=True)
class Physics:
    """What acts on a body; effects that are off are absent.

    Attributes:
        density: [kg/m^3].
        forces: conservative forces on the surface.
        tension: surface tension for the semi-implicit step, or none.
        viscosity: none if it is off.
        lines: contact lines.
        wetting: whether contact lines move by their angles.
        inertia: whether the momentum of the last step is kept; without it each step relaxes towards rest.
    """

    density: float
    forces: Sequence[Force]
    tension: tuple[SurfaceTension, ...]
    viscosity: tuple[Viscosity, ...]
    lines: tuple[ContactLine, ...]
    wetting: bool
    inertia: bool


@dataclass(frozen=True, slots=True)
class StepRecord:
    """What a step did; SI units. `displacement` is the largest normal displacement of the surface over the spacing."""

    step: int
    time: float
    time_step: float
    binding: str
    height: float
    width: float
    volume: float
    energy: float
    speed: float
    displacement: float
    flips: int
    iterations: int


class LiquidFlow:
    """A liquid body that flows under its physics."""

    def __init__(self, body: Body, physics: Physics, time_step: TimeStep, basis: str) -> None:
        """Set up the neighbour list of the basis and remember the volume to keep."""
        spacing = body.cloud.spacing
        self.body, self.physics, self.time_step, self.basis = body, physics, time_step, basis
        self.volume = body.volume()[0]
        self.neighbours = NeighbourList(SUPPORT[basis] * spacing, SKIN * spacing)
        self.time, self.steps = 0.0, 0
        body.surface_pressure = self._mean_capillary_pressure()

    def forces(self) -> Floats:
        """Sum of the forces on the particles `(n, 3)` [N]."""
        return sum((force.force(self.body) for force in self.physics.forces), np.zeros_like(self.body.points))

    def energy(self) -> float:
        """Sum of the energies [J]."""
        return sum(force.energy(self.body) for force in self.physics.forces)

    def step(self) -> StepRecord:
        """Advance one time step.

        Raises:
            SolveFailed: the linear solve failed.
            FloatingPointError: a position is not finite.
        """
        body = self.body
        if self.physics.wetting:
            self._contact_line_events()
        self.neighbours.update(body.points)
        flow, velocity = self._velocity()
        before = body.points.copy()
        body.velocity = velocity
        body.points += self.time_step.size * velocity
        flips = self._keep_quality()
        self._correct_volume()
        self.steps += 1
        self.time += self.time_step.size
        record = self._record(before, flips, flow.iterations)
        self.time_step.grow()
        return record

    def _mean_capillary_pressure(self) -> float:
        """Least-squares pressure p of f + p a = 0 over the free vertices."""
        free = self._free()[: self.body.cloud.surface_count]
        load = self.forces()[: len(free)][free]
        gradient = self.body.volume()[1][: len(free)][free]
        return -float((load * gradient).sum() / (gradient**2).sum())

    def _free(self) -> NDArray[np.bool_]:
        """Degrees of freedom that move, `(n, 3)`: walls hold z, edges hold pinned vertices."""
        free = np.ones((len(self.body.points), 3), bool)
        free[self.body.cloud.wall >= 0, 2] = False
        for line in self.physics.lines:
            free[line.pinned(self.body)] = False
        return free

    def _contact_line_events(self) -> None:
        for tension in self.physics.tension:
            force = tension.force(self.body)
            for line in self.physics.lines:
                line.update(self.body, force, tension.coefficient)

    def _velocity(self) -> tuple[Flow, Floats]:
        """Solve for velocity and pressure, with a smaller step where a particle would move too far."""
        body, cloud = self.body, self.body.cloud
        free = self._free().T.ravel()
        stencils = derivatives(body.points, body.interior, self.neighbours, self.basis)
        volume, gradient = body.volume()
        weight = sparse.diags(body.volumes[body.interior])
        divergence = sparse.hstack([weight @ component for component in stencils.gradient])
        constraint = sparse.vstack((divergence, sparse.csr_matrix(gradient.T.ravel())), format="csr")[:, free]
        stiffness = sum((t.stiffness(body) for t in self.physics.tension), self._nothing(1))
        viscous = sum((v.matrix(body, stencils) for v in self.physics.viscosity), self._nothing(3))
        load = self.forces().T.ravel()
        mass = self.physics.density * body.volumes
        rate = np.zeros(constraint.shape[0])
        while True:
            size = self.time_step.size
            scalar = sparse.diags(mass / size) + size * stiffness
            operator = (sparse.block_diag((scalar, scalar, scalar), format="csr") + viscous)[free][:, free]
            momentum = (mass / size * body.velocity.T).ravel() if self.physics.inertia else 0.0
            rate[-1] = (self.volume - volume) / size
            flow = solve(SaddlePoint(operator, constraint, (load + momentum)[free], rate))
            velocity = np.zeros(3 * len(body.points))
            velocity[free] = flow.velocity
            velocity = np.ascontiguousarray(velocity.reshape(3, -1).T)
            if self.time_step.accepts(float(np.sqrt((velocity**2).sum(axis=1).max()))):
                break
        body.surface_pressure = float(flow.pressure[-1])
        body.pressure[:] = body.surface_pressure
        body.pressure[cloud.surface_count :] += flow.pressure[:-1]
        return flow, velocity

    def _nothing(self, components: int) -> sparse.csr_matrix:
        size = components * len(self.body.points)
        return sparse.csr_matrix((size, size))

    def _keep_quality(self) -> int:
        """Smooth and flip the surface, shift the interior; return the number of flips."""
        body, cloud = self.body, self.body.cloud
        flips = 0
        if self.steps % FLIP_INTERVAL == 0:
            body.triangles, flips = flip_to_delaunay(body.points, body.triangles, cloud.rings)
        count = cloud.surface_count
        offset = smoothing_offsets(body.points, body.triangles, count, cloud.rings)
        body.points[:count] += np.where(self._free()[:count], offset, 0.0)
        self.neighbours.update(body.points)
        body.points[count:] += interior_shift(body, self.neighbours)
        return flips

    def _correct_volume(self) -> None:
        """Newton steps along the gradient of the volume."""
        for _ in range(VOLUME_PASSES):
            volume, gradient = self.body.volume()
            gradient = np.where(self._free(), gradient, 0.0)
            self.body.points += (self.volume - volume) / (gradient**2).sum() * gradient

    def _record(self, before: Floats, flips: int, iterations: int) -> StepRecord:
        body = self.body
        count = body.cloud.surface_count
        volume, gradient = body.volume()
        normal = gradient[:count] / np.linalg.norm(gradient[:count], axis=1)[:, None]
        moved = ((body.points - before)[:count] * normal * self._free()[:count]).sum(axis=1)
        surface = body.points[:count]
        return StepRecord(
            step=self.steps,
            time=self.time,
            time_step=self.time_step.size,
            binding=self.time_step.binding,
            height=float(np.ptp(surface[:, 2])),
            width=float(2.0 * np.linalg.norm(surface[:, :2], axis=1).max()),
            volume=volume,
            energy=self.energy(),
            speed=float(np.sqrt((body.velocity[:count] ** 2).sum(axis=1).max())),
            displacement=float(np.abs(moved).max() / body.cloud.spacing),
            flips=flips,
            iterations=iterations,
        )
