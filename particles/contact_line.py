"""Contact lines: each vertex is pinned at the edge of its wetted disc, or free on the pad, or free on the mask."""

import numpy as np
from numpy.typing import NDArray

from particles.body import Body

Floats = NDArray[np.float64]

PINNED, ON_PAD, ON_MASK = 0, 1, 2
RELEASE_MARGIN = 0.02
CATCH_DISTANCE = 0.05


class ContactLine:
    """The contact line on one wall.

    A line at the edge of the pad stays there while pad angle < contact angle < mask angle (Gibbs' condition);
    a vertex is released when the pad's force pulls it inward or the mask's force pulls it outward, and caught
    again when it returns to the edge.
    """

    def __init__(self, wall: int, edge_radius: float, pad_angle: float, mask_angle: float, radii: Floats) -> None:
        """Let each vertex start where it is: at the edge, inside or outside.

        Args:
            wall: index of the wall and of the ring.
            edge_radius: radius of the vertices on the edge of the wetted disc [m]; infinite on a uniform wall.
            pad_angle: contact angle inside the edge [rad].
            mask_angle: contact angle outside it [rad].
            radii: `(k,)` distances of the vertices from the centre of the pad [m].
        """
        self.wall = wall
        self.edge_radius = edge_radius
        self._cosine = np.array([0.0, np.cos(pad_angle), np.cos(mask_angle)])
        self.state = np.where(radii < edge_radius, ON_PAD, ON_MASK).astype(np.int8)
        self.state[np.isclose(radii, edge_radius, rtol=1e-9)] = PINNED

    def cosine(self) -> Floats:
        """Cosine of the contact angle that acts on each vertex `(k,)`; zero where the edge holds it."""
        return self._cosine[self.state]

    def cosine_area(self, body: Body) -> float:
        """Integral of cos(theta) over the area between the edge and the line [m^2], negative inside the edge.

        Continuous where a vertex leaves the edge, since the area next to a pinned vertex belongs to the free one. On
        a uniform wall it is the whole wetted area.
        """
        local = body.plates[self.wall].local(body.points[body.cloud.rings[self.wall]])[:, :2]
        area = _sectors(local)
        if np.isfinite(self.edge_radius):
            area -= _sectors(local * (self.edge_radius / np.linalg.norm(local, axis=1))[:, None])
        cosine, free = self.cosine(), (self.state != PINNED).astype(float)
        mean = (cosine + np.roll(cosine, -1)) / np.maximum(1.0, free + np.roll(free, -1))
        return float((mean * area).sum())

    def pinned(self, body: Body) -> NDArray[np.int32]:
        """The pinned vertices."""
        return body.cloud.rings[self.wall][self.state == PINNED]

    def outward(self, body: Body) -> tuple[Floats, Floats]:
        """Direction away from the pad's centre `(k, 3)` and length of line that each vertex stands for `(k,)` [m]."""
        points, plate = body.points[body.cloud.rings[self.wall]], body.plates[self.wall]
        local = plate.local(points) * np.array([1.0, 1.0, 0.0])
        radial = local / np.linalg.norm(local, axis=1)[:, None] @ plate.frame
        step = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
        return radial, 0.5 * (step + np.roll(step, 1))

    def contact_cosine(self, body: Body, load: Floats, coefficient: float) -> Floats:
        """Cosine of the contact angle at each vertex `(k,)` from the balance of forces on it.

        The free surface pulls with -gamma cos(theta) a unit length. The load holds the pressure on the vertex' share
        of the surface, too, so that the angle is that of the wall, not of the first triangle. It is averaged with
        the neighbours' (1/4, 1/2, 1/4), since vertices with few and with many triangles take turns along a line.

        Args:
            body: the liquid body.
            load: `(n, 3)` all forces but the wall's, with the pressure [N].
            coefficient: surface tension [N/m].
        """
        radial, length = self.outward(body)
        cosine = -(load[body.cloud.rings[self.wall]] * radial).sum(axis=1) / (coefficient * length)
        return 0.5 * cosine + 0.25 * (np.roll(cosine, 1) + np.roll(cosine, -1))

    def update(self, body: Body, load: Floats, coefficient: float) -> None:
        """Release the vertices that the edge no longer holds, catch those that returned to it (moves these).

        Args: as `contact_cosine`.
        """
        ring, plate = body.cloud.rings[self.wall], body.plates[self.wall]
        cosine = self.contact_cosine(body, load, coefficient)
        local = plate.local(body.points[ring])
        radius = np.linalg.norm(local[:, :2], axis=1)
        near = np.abs(radius - self.edge_radius) < CATCH_DISTANCE * body.cloud.spacing
        holds = near & (cosine < self._cosine[ON_PAD]) & (cosine > self._cosine[ON_MASK])
        returned_outward = (self.state == ON_PAD) & (holds | (radius >= self.edge_radius))
        returned_inward = (self.state == ON_MASK) & (holds | (radius <= self.edge_radius))
        held, caught = self.state == PINNED, returned_outward | returned_inward
        self.state[held & (cosine > self._cosine[ON_PAD] + RELEASE_MARGIN)] = ON_PAD
        self.state[held & (cosine < self._cosine[ON_MASK] - RELEASE_MARGIN)] = ON_MASK
        self.state[caught] = PINNED
        local[caught, :2] *= (self.edge_radius / radius[caught])[:, None]
        body.points[ring[caught]] = plate.place(local[caught])


def _sectors(local: Floats) -> Floats:
    """Areas of the triangles between the centre and each segment of a closed line, `(k,)` [m^2]; `local (k, 2)`."""
    x, y = local.T
    return 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1))
