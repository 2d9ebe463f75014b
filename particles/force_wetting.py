"""Wall adhesion as an energy: wetting a wall gains gamma cos(theta) a unit area."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from particles.body import Body
from particles.contact_line import ContactLine
from particles.physics import Force
from particles.symmetry import fold

Floats = NDArray[np.float64]


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
        load, _ = self._load(body)
        return [line.contact_cosine(body, load, self.coefficient) for line in self.lines]

    def update(self, body: Body) -> None:
        """Release and catch vertices at the edges of the wetted discs."""
        load, pressure = self._load(body)
        for line in self.lines:
            line.update(body, load, self.coefficient)
            for vertex in np.flatnonzero(line.near_edges(body, load, self.coefficient)):
                self._catch(body, line, int(vertex), pressure)

    def _catch(self, body: Body, line: ContactLine, vertex: int, pressure: float) -> None:
        """Put a vertex of a line onto the edge next to it, unless that raises the energy at equal volume."""

        def level() -> float:
            return self.energy(body) + sum(other.energy(body) for other in self.others) - pressure * body.volume()[0]

        points, state, constant, before = body.points.copy(), line.state.copy(), line.constant, level()
        line.catch(body, np.arange(len(state)) == vertex)
        if level() > before:
            body.points, line.state, line.constant = points, state, constant

    def _load(self, body: Body) -> tuple[Floats, float]:
        """All forces but the walls', `(n, 3)` [N], with the mean capillary pressure of the surface, and this [Pa].

        The pressure p is the least-squares solution of f + p a = 0 over the vertices off the contact lines; the
        pressure of the solve would bring the accelerations of a violent start into the contact angle.
        """
        force = sum((other.force(body) for other in self.others), np.zeros_like(body.points))
        force, gradient = fold(body.cloud, force), fold(body.cloud, body.volume()[1])
        off_lines = np.arange(len(body.points)) < body.cloud.surface_count
        off_lines[body.cloud.wall >= 0] = False
        a = gradient[off_lines]
        pressure = -float((force[off_lines] * a).sum() / (a**2).sum())
        return force + pressure * gradient, pressure
