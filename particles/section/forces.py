"""Forces on a chain, gradients of their energies: surface tension, weight, wetting of the wall z = 0."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.physics.forces import Gravity, SurfaceTension
from reflowshock.particles.section.section import Section


class ChainTension(SurfaceTension):
    """Energy gamma A of the surface."""

    def energy(self, body: Section) -> float:
        """Surface energy [J]."""
        return self.coefficient * body.chain.area(body.line)[0]

    def force(self, body: Section) -> Floats:
        """Force -dE/dx, `(n, 3)` [N]."""
        return -self.coefficient * body.on_particles(body.chain.area(body.line)[1])

    def stiffness(self, body: Section) -> sparse.csr_matrix:
        """Stiffness gamma K of the surface, `(3 n, 3 n)` by particle [N/m]."""
        return self.coefficient * body.chain.stiffness(body.line, len(body.points))


class ChainWeight(Gravity):
    """Potential energy of the weight, zero at the height of the origin."""

    def energy(self, body: Section) -> float:
        """Potential energy [J]."""
        return self.weight * body.chain.integral(body.line, 0, 1)[0]

    def force(self, body: Section) -> Floats:
        """Force -dE/dx, `(n, 3)` [N]."""
        return -self.weight * body.on_particles(body.chain.integral(body.line, 0, 1)[1])


@dataclass(frozen=True, slots=True)
class ChainWetting:
    """Energy -gamma cos(theta) A_wet of the wetted wall.

    Attributes:
        coefficient: surface tension [N/m].
        angle: contact angle [rad].
    """

    coefficient: float
    angle: float

    def energy(self, body: Section) -> float:
        """Energy of the wall [J]."""
        return -self.coefficient * float(np.cos(self.angle)) * body.chain.wetted(body.line)[0]

    def force(self, body: Section) -> Floats:
        """Force -dE/dx on the contact points, `(n, 3)` [N]."""
        return self.coefficient * float(np.cos(self.angle)) * body.on_particles(body.chain.wetted(body.line)[1])
