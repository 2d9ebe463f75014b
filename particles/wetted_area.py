"""Areas that a contact line encloses on its plate, and those of them beyond the edges of pads, with their gradients.

The edge of a pad is a polygon as the line is: its corners are at the angles under which the pad's centre sees the
vertices of the line. So a vertex at the edge has nothing beyond it, whichever side it comes from, and its energy does
not jump where an edge catches or releases it. The edges' radius gives the pad its area where the vertices are evenly
spaced; where they are not, the polygon is smaller.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Around:
    """A closed line seen from the pads next to it; a segment counts if both its ends belong to the same pad.

    Attributes:
        local: `(k, 2)` vertices from the centre of the pad of each [m].
        same: `(k,)` whether the segment to the next vertex counts.
        edge: `(k,)` radius of the vertices on the edge of the pad of each [m].
        square: `(k,)` square of the pad's own radius [m^2].
        weight: `(k,)` what an area at each vertex counts beyond the edge.
        step: `(k,)` what an area within the edge counts more than one outside.
    """

    local: Floats
    same: NDArray[np.bool_]
    edge: Floats
    square: Floats
    weight: Floats
    step: Floats

    def beyond(self) -> tuple[float, Floats]:
        """Weighed area beyond the edges and what the polygons of the edges miss of the pads [m^2]; its gradient [m].

        The part e a of a vertex's radius beyond the edge e, and e b of the next one's, under the angle t, enclose
        e^2 sin(t) (a + b + a b) / 2 beyond the edge.
        """
        half = np.where(self.same, 0.5 * self.edge**2, 0.0)
        radius = np.linalg.norm(self.local, axis=1)
        a, angle = radius / self.edge - 1.0, turns(self.local)
        b, other = np.roll(a, -1), np.roll(self.weight, -1)
        both = 0.5 * (self.weight + other)
        level = self.weight * a + other * b + both * a * b
        pads = np.where(self.same, 0.5 * self.square, 0.0)
        area = half * np.sin(angle) * level + self.step * (half * np.sin(angle) - pads * angle)
        own = half * np.sin(angle) * (self.weight + both * b) / self.edge
        next_one = half * np.sin(angle) * (other + both * a) / self.edge
        turn = half * np.cos(angle) * (level + self.step) - pads * self.step
        outward = (own + np.roll(next_one, 1)) / radius
        around = (np.roll(turn, 1) - turn) / radius**2
        return float(area.sum()), outward[:, None] * self.local + around[:, None] * _quarter_turn(self.local)


def sectors(local: Floats) -> Floats:
    """Areas of the triangles between the origin and each segment of a closed line, `(k,)` [m^2]; `local (k, 2)`."""
    x, y = local.T
    return 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1))


def enclosed_gradient(local: Floats) -> Floats:
    """Gradient of the area in a closed line, the sum of `sectors`, `(k, 2)` [m]; `local (k, 2)`."""
    return -0.5 * _quarter_turn(np.roll(local, -1, axis=0) - np.roll(local, 1, axis=0))


def turns(local: Floats) -> Floats:
    """Angles about the origin under which each segment of a closed line is seen, `(k,)` [rad]; `local (k, 2)`."""
    after = np.roll(local, -1, axis=0)
    return np.arctan2(2.0 * sectors(local), (local * after).sum(axis=1))


def _quarter_turn(field: Floats) -> Floats:
    """Vectors `(k, 2)` turned counter-clockwise."""
    return np.column_stack((-field[:, 1], field[:, 0]))
