"""What a wall does to the liquid that slides on it: nothing (free slip), a friction (Navier slip), or it holds it.

Navier's condition: the shear stress on the wall is mu / b times the velocity relative to the plate, b the slip length,
the depth below the wall at which the flow, continued linearly, would rest. Contact lines stay mobile without slip, too:
there the stress of a line that moves would be infinite (Huh & Scriven 1971).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.discretisation.discretisation import Discretisation


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
