"""Contact lines on walls with pads: pinning at the edges of pads (Gibbs' condition).

Each vertex is pinned at the edge of a pad, free on a pad, or free on the solder mask between pads. Contact
angles do not depend on the speed of the line.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import equal_area_radius
from reflowshock.particles.core.plate import Pad
from reflowshock.particles.core.surface_measure import ahead, behind
from reflowshock.particles.core.symmetry import share, unit, whole_points

PINNED, ON_PAD, ON_MASK = 0, 1, 2
# Difference of the cosine beyond which a pinned vertex is released.
RELEASE_MARGIN = 0.02
# Distance from an edge, in spacings, within which a vertex is near it.
CATCH_DISTANCE = 0.05
# Attributes in a checkpoint.
SAVED = ("edges", "pad", "state", "constant", "stopped")


class ContactLine:
    """A contact line on a wall of solder mask with one or several pads.

    A line at the edge of a pad is pinned while pad angle < contact angle < mask angle (Gibbs' condition). A vertex is
    released if the force on the pad pulls it inward or the force on the mask pulls it outward, and pinned again when it
    returns to the edge. A line that reaches a pad from outside advances onto it.

    Attributes:
        wall: Index of the contact line and of its plate.
        pads: Pads on the wall.
        edges: Distance of pinned vertices from the centre of each pad, shape (m,) [m].
        pad: Pad whose edge is nearest to each vertex, shape (k,).
        state: State of each vertex, PINNED, ON_PAD or ON_MASK, shape (k,).
        constant: Sum of the jumps of the formula of ``cosine_area`` at changes of state [m^2].
        stopped: Whether each vertex was pinned at the end of the last step and stays pinned in the next one, shape
            (k,).
    """

    def __init__(self, wall: int, pads: Sequence[Pad], mask_angle: float, local: Floats, corners: Floats) -> None:
        """Set the state of each vertex by its position at an edge, inside or outside a pad.

        Args:
            wall: Index of the contact line and of its plate.
            pads: Pads on the wall, at least one.
            mask_angle: Contact angle outside the pads [rad].
            local: Vertices in the frame of the plate, shape (k, 2) or (k, 3) [m].
            corners: Number of vertices of a line along the whole edge of each pad, whose polygon has the area of the
                pad, shape (m,).
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
        """Return pads and states of the vertices, for a checkpoint."""
        return {"pads": self.pads} | {name: getattr(self, name) for name in SAVED}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self._take_pads(saved["pads"])
        for name in SAVED:
            setattr(self, name, saved[name])

    def follow(self, before: Indices, after: Indices) -> None:
        """Transfer the states to a changed line.

        Args:
            before: Vertices of the line before the change.
            after: Vertex of the old line for each vertex of the new one, shape (k,).
        """
        number_of = {vertex: number for number, vertex in enumerate(before.tolist())}
        index = [number_of[vertex] for vertex in after.tolist()]
        self.pad, self.state, self.stopped = self.pad[index], self.state[index], self.stopped[index]

    @property
    def has_edge(self) -> bool:
        """Whether pads have an edge; a uniform wall has none."""
        return bool(np.isfinite(self.edges).all())

    @property
    def has_energy(self) -> bool:
        """Whether the force on the line is the gradient of an energy, ``cosine_area``."""
        return True

    @property
    def has_events(self) -> bool:
        """Whether vertices may change their states; on a uniform wall they do not."""
        return self.has_edge

    def wetted_pads(self) -> frozenset[int]:
        """Return the pads that the line is on or at whose edge it is pinned."""
        return frozenset(self.pad[self.state != ON_MASK].tolist())

    def cosine(self) -> Floats:
        """Return the cosine of the contact angle at each vertex, shape (k,); zero for pinned vertices."""
        free = np.where(self.state == ON_PAD, self._pad_cosine[self.pad], self._mask_cosine)
        return np.where(self.state == PINNED, 0.0, free)

    def cosine_area(self, body: Body) -> float:
        """Return the integral of cos(theta) over the wetted area [m^2], zero for a line along the edges of its pads.

        On a uniform wall it covers the whole wetted area. It does not change when a vertex is pinned or released, since
        nothing moves.
        """
        return (self._level(body) + self.constant) / body.cloud.parts

    def cosine_area_gradient(self, body: Body) -> Floats:
        """Return the gradient of ``cosine_area`` with respect to the vertices of the line, shape (k, 3) [m]."""
        ring, plate = body.cloud.rings[self.wall], body.plates[self.wall]
        points, index = whole_points(body.cloud, body.points, self.wall)
        local, pad = plate.local(points)[:, :2], self.pad[index]
        offset, weight = local - self._centres[pad], self._beyond_mask(index)
        level = self._mask_cosine * _sectors_gradient(local, np.ones(len(local))) + _sectors_gradient(offset, weight)
        if self.has_edge:  # angles about surrounded pads add up to whole turns
            level -= 0.5 * _turns_gradient(offset, self._square[pad] * weight)
        return (level @ plate.frame[:2])[: len(ring)] * share(body.cloud)[ring][:, None]

    def _level(self, body: Body) -> float:
        """Return the integral for the line around the whole body up to a constant [m^2].

        A segment next to a pinned vertex has the cosine of its free end. A segment between pinned vertices has none; if
        they are not evenly spaced, its area differs from the area at its part of the edge, so the formula jumps when
        one of them is released.
        """
        points, index = whole_points(body.cloud, body.points, self.wall)
        local, pad = body.plates[self.wall].local(points)[:, :2], self.pad[index]
        offset = local - self._centres[pad]
        area, beyond = sector_areas(local).sum(), sector_areas(offset)
        if self.has_edge:
            turns = np.array([_turns(local - centre).sum() for centre in self._centres])
            area -= 0.5 * self._square @ turns
            beyond -= 0.5 * self._square[pad] * _turns(offset)
        return float(self._mask_cosine * area + self._beyond_mask(index) @ beyond)

    def _beyond_mask(self, index: NDArray[np.int64]) -> Floats:
        """Return the mean cosine of the free ends of each segment minus the cosine on the mask, shape (k,).

        It is zero for a segment from one pad to another.
        """
        cosine, free = self.cosine()[index], (self.state[index] != PINNED).astype(float)
        mean = (cosine + ahead(cosine)) / np.maximum(1.0, free + ahead(free))
        pad = self.pad[index]
        return np.where(pad == ahead(pad), mean - self._mask_cosine, 0.0)

    def pinned(self, body: Body) -> Indices:
        """Return the pinned vertices."""
        return body.cloud.rings[self.wall][self.state == PINNED]

    def outward(self, body: Body) -> tuple[Floats, Floats]:
        """Return the unit outward normals of the line within the wall (k, 3) and the length of each vertex (k,) [m]."""
        points, ring = whole_points(body.cloud, body.points, self.wall)[0], body.cloud.rings[self.wall]
        before, after = behind(points), ahead(points)
        across = unit(np.cross(after - before, body.plates[self.wall].normal))[: len(ring)]
        step = np.linalg.norm(after - points, axis=1)
        return across, (0.5 * (step + behind(step)))[: len(ring)] * share(body.cloud)[ring]

    def contact_cosine(self, body: Body, load: Floats, coefficient: float) -> Floats:
        """Return the cosine of the contact angle at each vertex from the balance of forces, shape (k,).

        The free surface pulls with -gamma cos(theta) a unit length. The load includes the pressure on the vertex's
        share of the surface, so that the angle is measured at the wall, not in the first triangle. It is averaged over
        neighbours with the weights 1/4, 1/2, 1/4, since vertices with few and with many triangles alternate.

        Args:
            body: Liquid body.
            load: All forces except wall forces, including the pressure, shape (n, 3) [N].
            coefficient: Surface tension [N/m].
        """
        outward, length = self.outward(body)
        cosine = -(load[body.cloud.rings[self.wall]] * outward).sum(axis=1) / (coefficient * length)
        around = cosine[whole_points(body.cloud, body.points, self.wall)[1]]
        return (0.5 * around + 0.25 * (behind(around) + ahead(around)))[: len(cosine)]

    def update(self, body: Body, load: Floats, coefficient: float) -> None:
        """Release pinned vertices, pin vertices that crossed an edge, and move vertices that reached a pad onto it.

        Args:
            body: Liquid body.
            load: As for ``contact_cosine``.
            coefficient: Surface tension [N/m].
        """
        ring, plate = body.cloud.rings[self.wall], body.plates[self.wall]
        cosine, local = self.contact_cosine(body, load, coefficient), plate.local(body.points[ring])
        state, pad = self.state.copy(), np.where(self.state == ON_MASK, self._nearest(local), self.pad)
        self._change(body, state, pad)
        offset, radius = self._offset(local)
        edge, pad_cosine = self.edges[pad], self._pad_cosine[pad]
        # A pad behind the line is covered by liquid; onto a pad before it the line advances without being pinned.
        before = ~self._behind(body, offset)
        on_pad, on_mask, is_pinned = (state == kind for kind in (ON_PAD, ON_MASK, PINNED))
        is_pinned &= ~self.stopped
        self.stop_at_edges(body)
        state, self.stopped = self.state.copy(), np.zeros_like(self.stopped)
        state[on_mask & before & (radius < edge)] = ON_PAD
        state[on_pad & before & (radius > edge)] = ON_MASK
        state[is_pinned & (cosine > pad_cosine + RELEASE_MARGIN)] = ON_PAD
        state[is_pinned & (cosine < self._mask_cosine - RELEASE_MARGIN)] = ON_MASK
        self._change(body, state, pad)

    def near_edges(self, body: Body, load: Floats, coefficient: float) -> NDArray[np.bool_]:
        """Return whether each vertex is close to an edge that would pin it, shape (k,).

        Args:
            body: Liquid body.
            load: As for ``contact_cosine``.
            coefficient: Surface tension [N/m].
        """
        no_vertex = np.zeros(len(self.state), bool)
        if not self.has_edge:
            return no_vertex
        offset, radius = self._offset(body.plates[self.wall].local(body.points[body.cloud.rings[self.wall]]))
        near = (self.state != PINNED) & (np.abs(radius - self.edges[self.pad]) < CATCH_DISTANCE * body.cloud.spacing)
        if not near.any():
            return no_vertex
        cosine = self.contact_cosine(body, load, coefficient)
        # With the margin of the release, since a line at rest next to the edge has the angle of its side.
        low, high = self._mask_cosine + RELEASE_MARGIN, self._pad_cosine[self.pad] - RELEASE_MARGIN
        return near & (low < cosine) & (cosine < high) & self._behind(body, offset)

    def stop_at_edges(self, body: Body) -> None:
        """Move vertices that have crossed the edge of their pad back to it and pin them.

        Beyond the edge the angle that drove them does not act, so the energy gained there is spurious.
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
        """Move the selected vertices, shape (k,), onto the edge of their pad and pin them."""
        plate, ring = body.plates[self.wall], body.cloud.rings[self.wall][caught]
        local = plate.local(body.points[ring])
        centre = self._centres[self.pad[caught]]
        offset = local[:, :2] - centre
        local[:, :2] = centre + (self.edges[self.pad[caught]] / np.linalg.norm(offset, axis=1))[:, None] * offset
        points = body.points.copy()  # references to the old array stay valid
        points[ring] = plate.place(local)
        body.points = points
        self._change(body, np.where(caught, PINNED, self.state).astype(np.int8), self.pad)

    def _change(self, body: Body, state: NDArray[np.int8], pad: Indices) -> None:
        """Set states and pads of the vertices; positions and energy do not change."""
        if (state != self.state).any() or (pad != self.pad).any():
            before = self._level(body)
            self.state, self.pad = state, pad
            self.constant += before - self._level(body)

    def _behind(self, body: Body, offset: Floats) -> NDArray[np.bool_]:
        """Return whether the pad is behind the line, on the side of the liquid, shape (k,).

        ``offset``: Offsets of the vertices from the centres of their pads, shape (k, 2) [m].
        """
        outward, _ = self.outward(body)
        return (offset * (outward @ body.plates[self.wall].frame.T)[:, :2]).sum(axis=1) > 0.0

    def _nearest(self, local: Floats) -> Indices:
        """Return the pad whose edge is nearest to each vertex, or inside which it is deepest, shape (k,)."""
        distance = np.linalg.norm(local[:, None, :2] - self._centres, axis=2)
        return (distance - self.edges).argmin(axis=1).astype(np.int32)

    def _offset(self, local: Floats) -> tuple[Floats, Floats]:
        """Return the offset of each vertex from the centre of its pad (k, 2) and its length (k,) [m]."""
        offset = local[:, :2] - self._centres[self.pad]
        return offset, np.linalg.norm(offset, axis=1)


def sector_areas(local: Floats) -> Floats:
    """Return the signed areas of the triangles of the origin and each segment of a closed line, shape (k,) [m^2].

    Args:
        local: Vertices of the line in its plane, in order, shape (k, 2) [m]; positive areas are counter-clockwise.
    """
    x, y = local.T
    return 0.5 * (x * ahead(y) - y * ahead(x))


def _sectors_gradient(local: Floats, weight: Floats) -> Floats:
    """Return the gradient of the weighted sum of ``_sectors``, with weights (k,), shape (k, 2) [m]."""
    following, previous = weight[:, None], behind(weight)[:, None]
    across = following * ahead(local) - previous * behind(local)
    return 0.5 * np.column_stack((across[:, 1], -across[:, 0]))


def _turns(local: Floats) -> Floats:
    """Return the angle that each segment of a closed line (k, 2) subtends at the origin, shape (k,) [rad]."""
    after = ahead(local)
    return np.arctan2(2.0 * sector_areas(local), (local * after).sum(axis=1))


def _turns_gradient(local: Floats, weight: Floats) -> Floats:
    """Return the gradient of the weighted sum of ``_turns``, with weights (k,), shape (k, 2) [1/m]."""
    around = np.column_stack((-local[:, 1], local[:, 0])) / (local**2).sum(axis=1)[:, None]
    return (behind(weight) - weight)[:, None] * around
