"""Implicit operators of a step: mass and inertia, viscosity, and what a wall does to the liquid that slides on it.

A wall does nothing (free slip), exerts a friction (Navier slip), or holds the liquid. Navier's condition: the shear
stress on the wall is mu / b times the velocity relative to the plate, b the slip length, the depth below the wall at
which the flow, continued linearly, would rest. Contact lines stay mobile without slip, too: there the stress of a line
that moves would be infinite (Huh & Scriven 1971).
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
    """Mass. Without `Inertia` beside it, it only damps: velocity is force times dt over mass.

    Attributes:
        density: [kg/m^3].
    """

    density: float

    def matrix(self, _body: Body, space: Discretisation, time_step: float) -> sparse.csr_matrix:
        """M / dt, `(3 n, 3 n)` [kg/s]."""
        return sparse.kron(sparse.identity(3), self.density / time_step * space.mass, format="csr")


@dataclass(frozen=True, slots=True)
class Inertia:
    """Momentum of the last step.

    Attributes:
        density: [kg/m^3].
    """

    density: float

    @classmethod
    def added_to(cls, physics: Physics, solder: Solder) -> Physics:
        """Carry momentum from step to step."""
        return replace(physics, momenta=(*physics.momenta, cls(solder.density)))

    def load(self, body: Body, space: Discretisation, time_step: float) -> Floats:
        """M v_n / dt, `(n, 3)` [N]."""
        return self.density / time_step * (space.mass @ body.velocity)


@dataclass(frozen=True, slots=True)
class Viscosity:
    """Newtonian viscosity.

    Attributes:
        coefficient: dynamic viscosity mu [Pa s].
    """

    coefficient: float

    @classmethod
    def added_to(cls, physics: Physics, solder: Solder) -> Physics:
        """Share momentum in the liquid and, where it does not slide freely, with the walls."""
        acting = replace(physics, operators=(*physics.operators, cls(solder.viscosity)))
        if solder.wall == "slip" and solder.slip_length is not None:
            return replace(acting, frictions=(*acting.frictions, NavierSlip(solder.viscosity / solder.slip_length)))
        if solder.wall == "no-slip":
            return replace(acting, holds=(*acting.holds, NoSlip()))
        return acting

    def matrix(self, _body: Body, space: Discretisation, _time_step: float) -> sparse.csr_matrix:
        """Matrix of the virtual power, `(3 n, 3 n)` [kg/s], components one after the other.

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
    """Friction on all walls.

    Attributes:
        coefficient: viscosity over slip length [Pa s/m].
    """

    coefficient: float

    def matrix(self, body: Body, space: Discretisation, _time_step: float) -> sparse.csr_matrix:
        """Matrix `(3 n, 3 n)` [kg/s] that multiplies the velocities relative to the plates."""
        return sparse.diags(np.tile(self.coefficient * wall_areas(body, space), 3), format="csr")


@dataclass(frozen=True, slots=True)
class NoSlip:
    """Walls hold the liquid that touches them, except at contact lines."""

    def pinned(self, body: Body) -> NDArray[np.int32]:
        """The particles on walls, less those of the contact lines."""
        held = body.cloud.wall >= 0
        for ring in body.cloud.rings:
            held[ring] = False
        return np.flatnonzero(held).astype(np.int32)


def wall_areas(body: Body, space: Discretisation) -> Floats:
    """Area of the wall that each particle stands for, `(n,)` [m^2]; zero off the walls.

    The gradient of the volume is the third of the area vectors of all faces around a particle, those of the free
    surface included, which contact lines have a part in.
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
