"""Wall adhesion as an energy: wetting a wall gains gamma cos(theta) a unit area."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.symmetry import fold
from reflowshock.particles.physics.physics import Force
from reflowshock.particles.surface.contact_line import ContactLine


@dataclass(frozen=True, slots=True)
class Wetting:
    """Energy E = -gamma cos(theta) A_wet of the wetted walls (the functional of Brakke's Surface Evolver).

    Attributes:
        coefficient: surface tension gamma [N/m].
        lines: contact lines with the angle that acts on each vertex.
        others: all other forces on the surface; with them a pinned vertex knows its contact angle.
    """

    coefficient: float
    lines: Sequence[ContactLine]
    others: Sequence[Force]

    def energy(self, body: Body) -> float:
        """Energy of the walls [J], that of a line at the edges of the pads being zero."""
        return -self.coefficient * sum(line.cosine_area(body) for line in self.lines)

    def force(self, body: Body) -> Floats:
        """Force -dE/dx on the contact lines, gamma cos(theta) dA_wet/dx where one angle acts, `(n, 3)` [N]."""
        force = np.zeros_like(body.points)
        for line in self.lines:
            ring = body.cloud.rings[line.wall]
            force[ring] += self.coefficient * line.cosine_area_gradient(body)
        return force

    def contact_cosines(self, body: Body) -> list[Floats]:
        """Cosines of the contact angles at the vertices of each contact line, from the balance of forces."""
        load = self._load(body)
        return [line.contact_cosine(body, load, self.coefficient) for line in self.lines]

    def update(self, body: Body) -> None:
        """Release vertices at the edges of the wetted discs, hold those that have crossed one."""
        load = self._load(body)
        for line in self.lines:
            line.update(body, load, self.coefficient)

    def attempt(self, body: Body) -> bool:
        """Put vertices close to an edge that would hold them onto it; return whether there were any.

        Alone this dents the surface: it pays where the step that follows gains more than it takes.
        """
        load, found = self._load(body), False
        for line in self.lines:
            near = line.near_edges(body, load, self.coefficient)
            if near.any():
                line.catch(body, near)
                found = True
        return found

    def _load(self, body: Body) -> Floats:
        """All forces but the walls', `(n, 3)` [N], with the mean capillary pressure of the surface.

        The pressure p is the least-squares solution of f + p a = 0 over the vertices off the contact lines; the
        pressure of the solve would bring the accelerations of a violent start into the contact angle.
        """
        force = sum((other.force(body) for other in self.others), np.zeros_like(body.points))
        force, gradient = fold(body.cloud, force), fold(body.cloud, body.volume()[1])
        off_lines = np.arange(len(body.points)) < body.cloud.surface_count
        off_lines[body.cloud.wall >= 0] = False
        a = gradient[off_lines]
        pressure = -float((force[off_lines] * a).sum() / (a**2).sum())
        return force + pressure * gradient
