"""Forces on a chain, gradients of their energies: surface tension, weight, wetting of the wall z = 0."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.physics.forces import Gravity, SurfaceTension
from reflowshock.particles.section.section import as_section


class PolylineTension(SurfaceTension):
    """Energy gamma A of the surface."""

    def energy(self, body: Body) -> float:
        """Surface energy [J]."""
        section = as_section(body)
        return self.coefficient * section.chain.area(section.line)[0]

    def force(self, body: Body) -> Floats:
        """Force -dE/dx, `(n, 3)` [N]."""
        section = as_section(body)
        return -self.coefficient * section.on_particles(section.chain.area(section.line)[1])

    def stiffness(self, body: Body) -> sparse.csr_matrix:
        """Stiffness gamma K of the surface, `(3 n, 3 n)` by particle [N/m]."""
        section = as_section(body)
        return self.coefficient * section.chain.stiffness(section.line, len(section.points))


class PolylineWeight(Gravity):
    """Potential energy of the weight, zero at the height of the origin."""

    def energy(self, body: Body) -> float:
        """Potential energy [J]."""
        section = as_section(body)
        return self.weight * section.chain.integral(section.line, 0, 1)[0]

    def force(self, body: Body) -> Floats:
        """Force -dE/dx, `(n, 3)` [N]."""
        section = as_section(body)
        return -self.weight * section.on_particles(section.chain.integral(section.line, 0, 1)[1])


@dataclass(frozen=True, slots=True)
class PolylineWetting:
    """Energy -gamma cos(theta) A_wet of the wetted wall.

    Attributes:
        coefficient: surface tension [N/m].
        angle: contact angle [rad].
    """

    coefficient: float
    angle: float

    def energy(self, body: Body) -> float:
        """Energy of the wall [J]."""
        section = as_section(body)
        return -self.coefficient * float(np.cos(self.angle)) * section.chain.wetted(section.line)[0]

    def force(self, body: Body) -> Floats:
        """Force -dE/dx on the contact points, `(n, 3)` [N]."""
        section = as_section(body)
        return (
            self.coefficient * float(np.cos(self.angle)) * section.on_particles(section.chain.wetted(section.line)[1])
        )
