"""Steps of a body in section by the scheme ispg: the step of bodies, with the space and the surface of a section.

The vertices of the chain are spaced evenly at the rate at which triangles are evened out, particles below it are
shifted as in space.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from math import ceil
from typing import ClassVar, cast

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.core.symmetry import on_plane
from reflowshock.particles.discretisation.effective_mass import EffectiveMass
from reflowshock.particles.discretisation.lagged_cholesky import Apply, Band, Tolerance, conjugate_gradients
from reflowshock.particles.ispg.galerkin_equations import (
    MOMENTUM_TOLERANCE,
    NEGLIGIBLE,
    Drive,
    GalerkinEquations,
)
from reflowshock.particles.ispg.galerkin_space import AT_REST, GalerkinSpace
from reflowshock.particles.ispg.ispg_step import IspgStep, PreparedIspgStep
from reflowshock.particles.ispg.rigid_motions import orthonormal, rigid_motions
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.section.forces import PolylineTension
from reflowshock.particles.section.polyline import Polyline
from reflowshock.particles.section.section import Section, as_section
from reflowshock.particles.section.section_space import SectionSpace
from reflowshock.particles.steps.descent import MeshSmoothing, correct_volume
from reflowshock.particles.steps.flow import FLOW_RECORDS, LiquidFlow
from reflowshock.particles.steps.step_solver import Motion
from reflowshock.particles.surface.profile import Profile, fit_areas
from reflowshock.particles.surface.surface_quality import SMOOTHING as EVENING


@dataclass(frozen=True, slots=True)
class SectionEquations(GalerkinEquations):
    """The equations of a section, by matrices.

    Attributes:
        matrices: shape functions and volumes.
        basis: `(3 n, d)` admissible velocities, by particle.
    """

    matrices: SectionSpace
    basis: sparse.csr_matrix

    def rubbed(self, velocity: Floats, force: Floats) -> Floats:
        """Velocity [m/s] under friction, as in space."""
        basis, across = self.basis, self.basis.T
        load = self.momentum(velocity) / self.time_step + force
        mean = NEGLIGIBLE * self.spacing * float(self.masses.mean()) / self.time_step**2
        inverse = self.time_step / (across @ np.repeat(self.masses, 3))
        solution, _ = conjugate_gradients(
            lambda free: across @ self.friction((basis @ free).reshape(-1, 3)).ravel(),
            across @ load.ravel(),
            across @ velocity.ravel(),
            lambda residual: inverse * residual,
            Tolerance(MOMENTUM_TOLERANCE, mean * np.sqrt(len(force))),
        )
        return (basis @ solution).reshape(-1, 3)

    def friction(self, field: Floats) -> Floats:
        """m/dt + V + S of a velocity, [N]."""
        return self.momentum(field) / self.time_step + self.matrices.resistance(field, self.factors)

    def driver(self) -> Drive:
        """How forces `(n, 3)` [N] move masses and surface in a step, as in space."""
        basis, across = self.basis, self.basis.T
        return lambda force, _: (basis @ self.inertia.solve(across @ force.ravel())).reshape(-1, 3)

    def pressure_equation(self, drive: Drive) -> tuple[Apply, Callable[[], Band]]:
        """Rates of volume under pressures, A, and a matrix of it but for what nodal integration misses."""

        def matrix() -> Band:
            rates = sparse.diags(self.matrices.volumes) @ self.matrices.divergence_rows() @ self.basis
            return Band.of(rates @ self.inertia.solve(rates.T.toarray()))

        none = np.zeros(0)
        return lambda pressure: self.constraint(drive(self.push(pressure), none)), matrix

    def constraint(self, field: Floats) -> Floats:
        """B v: rates of volume `(n,)` [m^3/s]."""
        volumes = self.matrices.volumes
        return volumes * (self.matrices.divergence(field) + (self.unbalanced * field).sum() / volumes.sum())

    def push(self, pressure: Floats) -> Floats:
        """B^T p, [N]."""
        parts = self.matrices.volumes * pressure
        return self.matrices.divergence_load(parts) + parts.sum() / self.matrices.volumes.sum() * self.unbalanced


class SectionStep(IspgStep):
    """The scheme ispg of a section."""

    def prepare(self, body: Body, physics: Physics, neighbours: NeighbourList) -> "PreparedSectionStep":
        """Carry the velocity to where the particles are now."""
        prepared = IspgStep.prepare(self, body, physics, neighbours)
        return PreparedSectionStep(*(getattr(prepared, entry.name) for entry in fields(prepared)))


class PreparedSectionStep(PreparedIspgStep):
    """A step from the section's current positions."""

    def equations(self, body: Body, time_step: float, _twists: Mapping[int, Floats] = AT_REST) -> GalerkinEquations:
        """The equations of a section at other positions, for a time step [s]; its wall rests."""
        section, fluid = as_section(body), self.fluid(body.cloud.spacing)
        tensions = [part for part in self.physics.operators if isinstance(part, PolylineTension)]
        space, basis = SectionSpace.of(section), admissible(body)
        masses = fluid.density * space.volumes
        rigid = orthonormal(rigid_motions(body.points)[self.admitted], masses)
        stiffness = sum((part.stiffness(body) for part in tensions), sparse.csr_matrix((masses.size * 3,) * 2))
        motions = rigid.reshape(len(rigid), 3 * len(masses)) @ basis
        free_stiffness = sparse.bsr_matrix(basis.T @ stiffness @ basis, blocksize=(1, 1))
        free = (basis.T @ np.repeat(masses, 3), free_stiffness, motions)
        return SectionEquations(
            space=cast(GalerkinSpace, space),  # what a step asks of either is the same
            matrices=space,
            admitted=self.projections,
            fluid=fluid,
            basis=basis,
            stiffness=stiffness,
            rigid=rigid,
            drag=np.zeros(len(masses)),
            walls=np.zeros_like(body.points),
            unbalanced=body.volume()[1] - space.divergence_load(space.volumes),
            spacing=body.cloud.spacing,
            time_step=time_step,
            inertia=EffectiveMass.of(*free, time_step),
        )


def admissible(body: Body) -> sparse.csr_matrix:
    """Velocities that a section admits, `(3 n, d)` by particle: within its plane, along walls and the axis."""
    free = np.ones((len(body.points), 3), bool)
    free[:, 1] = False
    free[body.cloud.wall >= 0, 2] = False
    for axis in body.cloud.symmetry:
        free[on_plane(body.cloud, axis), axis] = False
    return sparse.identity(free.size, format="csc")[:, free.ravel()].tocsr()


class SectionFlow(LiquidFlow):
    """A liquid body that flows in section."""

    body: Section
    records: ClassVar[tuple[type, ...]] = (*FLOW_RECORDS, Section, Polyline)

    def profile(self) -> Profile:
        """Cross-sections of the body against their height."""
        body = self.body
        return fit_areas(lambda heights: body.chain.areas(body.line, heights), *body.span())

    def outward(self) -> Floats:
        """Unit normals of the chain `(s, 3)`."""
        return self.body.chain.normals(self.body.line)

    def _follow(self, motion: Motion, evening: MeshSmoothing) -> int:
        """Move the body along, and space its vertices evenly; nothing is flipped."""
        body, passes = self.body, evening.passes
        body.move(self.time_step.size, motion.transport, motion.twists)
        for done in range(ceil(passes)):
            offset = body.chain.evening(body.line, EVENING * min(1.0, passes - done))
            body.points = body.points + body.on_particles(offset)
        correct_volume(body, self.physics, self.volume)
        return 0
