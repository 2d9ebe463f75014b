"""Implicit operators of a step: mass, inertia, viscosity and wall friction.

Walls have free slip, Navier slip or no slip. Navier's condition: the shear stress on the wall is mu / b times the
velocity relative to the plate, where the slip length b is the depth below the wall at which the linearly extrapolated
velocity vanishes. Contact lines remain mobile even without slip, since the stress at a moving line would be infinite
(Huh & Scriven 1971).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.discretisation.discretisation import Discretisation
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.physics import Physics


@dataclass(frozen=True, slots=True)
class Mass:
    """Mass matrix; without ``Inertia`` it only acts as damping, with velocity = force * dt / mass.

    Attributes:
        density: Density [kg/m^3].
    """

    density: float

    def matrix(self, _body: Body, space: Discretisation, time_step: float) -> sparse.csr_matrix:
        """Return M / dt, shape (3 n, 3 n) [kg/s]."""
        return sparse.kron(sparse.identity(3), self.density / time_step * space.mass, format="csr")


@dataclass(frozen=True, slots=True)
class Inertia:
    """Inertia: momentum carried over from the last step.

    Attributes:
        density: Density [kg/m^3].
    """

    density: float

    @classmethod
    def added_to(cls, physics: Physics, solder: Solder) -> Physics:
        """Add the momentum of the last step to the physics."""
        return replace(physics, momenta=(*physics.momenta, cls(solder.density)))

    def load(self, body: Body, space: Discretisation, time_step: float) -> Floats:
        """Return M v_n / dt, shape (n, 3) [N]."""
        return self.density / time_step * (space.mass @ body.velocity)


@dataclass(frozen=True, slots=True)
class Viscosity:
    """Newtonian viscosity.

    Attributes:
        coefficient: Dynamic viscosity mu [Pa s].
    """

    coefficient: float

    @classmethod
    def added_to(cls, physics: Physics, solder: Solder) -> Physics:
        """Add the viscous operator, and the wall friction or no-slip condition of the solder, to the physics."""
        acting = replace(physics, operators=(*physics.operators, cls(solder.viscosity)))
        if solder.wall == "slip" and solder.slip_length is not None:
            return replace(acting, frictions=(*acting.frictions, NavierSlip(solder.viscosity / solder.slip_length)))
        if solder.wall == "no-slip":
            return replace(acting, holds=(*acting.holds, NoSlip()))
        return acting

    def matrix(self, _body: Body, space: Discretisation, _time_step: float) -> sparse.csr_matrix:
        """Return the matrix of the virtual power, shape (3 n, 3 n) [kg/s], ordered by component.

        With D = (grad v + grad v^T) / 2:
        2 mu D : D = mu (grad v : grad v + grad v : grad v^T). Symmetric, positive semidefinite, zero for rigid motion.
        """
        gradient = space.gradient
        weight = sparse.diags(self.coefficient * space.weights)
        full = sum(component.T @ weight @ component for component in gradient)
        blocks = [[gradient[j].T @ weight @ gradient[i] for j in range(3)] for i in range(3)]
        for i in range(3):
            blocks[i][i] = blocks[i][i] + full
        return sparse.bmat(blocks, format="csr")


@dataclass(frozen=True, slots=True)
class NavierSlip:
    """Navier slip on all walls.

    Attributes:
        coefficient: Viscosity over slip length [Pa s/m].
    """

    coefficient: float

    def matrix(self, body: Body, space: Discretisation, _time_step: float) -> sparse.csr_matrix:
        """Return the friction matrix, shape (3 n, 3 n) [kg/s], for velocities relative to the plates."""
        return sparse.diags(np.tile(self.coefficient * wall_areas(body, space), 3), format="csr")


@dataclass(frozen=True, slots=True)
class NoSlip:
    """No-slip condition: liquid sticks to the walls, except at contact lines."""

    def pinned(self, body: Body) -> NDArray[np.int32]:
        """Return the indices of the particles on walls, except those on contact lines."""
        on_walls = body.cloud.wall >= 0
        for ring in body.cloud.rings:
            on_walls[ring] = False
        return np.flatnonzero(on_walls).astype(np.int32)


def wall_areas(body: Body, space: Discretisation) -> Floats:
    """Compute the wall area that belongs to each particle, shape (n,) [m^2]; zero off the walls.

    The volume gradient of a particle is one third of the area vectors of all faces around it. At contact lines this
    includes faces of the free surface, which are subtracted.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        space: Sparse operators at the particles, of which the volume gradients are used.
    """
    corners = body.points[body.triangles]
    vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 6.0
    share = np.asarray(space.constraint.sum(axis=0)).reshape(3, -1).T
    np.subtract.at(share, body.triangles, vectors[:, None])
    areas = np.zeros(len(body.points))
    for wall, plate in enumerate(body.plates):
        on_wall = body.cloud.wall == wall
        areas[on_wall] = plate.side * (share[on_wall] @ plate.normal)
    return areas
