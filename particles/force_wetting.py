"""Wall adhesion as an energy: wetting a wall gains gamma cos(theta) a unit area."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from particles.body import Body
from particles.contact_line import ContactLine
from particles.surface_measure import ring_area, ring_area_gradient

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Wetting:
    """Energy E = -gamma cos(theta) A_wet of the wetted walls (the functional of Brakke's Surface Evolver).

    Attributes:
        coefficient: surface tension gamma [N/m].
        lines: contact lines with the angle that acts on each vertex.
    """

    coefficient: float
    lines: Sequence[ContactLine]

    def energy(self, body: Body) -> float:
        """Energy of the walls [J]; a mean angle where the line lies on pad and mask."""
        return -self.coefficient * sum(
            float(line.cosine().mean()) * ring_area(body.points, body.cloud.rings[line.wall]) for line in self.lines
        )

    def force(self, body: Body) -> Floats:
        """Force gamma cos(theta) dA_wet/dx on the contact lines, `(n, 3)` [N]."""
        force = np.zeros_like(body.points)
        for line in self.lines:
            ring = body.cloud.rings[line.wall]
            force[ring] += self.coefficient * line.cosine()[:, None] * ring_area_gradient(body.points, ring)
        return force
