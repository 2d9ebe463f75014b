"""ISPG step in section: the step in space, with the Galerkin space and the surface of a section.

Mesh smoothing spaces the vertices of the polyline evenly at the rate of mesh smoothing in space; particles below the
surface are shifted as in space. The hoop terms of the implicit surface tension are essential: without them the axis is
unstable from some 50 steps per period on. Masses follow from the nodal volumes V alone.
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
    GalerkinEquations,
    Response,
)
from reflowshock.particles.ispg.galerkin_space import AT_REST, GalerkinSpace
from reflowshock.particles.ispg.ispg_step import IspgStep, PreparedIspgStep
from reflowshock.particles.ispg.rigid_motions import orthonormalise, rigid_motions
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.section.forces import PolylineTension
from reflowshock.particles.section.polyline import Polyline
from reflowshock.particles.section.section import Section, as_section
from reflowshock.particles.section.section_space import SectionSpace
from reflowshock.particles.steps.descent import MeshSmoothing, correct_volume
from reflowshock.particles.steps.flow import FLOW_RECORDS, LiquidFlow
from reflowshock.particles.steps.step_solver import Motion
from reflowshock.particles.surface.profile import Profile, fit_areas
from reflowshock.particles.surface.surface_quality import SMOOTHING


@dataclass(frozen=True, slots=True)
class SectionEquations(GalerkinEquations):
    """Equations of a body in section, as sparse matrices.

    Attributes:
        matrices: Shape functions and nodal volumes.
        basis: Basis of the admissible velocities by particle, shape (3 n, d).
    """

    matrices: SectionSpace
    basis: sparse.csr_matrix

    def velocity_after_friction(self, velocity: Floats, force: Floats) -> Floats:
        """Solve for the velocity after viscosity and velocity smoothing, as in space, shape (n, 3) [m/s]."""
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
        """Apply m/dt + V + S to a velocity field, shape (n, 3) [N]."""
        return self.momentum(field) / self.time_step + self.matrices.resistance(field, self.factors)

    def response(self) -> Response:
        """Return a function that maps forces to the velocity they cause in a step from rest, as in space."""
        basis, across = self.basis, self.basis.T
        return lambda force, _: (basis @ self.inertia.solve(across @ force.ravel())).reshape(-1, 3)

    def pressure_equation(self, respond: Response) -> tuple[Apply, Callable[[], Band]]:
        """Return the operator from pressures to rates of volume, and a function that assembles its preconditioner."""

        def matrix() -> Band:
            rates = sparse.diags(self.matrices.volumes) @ self.matrices.divergence_rows() @ self.basis
            return Band.of(rates @ self.inertia.solve(rates.T.toarray()))

        none = np.zeros(0)
        return lambda pressure: self.volume_rates(respond(self.pressure_forces(pressure), none)), matrix

    def volume_rates(self, field: Floats) -> Floats:
        """Return B v, the rates of the nodal volumes, shape (n,) [m^3/s]."""
        volumes = self.matrices.volumes
        return volumes * (self.matrices.divergence(field) + (self.unbalanced * field).sum() / volumes.sum())

    def pressure_forces(self, pressure: Floats) -> Floats:
        """Return B^T p, the forces of pressure coefficients of shape (n,) [Pa], shape (n, 3) [N]."""
        parts = self.matrices.volumes * pressure
        return self.matrices.divergence_load(parts) + parts.sum() / self.matrices.volumes.sum() * self.unbalanced


class SectionStep(IspgStep):
    """Step solver of the Galerkin scheme in section."""

    def prepare(self, body: Body, physics: Physics, neighbours: NeighbourList) -> "PreparedSectionStep":
        """Move the state to the current positions."""
        prepared = IspgStep.prepare(self, body, physics, neighbours)
        return PreparedSectionStep(*(getattr(prepared, entry.name) for entry in fields(prepared)))


class PreparedSectionStep(PreparedIspgStep):
    """Step from the current positions of a section."""

    def equations(self, body: Body, time_step: float, _twists: Mapping[int, Floats] = AT_REST) -> GalerkinEquations:
        """Assemble the equations of a section at other positions for a time step [s]; its wall is at rest."""
        section, fluid = as_section(body), self.fluid(body.cloud.spacing)
        tensions = [part for part in self.physics.operators if isinstance(part, PolylineTension)]
        space, basis = SectionSpace.of(section), admissible_basis(body)
        masses = fluid.density * space.volumes
        rigid = orthonormalise(rigid_motions(body.points)[self.admitted], masses)
        stiffness = sum((part.stiffness(body) for part in tensions), sparse.csr_matrix((masses.size * 3,) * 2))
        motions = rigid.reshape(len(rigid), 3 * len(masses)) @ basis
        free_stiffness = sparse.bsr_matrix(basis.T @ stiffness @ basis, blocksize=(1, 1))
        free = (basis.T @ np.repeat(masses, 3), free_stiffness, motions)
        return SectionEquations(
            space=cast(GalerkinSpace, space),  # both have the methods that a step uses
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


def admissible_basis(body: Body) -> sparse.csr_matrix:
    """Return a basis of velocities in the plane of a section that walls and axis admit, as columns, shape (3 n, d).

    Rows are ordered by particle; d is the number of degrees of freedom.

    Args:
        body: Drop in section, with n particles, its walls and its axis.
    """
    free = np.ones((len(body.points), 3), bool)
    free[:, 1] = False
    free[body.cloud.wall >= 0, 2] = False
    for axis in body.cloud.symmetry:
        free[on_plane(body.cloud, axis), axis] = False
    return sparse.identity(free.size, format="csc")[:, free.ravel()].tocsr()


class SectionFlow(LiquidFlow):
    """Liquid flow in section."""

    body: Section
    records: ClassVar[tuple[type, ...]] = (*FLOW_RECORDS, Section, Polyline)

    def profile(self) -> Profile:
        """Return the areas of the horizontal cross-sections against height."""
        body = self.body
        return fit_areas(lambda heights: body.polyline.areas(body.line, heights), *body.span())

    def outward(self) -> Floats:
        """Return the outward unit normals of the surface, shape (s, 3)."""
        return self.body.polyline.normals(self.body.line)

    def _follow(self, motion: Motion, smoothing: MeshSmoothing) -> int:
        """Move the body and space its vertices evenly; return the number of flipped edges, zero."""
        body, passes = self.body, smoothing.passes
        body.move(self.time_step.size, motion.transport, motion.twists)
        for done in range(ceil(passes)):
            offset = body.polyline.smoothing_offsets(body.line, SMOOTHING * min(1.0, passes - done))
            body.points = body.points + body.on_particles(offset)
        correct_volume(body, self.physics, self.volume)
        return 0
