"""Forces on a surface in section, as energy gradients: surface tension, weight, wetting of the wall z = 0."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.forces import Gravity, SurfaceTension
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.section.section import as_section


class PolylineTension(SurfaceTension):
    """Surface tension with the energy gamma A."""

    def energy(self, body: Body) -> float:
        """Return the surface energy [J]."""
        section = as_section(body)
        return self.coefficient * section.polyline.area(section.line)[0]

    def force(self, body: Body) -> Floats:
        """Return the force -dE/dx, shape (n, 3) [N]."""
        section = as_section(body)
        return -self.coefficient * section.on_particles(section.polyline.area(section.line)[1])

    def stiffness(self, body: Body) -> sparse.csr_matrix:
        """Return the stiffness gamma K of the surface by particle, shape (3 n, 3 n) [N/m]."""
        section = as_section(body)
        return self.coefficient * section.polyline.stiffness(section.line, len(section.points))


class PolylineWeight(Gravity):
    """Weight with a potential energy that vanishes at the height of the origin."""

    def energy(self, body: Body) -> float:
        """Return the potential energy [J]."""
        section = as_section(body)
        return self.weight * section.polyline.integral(section.line, 0, 1)[0]

    def force(self, body: Body) -> Floats:
        """Return the force -dE/dx, shape (n, 3) [N]."""
        section = as_section(body)
        return -self.weight * section.on_particles(section.polyline.integral(section.line, 0, 1)[1])


@dataclass(frozen=True, slots=True)
class PolylineWetting:
    """Wetting of the wall with the energy -gamma cos(theta) A_wet.

    Attributes:
        coefficient: Surface tension [N/m].
        angle: Contact angle [rad].
    """

    coefficient: float
    angle: float

    @classmethod
    def added_to(cls, physics: Physics, solder: Solder) -> Physics:
        """Add the force to the physics."""
        wetting = cls(solder.surface_tension, solder.pad_contact_angle)
        return replace(physics, forces=(*physics.forces, wetting))

    def energy(self, body: Body) -> float:
        """Return the energy of the wetted wall [J]."""
        section = as_section(body)
        return -self.coefficient * float(np.cos(self.angle)) * section.polyline.wetted(section.line)[0]

    def force(self, body: Body) -> Floats:
        """Return the force -dE/dx, which acts on the contact points, shape (n, 3) [N]."""
        section = as_section(body)
        gradient = section.on_particles(section.polyline.wetted(section.line)[1])
        return self.coefficient * float(np.cos(self.angle)) * gradient
