"""Steps of a body in section by the scheme ispg: the step of bodies, with the space and the surface of a section.

The vertices of the chain are spaced evenly at the rate at which triangles are evened out, particles below it are
shifted as in space.
"""

from dataclasses import dataclass
from math import ceil
from typing import ClassVar

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.core.symmetry import on_plane
from reflowshock.particles.ispg.galerkin_equations import GalerkinEquations
from reflowshock.particles.ispg.ispg_step import IspgStep, PreparedIspgStep
from reflowshock.particles.ispg.rigid_motions import orthonormal, rigid_motions
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.section.chain import Chain
from reflowshock.particles.section.forces import ChainTension
from reflowshock.particles.section.section import Section, as_section
from reflowshock.particles.section.section_space import SectionSpace
from reflowshock.particles.steps.descent import Evening, correct_volume
from reflowshock.particles.steps.flow import FLOW_RECORDS, LiquidFlow
from reflowshock.particles.steps.step_solver import Motion
from reflowshock.particles.surface.profile import Profile, fit_areas
from reflowshock.particles.surface.surface_quality import SMOOTHING as EVENING


@dataclass(frozen=True, slots=True)
class StiffMass:
    """Masses and implicit surface tension of d admissible velocities, m / dt + dt P^T K P, factored.

    P takes out the rigid motions R, orthonormal by the masses: P^T K P = K - m R^T R K - K R^T R m + m R^T R K R^T R m.

    Attributes:
        factors: of m / dt + dt K.
        across: `(d, 2 k)` columns m R^T and K R^T.
        moved: `(d, 2 k)` these, solved for.
        core: `(2 k, 2 k)` of Woodbury's formula.
    """

    factors: SuperLU
    across: Floats
    moved: Floats
    core: Floats

    @classmethod
    def of(cls, masses: Floats, stiffness: sparse.csr_matrix, rigid: Floats, time_step: float) -> "StiffMass":
        """Factor masses `(d,)` [kg] and stiffness `(d, d)` [N/m] with rigid motions `(k, d)`, for a time step [s]."""
        factors = splu((sparse.diags(masses / time_step) + time_step * stiffness).tocsc())
        count, pull = len(rigid), rigid @ stiffness
        across = np.concatenate((masses * rigid, pull)).T
        moved, unit = factors.solve(across), np.eye(count)
        inner = np.block([[np.zeros((count, count)), -unit], [-unit, -pull @ rigid.T]]) / time_step
        return cls(factors, across, moved, np.linalg.inv(inner + across.T @ moved))

    def solve(self, load: Floats) -> Floats:
        """Velocities `(d,)` or `(d, l)` that loads reach in a time step."""
        first = self.factors.solve(load)
        return first - self.moved @ (self.core @ (self.across.T @ first))


@dataclass(frozen=True, slots=True)
class SectionEquations(GalerkinEquations):
    """The equations of a section, whose stiffness is `(3 n, 3 n)` by particle.

    The projection, too, has the implicit surface tension: where pressures accelerate masses alone, what tension resists
    is taken back a step later. That error, dt^3 gamma K m^-1 grad dp/dt, lets swings grow, the more the finer particles
    are: with 25 steps a period 10 of them along the radius no longer decay.

    Attributes:
        inertia: masses and surface tension.
    """

    inertia: StiffMass

    def pull(self, field: Floats) -> Floats:
        """Pull gamma K x of a displacement, `(n, 3)`."""
        return (self.stiffness @ field.ravel()).reshape(-1, 3)

    def pulled(self, _start: Floats, end: Floats) -> Floats:
        """The projected velocity is what the implicit surface tension has resisted."""
        return end

    def accelerated(self, pressure: Floats) -> Floats:
        """Change of the velocity in a step under a pressure `(n,)` [Pa]."""
        return (self.basis @ self.inertia.solve(self.basis.T @ self.push(pressure).ravel())).reshape(-1, 3)

    def pressure_matrix(self) -> sparse.csr_matrix:
        """Rates of volume under such changes, `(n, n)` [m^3/(s Pa)], but for what nodal integration misses."""
        rows = sparse.diags(self.space.volumes) @ self.space.divergence_rows() @ self.basis
        return sparse.csr_matrix(rows @ self.inertia.solve(rows.T.toarray()))


class SectionStep(IspgStep):
    """The scheme ispg of a section."""

    def prepare(self, body: Body, physics: Physics, neighbours: NeighbourList) -> "PreparedSectionStep":
        """Carry the velocity to where the particles are now."""
        prepared = IspgStep.prepare(self, body, physics, neighbours)
        return PreparedSectionStep(self, body, physics, prepared.past, prepared.admitted)


class PreparedSectionStep(PreparedIspgStep):
    """A step from the section's current positions."""

    def equations(self, body: Body, time_step: float) -> GalerkinEquations:
        """The equations of a section at other positions, for a time step [s]."""
        section, fluid = as_section(body), self.fluid(body.cloud.spacing)
        tensions = [part for part in self.physics.operators if isinstance(part, ChainTension)]
        space, basis = SectionSpace.of(section), admissible(body)
        masses = fluid.density * space.volumes
        rigid = orthonormal(rigid_motions(body.points)[self.admitted], masses)
        stiffness = sum((part.stiffness(body) for part in tensions), sparse.csr_matrix((masses.size * 3,) * 2))
        free = (basis.T @ np.repeat(masses, 3), basis.T @ stiffness @ basis, rigid @ basis)
        return SectionEquations(
            space=space,
            fluid=fluid,
            basis=basis,
            stiffness=stiffness,
            rigid=rigid,
            drag=np.zeros(len(masses)),
            unbalanced=body.volume()[1] - space.divergence_load(space.volumes),
            spacing=body.cloud.spacing,
            time_step=time_step,
            inertia=StiffMass.of(*free, time_step),
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
    records: ClassVar[tuple[type, ...]] = (*FLOW_RECORDS, Section, Chain)

    def profile(self) -> Profile:
        """Cross-sections of the body against their height."""
        body = self.body
        return fit_areas(lambda heights: body.chain.areas(body.line, heights), *body.span())

    def outward(self) -> Floats:
        """Unit normals of the chain `(s, 3)`."""
        return self.body.chain.normals(self.body.line)

    def _follow(self, motion: Motion, evening: Evening) -> int:
        """Move the body along, and space its vertices evenly; nothing is flipped."""
        body, passes = self.body, evening.passes
        body.move(self.time_step.size, motion.transport, motion.twists)
        for done in range(ceil(passes)):
            offset = body.chain.evening(body.line, EVENING * min(1.0, passes - done))
            body.points = body.points + body.on_particles(offset)
        correct_volume(body, self.physics, self.volume)
        return 0
