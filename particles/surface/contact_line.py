"""Contact lines: each vertex is pinned at the edge of a pad, or free on a pad, or free on the mask between pads.

On a uniform wall with hysteresis a line advances at one contact angle, recedes at a smaller one, and else stands.

Each has its own plate and knows all pads of its wall. Contact angles do not depend on the speed of the line.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import equal_area_radius
from reflowshock.particles.core.plate import Pad
from reflowshock.particles.core.surface_measure import ahead, behind, ring_area_gradient
from reflowshock.particles.core.symmetry import share, unit, whole_points

PINNED, ON_PAD, ON_MASK = 0, 1, 2
RECEDING, ADVANCING = ON_PAD, ON_MASK  # of a line with hysteresis
RELEASE_MARGIN = 0.02
CATCH_DISTANCE = 0.05
SAVED = ("edges", "pad", "state", "constant", "stopped")


class ContactLine:
    """One contact line on a wall, which is solder mask with one pad or several.

    A line at the edge of a pad stays there while pad angle < contact angle < mask angle (Gibbs' condition); a vertex
    is released when the pad's force pulls it inward or the mask's force pulls it outward, and caught again when it
    returns to the edge. A line that comes to a pad from outside steps onto it.

    Attributes:
        wall: index of the contact line among the body's, and of its plate.
        pads: the pads on the wall.
        edges: `(m,)` radii of the vertices on the edge of each pad [m].
        pad: `(k,)` the pad whose edge is nearest to each vertex.
        state: `(k,)` PINNED, ON_PAD or ON_MASK.
        constant: what the formula of `cosine_area` has jumped by where states changed [m^2].
        stopped: `(k,)` whether a vertex was caught at the end of the last step; the edge holds it in the next one.
    """

    def __init__(self, wall: int, pads: Sequence[Pad], mask_angle: float, local: Floats, corners: Floats) -> None:
        """Let each vertex start where it is: at an edge, inside or outside.

        Args:
            wall: index of the contact line.
            pads: the pads on the wall, at least one.
            mask_angle: contact angle outside them [rad].
            local: `(k, 2)` or `(k, 3)` vertices in the frame of the plate [m].
            corners: `(m,)` vertices that a line along the whole edge of each pad has: their polygon has the pad's area.
        """
        self.wall, self._mask_cosine = wall, float(np.cos(mask_angle))
        self._take_pads(pads)
        self.edges = equal_area_radius(np.array([pad.radius for pad in pads]), corners)
        self.constant, self.stopped = 0.0, np.zeros(len(local), bool)
        self.pad = self._nearest(local)
        distance = self._offset(local)[1]
        edge = self.edges[self.pad]
        self.state = np.where(distance < edge, ON_PAD, ON_MASK).astype(np.int8)
        self.state[np.isclose(distance, edge, rtol=1e-9)] = PINNED

    def _take_pads(self, pads: Sequence[Pad]) -> None:
        self.pads = tuple(pads)
        self._centres = np.array([pad.centre for pad in pads])
        radii = np.array([pad.radius for pad in pads])
        self._square = np.where(np.isfinite(radii), radii, 0.0) ** 2
        self._pad_cosine = np.cos([pad.angle for pad in pads])

    def saved(self) -> dict[str, Any]:
        """Pads and where the vertices stand on them, for a checkpoint."""
        return {"pads": self.pads} | {name: getattr(self, name) for name in SAVED}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        self._take_pads(saved["pads"])
        for name in SAVED:
            setattr(self, name, saved[name])

    def follow(self, before: Indices, after: Indices) -> None:
        """Keep the states of the vertices of a line that has changed: `after (k,)` names those of `before` they are."""
        place = {vertex: number for number, vertex in enumerate(before.tolist())}
        index = [place[vertex] for vertex in after.tolist()]
        self.pad, self.state, self.stopped = self.pad[index], self.state[index], self.stopped[index]

    @property
    def has_edge(self) -> bool:
        """Whether there is a mask to leave a pad for; a uniform wall has none."""
        return bool(np.isfinite(self.edges).all())

    @property
    def has_energy(self) -> bool:
        """Whether the force on the line is the gradient of an energy, `cosine_area`."""
        return True

    @property
    def has_events(self) -> bool:
        """Whether vertices may change their states: none does on a uniform wall."""
        return self.has_edge

    def held_pads(self) -> frozenset[int]:
        """The pads that the line is on or at the edge of."""
        return frozenset(self.pad[self.state != ON_MASK].tolist())

    def cosine(self) -> Floats:
        """Cosine of the contact angle that acts on each vertex `(k,)`; zero where an edge holds it."""
        free = np.where(self.state == ON_PAD, self._pad_cosine[self.pad], self._mask_cosine)
        return np.where(self.state == PINNED, 0.0, free)

    def cosine_area(self, body: Body) -> float:
        """Integral of cos(theta) over the wetted area [m^2], zero for a line along the edges of the pads it surrounds.

        On a uniform wall it is that of the whole wetted area. Where a vertex leaves an edge or is caught by one it does
        not change: nothing has moved.
        """
        return (self._level(body) + self.constant) / body.cloud.parts

    def cosine_area_gradient(self, body: Body) -> Floats:
        """Gradient of `cosine_area` by the vertices of the line, `(k, 3)` [m]."""
        ring, plate = body.cloud.rings[self.wall], body.plates[self.wall]
        points, index = whole_points(body.cloud, body.points, self.wall)
        local, pad = plate.local(points)[:, :2], self.pad[index]
        own, weight = local - self._centres[pad], self._beyond_mask(index)
        level = self._mask_cosine * _sectors_gradient(local, np.ones(len(local))) + _sectors_gradient(own, weight)
        if self.has_edge:  # the angles about the pads that are surrounded add up to whole turns
            level -= 0.5 * _turns_gradient(own, self._square[pad] * weight)
        return (level @ plate.frame[:2])[: len(ring)] * share(body.cloud)[ring][:, None]

    def _level(self, body: Body) -> float:
        """The integral for the line around the whole body [m^2], but for a constant.

        An area next to a pinned vertex belongs to the free one. A segment between pinned vertices has no cosine: where
        they are not evenly spaced, it has not the area of its part of the edge, and this jumps as one of them leaves.
        """
        points, index = whole_points(body.cloud, body.points, self.wall)
        local, pad = body.plates[self.wall].local(points)[:, :2], self.pad[index]
        own = local - self._centres[pad]
        area, beyond = _sectors(local).sum(), _sectors(own)
        if self.has_edge:
            turns = np.array([_turns(local - centre).sum() for centre in self._centres])
            area -= 0.5 * self._square @ turns
            beyond -= 0.5 * self._square[pad] * _turns(own)
        return float(self._mask_cosine * area + self._beyond_mask(index) @ beyond)

    def _beyond_mask(self, index: NDArray[np.int64]) -> Floats:
        """Mean cosine of the free ends of each segment, less that of the mask; 0 from one pad to another, `(k,)`."""
        cosine, free = self.cosine()[index], (self.state[index] != PINNED).astype(float)
        mean = (cosine + ahead(cosine)) / np.maximum(1.0, free + ahead(free))
        pad = self.pad[index]
        return np.where(pad == ahead(pad), mean - self._mask_cosine, 0.0)

    def pinned(self, body: Body) -> Indices:
        """The pinned vertices."""
        return body.cloud.rings[self.wall][self.state == PINNED]

    def outward(self, body: Body) -> tuple[Floats, Floats]:
        """Direction across the line out of the liquid `(k, 3)` and length of line of each vertex `(k,)` [m]."""
        points, ring = whole_points(body.cloud, body.points, self.wall)[0], body.cloud.rings[self.wall]
        before, after = behind(points), ahead(points)
        across = unit(np.cross(after - before, body.plates[self.wall].normal))[: len(ring)]
        step = np.linalg.norm(after - points, axis=1)
        return across, (0.5 * (step + behind(step)))[: len(ring)] * share(body.cloud)[ring]

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
        outward, length = self.outward(body)
        cosine = -(load[body.cloud.rings[self.wall]] * outward).sum(axis=1) / (coefficient * length)
        around = cosine[whole_points(body.cloud, body.points, self.wall)[1]]
        return (0.5 * around + 0.25 * (behind(around) + ahead(around)))[: len(cosine)]

    def update(self, body: Body, load: Floats, coefficient: float) -> None:
        """Release the vertices that their edge no longer holds, catch those that crossed one or step onto a pad.

        Args: as `contact_cosine`.
        """
        ring, plate = body.cloud.rings[self.wall], body.plates[self.wall]
        cosine, local = self.contact_cosine(body, load, coefficient), plate.local(body.points[ring])
        state, pad = self.state.copy(), np.where(self.state == ON_MASK, self._nearest(local), self.pad)
        self._change(body, state, pad)
        offset, radius = self._offset(local)
        edge, pad_cosine = self.edges[pad], self._pad_cosine[pad]
        # Behind the line is the pad that the liquid covers; one before it is stepped onto, not caught at.
        before = ~self._behind(body, offset)
        on_pad, on_mask, held = (state == which for which in (ON_PAD, ON_MASK, PINNED))
        held &= ~self.stopped
        self.stop_at_edges(body)
        state, self.stopped = self.state.copy(), np.zeros_like(self.stopped)
        state[on_mask & before & (radius < edge)] = ON_PAD
        state[on_pad & before & (radius > edge)] = ON_MASK
        state[held & (cosine > pad_cosine + RELEASE_MARGIN)] = ON_PAD
        state[held & (cosine < self._mask_cosine - RELEASE_MARGIN)] = ON_MASK
        self._change(body, state, pad)

    def near_edges(self, body: Body, load: Floats, coefficient: float) -> NDArray[np.bool_]:
        """Whether a vertex is close to an edge that would hold it `(k,)`; arguments as `contact_cosine`."""
        nothing = np.zeros(len(self.state), bool)
        if not self.has_edge:
            return nothing
        offset, radius = self._offset(body.plates[self.wall].local(body.points[body.cloud.rings[self.wall]]))
        near = (self.state != PINNED) & (np.abs(radius - self.edges[self.pad]) < CATCH_DISTANCE * body.cloud.spacing)
        if not near.any():
            return nothing
        cosine = self.contact_cosine(body, load, coefficient)
        # With a margin as for the release: a line at rest just off the edge has the angle of its side.
        low, high = self._mask_cosine + RELEASE_MARGIN, self._pad_cosine[self.pad] - RELEASE_MARGIN
        return near & (low < cosine) & (cosine < high) & self._behind(body, offset)

    def stop_at_edges(self, body: Body) -> None:
        """Catch the vertices that have crossed the edge of their pad (moves these).

        Beyond it the angle that drove them acts no more, and the energy that they gained there is none.
        """
        if not self.has_edge:
            return
        offset, radius = self._offset(body.plates[self.wall].local(body.points[body.cloud.rings[self.wall]]))
        edge = self.edges[self.pad]
        crossed = ((self.state == ON_PAD) & (radius >= edge)) | ((self.state == ON_MASK) & (radius <= edge))
        if crossed.any():
            crossed &= self._behind(body, offset)
            self.catch(body, crossed)
            self.stopped = self.stopped | crossed

    def catch(self, body: Body, caught: NDArray[np.bool_]) -> None:
        """Put vertices `(k,)` onto the edge of their pad, which holds them."""
        plate, ring = body.plates[self.wall], body.cloud.rings[self.wall][caught]
        local = plate.local(body.points[ring])
        centre = self._centres[self.pad[caught]]
        offset = local[:, :2] - centre
        local[:, :2] = centre + (self.edges[self.pad[caught]] / np.linalg.norm(offset, axis=1))[:, None] * offset
        points = body.points.copy()  # others may remember where the body was
        points[ring] = plate.place(local)
        body.points = points
        self._change(body, np.where(caught, PINNED, self.state).astype(np.int8), self.pad)

    def _change(self, body: Body, state: NDArray[np.int8], pad: Indices) -> None:
        """Give the vertices other states and pads: nothing moves, and no energy changes."""
        if (state != self.state).any() or (pad != self.pad).any():
            before = self._level(body)
            self.state, self.pad = state, pad
            self.constant += before - self._level(body)

    def _behind(self, body: Body, offset: Floats) -> NDArray[np.bool_]:
        """Whether the pad is behind the line, where the liquid is, of vertices at offsets `(k, 2)` from its centre."""
        outward, _ = self.outward(body)
        return (offset * (outward @ body.plates[self.wall].frame.T)[:, :2]).sum(axis=1) > 0.0

    def _nearest(self, local: Floats) -> Indices:
        """The pad whose edge is nearest to each vertex, or that it is deepest inside of, `(k,)`."""
        distance = np.linalg.norm(local[:, None, :2] - self._centres, axis=2)
        return (distance - self.edges).argmin(axis=1).astype(np.int32)

    def _offset(self, local: Floats) -> tuple[Floats, Floats]:
        """Offset of each vertex from the centre of its pad `(k, 2)`, and its length `(k,)` [m]."""
        offset = local[:, :2] - self._centres[self.pad]
        return offset, np.linalg.norm(offset, axis=1)


def _sectors(local: Floats) -> Floats:
    """Areas of the triangles between the origin and each segment of a closed line, `(k,)` [m^2]; `local (k, 2)`."""
    x, y = local.T
    return 0.5 * (x * ahead(y) - y * ahead(x))


def _sectors_gradient(local: Floats, weight: Floats) -> Floats:
    """Gradient of the sum of `_sectors` times weights `(k,)`, `(k, 2)` [m]."""
    own, before = weight[:, None], behind(weight)[:, None]
    across = own * ahead(local) - before * behind(local)
    return 0.5 * np.column_stack((across[:, 1], -across[:, 0]))


def _turns(local: Floats) -> Floats:
    """Angles about the origin under which each segment of a closed line is seen, `(k,)` [rad]; `local (k, 2)`."""
    after = ahead(local)
    return np.arctan2(2.0 * _sectors(local), (local * after).sum(axis=1))


def _turns_gradient(local: Floats, weight: Floats) -> Floats:
    """Gradient of the sum of `_turns` times weights `(k,)`, `(k, 2)` [1/m]."""
    around = np.column_stack((-local[:, 1], local[:, 0])) / (local**2).sum(axis=1)[:, None]
    return (behind(weight) - weight)[:, None] * around


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
        self.state[:], self._mean_cosine = PINNED, 0.5 * float(np.cos(receding_angle) + np.cos(advancing_angle))

    @property
    def has_energy(self) -> bool:
        """None: what a line that stands and moves takes is friction."""
        return False

    @property
    def has_events(self) -> bool:
        """Always: vertices stand and go."""
        return True

    def cosine_area_gradient(self, body: Body) -> Floats:
        """Force over the surface tension: the angle that acts on each vertex times the gradient of the wetted area."""
        return self.cosine()[:, None] * self._area_gradient(body)

    def _level(self, body: Body) -> float:
        """The wetted area times the mean of both cosines, about which friction acts either way [m^2]."""
        points, _ = whole_points(body.cloud, body.points, self.wall)
        return self._mean_cosine * float(_sectors(body.plates[self.wall].local(points)[:, :2]).sum())

    def _area_gradient(self, body: Body) -> Floats:
        """Gradient of the wetted area by the vertices of the line, `(k, 3)` [m]."""
        ring, (points, index) = body.cloud.rings[self.wall], whole_points(body.cloud, body.points, self.wall)
        whole = ring_area_gradient(points, np.arange(len(index), dtype=np.int32))[: len(ring)]
        return share(body.cloud)[ring][:, None] * whole

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


class RubbingLine(HystereticLine):
    """A contact line with hysteresis in a flow with inertia, whose friction is part of the step.

    Coulomb's law at each vertex: the wall pulls with gamma cos(theta) a unit length, theta between both angles, as is
    needed to hold it; it moves only with the force of one of them, against its motion. Which vertices stand is found
    with the velocities of the step (`settle`), so that friction never gives energy.
    """

    @property
    def has_events(self) -> bool:
        """None before a step."""
        return False

    def friction(self, body: Body) -> Floats:
        """Force on the vertices that move, over the surface tension, beyond that of the energy, `(k, 3)` [m]."""
        beyond = np.where(self.state == PINNED, 0.0, self.cosine() - self._mean_cosine)
        return beyond[:, None] * self._area_gradient(body)

    def rubbed(self, body: Body, velocity: Floats) -> float:
        """Power that friction takes from velocities `(n, 3)` [m/s], over the surface tension [m^2/s]."""
        return -float((self.friction(body) * velocity[body.cloud.rings[self.wall]]).sum())

    def settle(self, body: Body, velocity: Floats, needed: Floats, releases: bool) -> bool:
        """Hold vertices that moved against their sense, let those go that the wall cannot hold.

        Args:
            body: where the forces of a step were taken.
            velocity: at its end, `(n, 3)` [m/s].
            needed: force over the surface tension that holds the vertices that stand, `(n, 3)` [m].
            releases: whether vertices are let go.

        Returns:
            Whether any vertex has changed: the step is to be solved again.
        """
        ring, across = body.cloud.rings[self.wall], self._area_gradient(body)
        speed, state, standing = (velocity[ring] * across).sum(axis=1), self.state.copy(), self.state == PINNED
        state[((state == ADVANCING) & (speed < 0.0)) | ((state == RECEDING) & (speed > 0.0))] = PINNED
        if releases:
            cosine = (needed[ring] * across).sum(axis=1) / (across**2).sum(axis=1)
            state[standing & (cosine > self._pad_cosine[0])] = RECEDING
            state[standing & (cosine < self._mask_cosine)] = ADVANCING
        changed = bool((state != self.state).any())
        self.state = state
        return changed
