"""Surface tension and wetting: the energy of a triangulated surface and its forces on the vertices.

The energy is E = gamma (A_free - cos(theta) A_wet), with the surface tension gamma and the contact angle theta. Forces
are -d(E - p V)/dx, where the pressure p balances the tension over the whole surface in the mean: only differences from
equilibrium remain. The contact angle is not imposed; it results from the balance of forces on the contact line.

On solid ground the surface stays closed: where it lies on the ground its tension is -gamma cos(theta) in place of
gamma, along the ground, which gives the same contact angle.
"""

from dataclasses import dataclass

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.surface_measure import area_gradient, surface_area, triangle_areas, volume_and_gradient
from reflowshock.particles.sph.fluid_state import Law
from reflowshock.particles.surface import ground
from reflowshock.particles.surface.surface_mesh import SurfaceMesh


@dataclass(frozen=True, slots=True)
class Capillarity:
    """Surface tension and contact angles of a liquid.

    Attributes:
        tension: Surface tension gamma [N/m].
        cosine: Cosine of the contact angle.
        law: Parameters of the pair interactions.
        bounds: Cosines of the advancing and the receding contact angle on the wall; None without hysteresis.
    """

    tension: float
    cosine: float
    law: Law
    bounds: tuple[float, float] | None = None

    def energy(self, mesh: SurfaceMesh) -> float:
        """Return the surface energy E of the triangles [J]."""
        area, wet = surface_area(mesh.points, mesh.triangles), mesh.wetted_area
        if mesh.ground is not None:
            grounded = float(triangle_areas(mesh.points, mesh.triangles) @ mesh.triangle_wetness())
            area, wet = area - grounded, wet + grounded
        return self.tension * (area - self.cosine * wet)

    def forces(self, mesh: SurfaceMesh, drift: Floats | None = None) -> tuple[Floats, float]:
        """Compute the forces on the vertices; contact lines have none across the wall.

        Args:
            mesh: The surface.
            drift: Velocities of the vertices over the sliding velocity, shape (m, 2), as ``relative_drift`` returns
                them. Without them contact lines have one angle.

        Returns:
            Forces -d(E - p V)/dx, shape (m, 3) [N], and the pressure p [Pa].
        """
        wetness = None if mesh.ground is None else mesh.triangle_wetness()
        result = -self.tension * area_gradient(mesh.points, mesh.triangles, None if wetness is None else 1.0 - wetness)
        pressure = _balancing_pressure(mesh, result)
        result += pressure * volume_and_gradient(mesh.points, mesh.triangles, (), ())[1]
        if wetness is not None:
            result += self.tension * self.cosine * area_gradient(mesh.points, mesh.triangles, wetness)
            result = ground.remove_normal_part(result, mesh.wetness, mesh.ground_normals)
        for ring in mesh.rings:
            outward = line_normals(mesh.points[ring])
            cosines: Floats | float = self.cosine
            if self.bounds is not None and drift is not None:
                cosines = contact_cosines(*self.bounds, outward, result[ring, :2] / self.tension, drift[ring])
            result[ring, :2] += self.tension * cosines * outward
            result[ring, 2] = 0.0
        return result, pressure

    def relative_drift(self, velocities: Floats) -> Floats | None:
        """Return velocities (m, 3) [m/s] along the wall over the sliding velocity; None without hysteresis."""
        if self.bounds is None or not self.tension:
            return None
        return divide_by_sliding_velocity(velocities, self.tension, self.law)


def _balancing_pressure(mesh: SurfaceMesh, forces: Floats) -> float:
    """Return the pressure [Pa] that balances forces of tension (m, 3) [N] on the free surface in the mean."""
    area = mesh.outward_areas()
    for ring in mesh.rings:
        area[ring] = 0.0
    if mesh.ground is not None:
        area *= 1.0 - mesh.wetness[:, None]
    square = float((area**2).sum())
    return -float((forces * area).sum()) / square if square else 0.0


def line_normals(line: Floats) -> Floats:
    """Return the outward normals of a contact line within the wall, shape (k, 2) [m].

    Their length is half the distance between the two neighbours of each vertex.

    Args:
        line: Vertices of the closed contact line in order, the liquid to the left, shape (k, 3) [m].
    """
    along = np.roll(line, -1, axis=0) - np.roll(line, 1, axis=0)
    return 0.5 * np.stack((along[:, 1], -along[:, 0]), axis=1)


def contact_cosines(lowest: float, highest: float, outward: Floats, push: Floats, drift: Floats) -> Floats:
    """Return the cosine of the contact angle at each vertex of a contact line with hysteresis, shape (k, 1).

    As dry friction does, the wall holds a line at rest against the pull of the free surface and of the pressure of a
    liquid at rest. A line that the liquid drives on has the advancing or the receding angle if it is fast enough: its
    velocity over the sliding velocity must exceed the imbalance of the cosine of that angle, which is 1/2 for a line
    that has 90 degrees at rest and advances at 120. A slower line has an angle in between.

    Args:
        lowest: Cosine of the advancing angle.
        highest: Cosine of the receding angle.
        outward: Outward normals within the wall, as long as half the distance between the neighbours of each vertex,
            shape (k, 2) [m].
        push: Forces on the vertices except the wall force, over the surface tension, shape (k, 2) [m].
        drift: Velocities of the vertices over the sliding velocity, shape (k, 2).
    """
    length = np.hypot(outward[:, 0], outward[:, 1])
    needed = -((push * outward).sum(axis=1) / length + (drift * outward).sum(axis=1)) / length
    return np.clip(needed, lowest, highest)[:, None]


def divide_by_sliding_velocity(velocities: Floats, tension: float, law: Law) -> Floats:
    """Return the components of velocities along the wall z = 0, divided by the sliding velocity, shape (m, 2).

    From the sliding velocity on, gamma / (rho h c), a contact line slides. At it friction would stop the mass of a
    support, rho h^2 a unit of length, while sound crosses the support: a time step of a quarter of that takes a third
    of the velocity, and more than all of it would be unstable. So the sliding velocity depends on the spacing and on
    the speed of sound.

    Args:
        velocities: Velocities of the vertices, shape (m, 3) [m/s].
        tension: Surface tension [N/m].
        law: Parameters of the pair interactions, among them smoothing length, density and speed of sound.
    """
    return velocities[:, :2] * (law.rest_density * law.length * law.sound / tension)
