"""A contact line with hysteresis: it advances at one contact angle, recedes at a smaller one, and else stands."""

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.plate import Pad
from reflowshock.particles.core.surface_measure import ring_area_gradient
from reflowshock.particles.core.symmetry import share, whole_points
from reflowshock.particles.surface.contact_line import ON_MASK, ON_PAD, PINNED, RELEASE_MARGIN, ContactLine

RECEDING, ADVANCING = ON_PAD, ON_MASK


class HystereticLine(ContactLine):
    """The contact line on a uniform wall whose advancing and receding angles differ.

    Each vertex stands while receding angle < contact angle < advancing angle. Beyond, it moves with the force of the
    angle that it has passed, and stands again as soon as the liquid carries it the other way.
    """

    def __init__(self, wall: int, receding_angle: float, advancing_angle: float, local: Floats) -> None:
        """Let each vertex stand where it is.

        Args:
            wall: index of the wall and of the ring.
            receding_angle: largest contact angle at which the line recedes [rad].
            advancing_angle: smallest contact angle at which the line advances [rad].
            local: `(k, 2)` or `(k, 3)` vertices in the frame of the plate [m].
        """
        super().__init__(
            wall, (Pad((0.0, 0.0), np.inf, receding_angle),), advancing_angle, local, np.array([len(local)])
        )
        self.state[:] = PINNED

    @property
    def has_energy(self) -> bool:
        """None: what a line that stands and moves takes is friction."""
        return False

    def cosine_area_gradient(self, body: Body) -> Floats:
        """Force over the surface tension: the angle that acts on each vertex times the gradient of the wetted area."""
        ring, (points, index) = body.cloud.rings[self.wall], whole_points(body.cloud, body.points, self.wall)
        whole = ring_area_gradient(points, np.arange(len(index), dtype=np.int32))[: len(ring)]
        return (self.cosine() * share(body.cloud)[ring])[:, None] * whole

    def update(self, body: Body, load: Floats, coefficient: float) -> None:
        """Let vertices stand that moved against their sense, release those whose angle passed one of the two.

        Args: as `ContactLine.contact_cosine`.
        """
        outward, _ = self.outward(body)
        speed = (body.velocity[body.cloud.rings[self.wall]] * outward).sum(axis=1)
        turned = ((self.state == ADVANCING) & (speed < 0.0)) | ((self.state == RECEDING) & (speed > 0.0))
        self.state[turned] = PINNED
        cosine, standing = self.contact_cosine(body, load, coefficient), self.state == PINNED
        self.state[standing & (cosine > self._pad_cosine[0] + RELEASE_MARGIN)] = RECEDING
        self.state[standing & (cosine < self._mask_cosine - RELEASE_MARGIN)] = ADVANCING
