"""Contact angle hysteresis on a uniform wall: a line advances at one angle, recedes at a smaller one, rests in between.

Contact angles do not depend on the speed of the line.
"""

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.plate import Pad
from reflowshock.particles.core.surface_measure import ring_area_gradient
from reflowshock.particles.core.symmetry import share, whole_points
from reflowshock.particles.surface.contact_line import (
    ON_MASK,
    ON_PAD,
    PINNED,
    RELEASE_MARGIN,
    ContactLine,
    sector_areas,
)

RECEDING, ADVANCING = ON_PAD, ON_MASK


class HystereticLine(ContactLine):
    """Contact line on a uniform wall with contact-angle hysteresis.

    A vertex is pinned while receding angle < contact angle < advancing angle. Beyond that it moves under the force of
    the exceeded angle, and is pinned again as soon as the liquid carries it the other way.
    """

    def __init__(self, wall: int, receding_angle: float, advancing_angle: float, local: Floats) -> None:
        """Pin each vertex at its position.

        Args:
            wall: Index of the contact line and of its plate.
            receding_angle: Largest contact angle at which the line recedes [rad].
            advancing_angle: Smallest contact angle at which the line advances [rad].
            local: Vertices in the frame of the plate, shape (k, 2) or (k, 3) [m].
        """
        super().__init__(
            wall, (Pad((0.0, 0.0), np.inf, receding_angle),), advancing_angle, local, np.array([len(local)])
        )
        self.state[:], self._mean_cosine = PINNED, 0.5 * float(np.cos(receding_angle) + np.cos(advancing_angle))

    @property
    def has_energy(self) -> bool:
        """False: the force of a line with hysteresis includes friction."""
        return False

    @property
    def has_events(self) -> bool:
        """True: vertices are pinned and released."""
        return True

    def cosine_area_gradient(self, body: Body) -> Floats:
        """Return the force on the vertices over the surface tension, shape (k, 3) [m].

        It is the cosine at each vertex times the gradient of the wetted area.
        """
        return self.cosine()[:, None] * self._area_gradient(body)

    def _level(self, body: Body) -> float:
        """Return the wetted area times the mean of both cosines [m^2]; friction acts symmetrically about that mean."""
        points, _ = whole_points(body.cloud, body.points, self.wall)
        return self._mean_cosine * float(sector_areas(body.plates[self.wall].local(points)[:, :2]).sum())

    def _area_gradient(self, body: Body) -> Floats:
        """Return the gradient of the wetted area with respect to the vertices of the line, shape (k, 3) [m]."""
        ring, (points, index) = body.cloud.rings[self.wall], whole_points(body.cloud, body.points, self.wall)
        whole = ring_area_gradient(points, np.arange(len(index), dtype=np.int32))[: len(ring)]
        return share(body.cloud)[ring][:, None] * whole

    def update(self, body: Body, load: Floats, coefficient: float) -> None:
        """Pin vertices that have reversed their motion; release those whose angle exceeds one of the two.

        Args:
            body: Liquid body.
            load: As for ``ContactLine.contact_cosine``.
            coefficient: Surface tension [N/m].
        """
        outward, _ = self.outward(body)
        speed = (body.velocity[body.cloud.rings[self.wall]] * outward).sum(axis=1)
        has_reversed = ((self.state == ADVANCING) & (speed < 0.0)) | ((self.state == RECEDING) & (speed > 0.0))
        self.state[has_reversed] = PINNED
        cosine, is_pinned = self.contact_cosine(body, load, coefficient), self.state == PINNED
        self.state[is_pinned & (cosine > self._pad_cosine[0] + RELEASE_MARGIN)] = RECEDING
        self.state[is_pinned & (cosine < self._mask_cosine - RELEASE_MARGIN)] = ADVANCING


class FrictionLine(HystereticLine):
    """Contact line with hysteresis in a flow with inertia, whose friction is solved with the time step.

    Coulomb's law holds at each vertex: while the vertex is pinned, the wall pulls with gamma cos(theta) a unit length,
    where theta between both angles is the one that balances the other forces. A moving vertex has the force of one of
    the angles, against its motion. Which vertices are pinned is found with the velocities of the step
    (``update_states``), so friction never adds energy.
    """

    @property
    def has_events(self) -> bool:
        """False: vertices are pinned and released within the solution of a step."""
        return False

    def friction(self, body: Body) -> Floats:
        """Return the friction force on the moving vertices over the surface tension, shape (k, 3) [m]."""
        beyond = np.where(self.state == PINNED, 0.0, self.cosine() - self._mean_cosine)
        return beyond[:, None] * self._area_gradient(body)

    def friction_power(self, body: Body, velocity: Floats) -> float:
        """Return the power dissipated by friction at velocities (n, 3) [m/s] over the surface tension [m^2/s]."""
        return -float((self.friction(body) * velocity[body.cloud.rings[self.wall]]).sum())

    def update_states(self, body: Body, velocity: Floats, needed: Floats, releases: bool) -> bool:
        """Pin vertices that have reversed their motion; release those that the wall cannot hold.

        Args:
            body: Liquid body for which the forces of the step were computed.
            velocity: Velocities at the end of the step, shape (n, 3) [m/s].
            needed: Force that keeps the pinned vertices in place, over the surface tension, shape (n, 3) [m].
            releases: Whether vertices may be released.

        Returns:
            Whether any state has changed, so that the step has to be solved again.
        """
        ring, across = body.cloud.rings[self.wall], self._area_gradient(body)
        speed, state, is_pinned = (velocity[ring] * across).sum(axis=1), self.state.copy(), self.state == PINNED
        state[((state == ADVANCING) & (speed < 0.0)) | ((state == RECEDING) & (speed > 0.0))] = PINNED
        if releases:
            cosine = (needed[ring] * across).sum(axis=1) / (across**2).sum(axis=1)
            state[is_pinned & (cosine > self._pad_cosine[0])] = RECEDING
            state[is_pinned & (cosine < self._mask_cosine)] = ADVANCING
        changed = bool((state != self.state).any())
        self.state = state
        return changed
