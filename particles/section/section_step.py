"""Steps of a body in section by the scheme ispg: the step of bodies, with the space and the surface of a section.

The vertices of the chain are spaced evenly at the rate at which triangles are evened out, particles below it are shifted
as in space.
"""

from dataclasses import dataclass
from math import ceil

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.core.symmetry import on_plane
from reflowshock.particles.ispg.galerkin_equations import Flow, GalerkinEquations
from reflowshock.particles.ispg.ispg_step import IspgStep, PreparedIspgStep, SMOOTHING
from reflowshock.particles.ispg.rigid_motions import admitted_motions, orthonormal, rigid_motions
from reflowshock.particles.physics.operators import Mass, Viscosity
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.section.forces import ChainTension
from reflowshock.particles.section.section import Section
from reflowshock.particles.section.section_space import SectionSpace
from reflowshock.particles.steps.descent import Evening, correct_volume
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.step_solver import Motion
from reflowshock.particles.surface.surface_quality import SMOOTHING as EVENING


class SectionStep(IspgStep):
    """The scheme ispg of a section."""

    def prepare(self, body: Section, physics: Physics, neighbours: NeighbourList) -> "PreparedSectionStep":
        """Carry the velocity to where the particles are now."""
        prepared = IspgStep.prepare(self, body, physics, neighbours)
        return PreparedSectionStep(self, body, physics, prepared.past, admitted_motions(body, physics))


class PreparedSectionStep(PreparedIspgStep):
    """A step from the section's current positions."""

    def equations(self, body: Section, time_step: float) -> GalerkinEquations:
        """The equations of a section at other positions, for a time step [s]."""
        density, viscosity = (
            sum(part.coefficient if isinstance(part, Viscosity) else part.density for part in self.physics.operators if isinstance(part, kind))
            for kind in (Mass, Viscosity)
        )
        tensions = [part for part in self.physics.operators if isinstance(part, ChainTension)]
        tension, spacing = sum(part.coefficient for part in tensions), body.cloud.spacing
        space, count = SectionSpace.of(body), len(body.points)
        return GalerkinEquations(
            space=space,
            fluid=Flow(density, viscosity, SMOOTHING * float(np.sqrt(tension / (density * spacing**3)))),
            basis=admissible(body),
            spacing=spacing,
            stiffness=sum((part.stiffness(body) for part in tensions), sparse.csr_matrix((count, count))),
            rigid=orthonormal(rigid_motions(body.points)[self.admitted], density * space.volumes),
            drag=np.zeros(count),
            unbalanced=body.volume()[1] - space.divergence_load(space.volumes),
            time_step=time_step,
        )


def admissible(body: Section) -> sparse.csr_matrix:
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

    def outward(self) -> Floats:
        """Unit normals of the chain `(s, 3)`."""
        return self.body.chain.normals(self.body.line)

    def _follow(self, motion: Motion, evening: Evening) -> int:
        """Move the body along, and space its vertices evenly; nothing is flipped."""
        body, passes = self.body, evening.passes
        body.move(self.time_step.size, motion.transport, motion.twists)
        points = body.points.copy()
        for done in range(ceil(passes)):
            offset = EVENING * min(1.0, passes - done) * body.chain.evening(body.line)
            points[: len(offset)] += offset
            body.points = points.copy()
        correct_volume(body, self.physics, self.volume)
        return 0
