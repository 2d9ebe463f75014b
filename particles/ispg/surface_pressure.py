"""Pressure right below the free surface: that of the forces on the surface, gamma kappa, and the viscous stress.

A force f on a vertex and the pressure p balance where f + p a = 0, a the gradient of the volume: surface tension alone
gives gamma kappa (Hu et al., eqs 8 and 9), kappa the curvature of the triangles (Meyer et al. 2003). Gravity as a
surface force makes p the pressure above the hydrostatic one.
"""

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.surface.surface_quality import vertex_normals


def force_pressure(body: Body, physics: Physics) -> Floats:
    """Pressure that balances the forces on each vertex of the free surface, `(s,)` [Pa] above ambient.

    On a contact line it is that of the surface next to it, less what the force within the wall is out of balance with
    (wall adhesion is one of the forces, so that this balance is the contact angle), over the area of the vertex. An
    edge bears what is left on a vertex that it holds.
    """
    count = body.cloud.surface_count
    force, slope = physics.force(body), body.volume()[1]
    pressure = -(force * slope)[:count].sum(axis=1) / (slope[:count] ** 2).sum(axis=1)
    normal = np.zeros_like(force)
    normal[:count] = vertex_normals(body.points, body.triangles, count)
    within = physics.admit(body, normal)
    for ring in body.cloud.rings:
        pressure[ring] = _mean_of_neighbours(body, pressure)[ring]
        loose = ring[within[ring].any(axis=1)]
        beside = np.zeros((len(force), 1))
        beside[loose, 0] = pressure[loose]
        unbalanced = (physics.admit(body, force + beside * slope) * within)[loose].sum(axis=1)
        # The area of a vertex along its normal is its area within the wall over the normal's part within the wall.
        area = (slope * within)[loose].sum(axis=1) / np.linalg.norm(within[loose], axis=1)
        pressure[loose] -= unbalanced / area
    return pressure


def _mean_of_neighbours(body: Body, values: Floats) -> Floats:
    """Mean over the vertices off the walls of the triangles around each vertex, `(s,)`."""
    off_walls = body.cloud.wall[: len(values)] < 0
    total, count = np.zeros(len(values)), np.zeros(len(values))
    for corner in range(3):
        for other in (1, 2):
            at, near = body.triangles[:, corner], body.triangles[:, (corner + other) % 3]
            np.add.at(total, at, np.where(off_walls[near], values[near], 0.0))
            np.add.at(count, at, off_walls[near])
    return total / np.maximum(count, 1.0)


def viscous_pressure(body: Body, viscosity: float, gradient: Floats) -> Floats:
    """Normal viscous stress 2 mu n . grad v . n on the free surface, `(s,)` [Pa]: the surrounding gas exerts none.

    The paper's eq 9 leaves it out. The viscous force in the bulk of an irrotational flow vanishes, so that oscillations
    of a drop would not be damped but by errors.

    Args:
        body: the liquid body.
        viscosity: dynamic viscosity [Pa s].
        gradient: `(3, 3, n)` dv_i / dx_j [1/s].
    """
    normal = vertex_normals(body.points, body.triangles, body.cloud.surface_count)
    surface = gradient[:, :, : len(normal)]
    return 2.0 * viscosity * np.einsum("ki,ijk,kj->k", normal, surface, normal)
