"""Particles that come and go with the room: on the surface by its edges, below it by distance.

An event before a step. Edges of the surface longer than 1.6 spacings are split, those shorter than 0.4 collapse. Below
the surface a particle is put midway between two that are more than 1.5 spacings apart with nothing in between, and one
of two nearer than 0.2 goes. Each new particle is the mean of two old ones, in place, velocity and pressure.

The surface keeps its volume and centre: vertices move along it where a collapse has changed them. Momenta are kept by
the step, which gives particles new masses and makes up for what is missing. What this takes of the energy is counted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.neighbours import find_neighbours
from reflowshock.particles.ispg.ispg_step import IspgStep
from reflowshock.particles.ispg.nodal_volumes import body_moments
from reflowshock.particles.ispg.state import GalerkinState
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.surface.edge_changes import NewSurface, collapse_short, extreme_edges, split_long

# The halves of a split edge are far from collapsing. The diagonals of a cube's faces, 1.41, are left.
LONGEST_EDGE, SHORTEST_EDGE = 1.6, 0.4
GAP, NEAREST = 1.5, 0.2
# In a cubic lattice the middle of a cell is 0.87 spacings from the corners, which are 1.7 apart: no gap.
EMPTY = 0.95
# Of twice that, how far apart the particles beside a gap are at most.
WIDEST_GAP = 1.2
# What is nearer to the surface than this would be pushed back at once.
DEPTH = 0.6
MOMENT_PASSES, ROUNDING = 16, 1e-15


@dataclass(frozen=True, slots=True)
class Change:
    """New particles made of old ones.

    Attributes:
        first, second: `(n,)` old particles whose mean each one is.
        surface_count: how many of them are vertices of the surface.
        triangles: `(t, 3)` of the surface.
        rings: contact lines.
    """

    first: Indices
    second: Indices
    surface_count: int
    triangles: Indices
    rings: tuple[Indices, ...]

    def mean(self, field: Floats) -> Floats:
        """A field `(n, ...)` of the old particles at the new ones."""
        return 0.5 * (field[self.first] + field[self.second])


@dataclass(frozen=True, slots=True)
class Adaptation:
    """The event.

    Attributes:
        solver: whose memory of the last step follows.
        physics: what acts on the body.
    """

    solver: IspgStep
    physics: Physics

    def update(self, body: Body) -> None:
        """Change the particles where they are too far apart or too near."""
        if self.solver.state is None:
            return
        on_rings = not any(line.has_edge for line in self.physics.lines)
        for find in (_longer, _shorter):
            surface = find(body, on_rings)
            if surface is not None:
                self._apply(body, _with_inner(body, surface))
        inner = _inner_change(body)
        if inner is not None:
            self._apply(body, inner)

    def attempt(self, _body: Body) -> bool:
        """Nothing."""
        return False

    def _apply(self, body: Body, change: Change) -> None:
        state = self.solver.state
        if state is None:
            raise ValueError("only a body that has moved changes its particles")
        volume, first, _ = body_moments(body)
        before = self.physics.energy(body)
        for line in self.physics.lines:
            line.follow(body.cloud.rings[line.wall], change.first[change.rings[line.wall]])
        changed = not np.array_equal(change.triangles, body.triangles)
        _take(body, change)
        if changed:
            restore_moments(body, self.physics, volume, first)
        after = self.physics.energy(body)
        losses = replace(state.losses, rebuilding=state.losses.rebuilding + before - after)
        state = replace(_taken(state, change), potential=state.potential + after - before, losses=losses)
        self.solver.state = state


def restore_moments(body: Body, physics: Physics, volume: float, first: Floats) -> None:
    """Move a surface, as walls and edges admit, to a volume [m^3] and its integral of x `(3,)` [m^4].

    Along its normal, by amounts that are linear in space: the least motions that change one of the four.
    """
    length = np.cbrt(volume)
    for _ in range(MOMENT_PASSES):
        found, moments, _ = body_moments(body)
        centre = first / volume
        missing = np.append(volume - found, (first - moments - (volume - found) * centre) / length)
        if np.abs(missing).max() <= ROUNDING * volume:
            return
        slope = body.volume()[1]
        normal = physics.admit(body, slope)
        powers = np.column_stack((np.ones(len(slope)), (body.points - centre) / length))
        flux = (slope * normal).sum(axis=1)
        matrix = (powers * flux[:, None]).T @ powers
        amount = np.linalg.lstsq(matrix, missing, rcond=1e-9)[0]
        body.points = body.points + (powers @ amount)[:, None] * normal


def _longer(body: Body, on_rings: bool) -> NewSurface | None:
    longest = LONGEST_EDGE * body.cloud.spacing
    if extreme_edges(body.points, body.triangles)[1] <= longest:
        return None
    return _if_changed(body, split_long(*_surface(body), longest, on_rings))


def _shorter(body: Body, on_rings: bool) -> NewSurface | None:
    shortest = SHORTEST_EDGE * body.cloud.spacing
    if extreme_edges(body.points, body.triangles)[0] >= shortest:
        return None
    return _if_changed(body, collapse_short(*_surface(body), shortest, on_rings))


def _surface(body: Body) -> tuple[Floats, Indices, Sequence[Indices]]:
    return body.points[: body.cloud.surface_count], body.triangles, body.cloud.rings


def _if_changed(body: Body, surface: NewSurface) -> NewSurface | None:
    kept = np.arange(body.cloud.surface_count)
    return None if np.array_equal(surface.first, kept) and np.array_equal(surface.second, kept) else surface


def _with_inner(body: Body, surface: NewSurface) -> Change:
    """A new surface around the old particles below it."""
    inner = body.interior
    first, second = np.concatenate((surface.first, inner)), np.concatenate((surface.second, inner))
    return Change(first, second, len(surface.first), surface.triangles, surface.rings)


def _inner_change(body: Body) -> Change | None:
    """What comes and goes below the surface, None where nothing does."""
    lists = find_neighbours(body.points, 2.0 * EMPTY * WIDEST_GAP * body.cloud.spacing)
    gone, pairs = _too_near(body, lists), _gaps(body, lists)
    if not len(gone) and not len(pairs):
        return None
    kept = np.setdiff1d(np.arange(len(body.points), dtype=np.int32), gone)
    first, second = np.concatenate((kept, pairs[:, 0])), np.concatenate((kept, pairs[:, 1]))
    return Change(first, second, body.cloud.surface_count, body.triangles, body.cloud.rings)


def _too_near(body: Body, lists: tuple[Indices, Indices]) -> Indices:
    """Particles below the surface to leave out: one of two that are too near."""
    crowded = _crowded(body.points, *lists, NEAREST * body.cloud.spacing)
    return crowded[crowded >= body.cloud.surface_count]


@njit(cache=True)
def _crowded(points, offsets, indices, nearest):
    """The later ones of pairs not farther apart than the nearest may be, `(m,)`, ascending."""
    crowded, count = np.empty(points.shape[0], np.int32), 0
    for i in range(points.shape[0]):
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            if j < i and _square(points, j, points[i, 0], points[i, 1], points[i, 2]) <= nearest**2:
                crowded[count] = i
                count += 1
                break
    return crowded[:count]


def _gaps(body: Body, lists: tuple[Indices, Indices]) -> Indices:
    """Pairs of particles `(m, 2)` in the middle of which there is room for another one."""
    spacing, points = body.cloud.spacing, body.points
    pairs, room = _open_pairs(points, *lists, GAP * spacing, EMPTY * spacing)
    if not len(pairs):
        return pairs
    middle = 0.5 * (points[pairs[:, 0]] + points[pairs[:, 1]])
    inside = _depth(body, middle) > DEPTH * spacing
    wall = body.cloud.wall[pairs]
    inside &= (wall[:, 0] == wall[:, 1]) | (_height(body, middle) > DEPTH * spacing)
    chosen: list[int] = []
    for candidate in np.argsort(-room, kind="stable"):
        near = [np.linalg.norm(middle[candidate] - middle[one]) for one in chosen]
        if inside[candidate] and min(near, default=np.inf) > EMPTY * spacing:
            chosen.append(int(candidate))
    return pairs[chosen].reshape(-1, 2)


@njit(cache=True)
def _open_pairs(points, offsets, indices, gap, empty):
    """Pairs `(m, 2)` more than a gap apart with no particle nearer to their middle than `empty`, and how far apart."""
    pairs, apart, count = np.empty((indices.shape[0] // 2 + 1, 2), np.int32), np.empty(indices.shape[0] // 2 + 1), 0
    least, limit = max(gap, 2.0 * empty) ** 2, empty**2
    for i in range(points.shape[0]):
        last = i  # what was in the middle of the pair before is likely to be in that of this one, too
        for a in range(offsets[i], offsets[i + 1]):
            j = indices[a]
            if j < i:
                continue
            square = _square(points, j, points[i, 0], points[i, 1], points[i, 2])
            if square <= least:
                continue
            x, y, z = points[i, 0] + points[j, 0], points[i, 1] + points[j, 1], points[i, 2] + points[j, 2]
            if _square(points, last, 0.5 * x, 0.5 * y, 0.5 * z) < limit:
                continue
            is_open = True
            for b in range(offsets[i], offsets[i + 1]):
                if _square(points, indices[b], 0.5 * x, 0.5 * y, 0.5 * z) < limit:
                    is_open, last = False, indices[b]
                    break
            if is_open:
                pairs[count, 0], pairs[count, 1] = i, j
                apart[count] = np.sqrt(square)
                count += 1
    return pairs[:count], apart[:count]


@njit(cache=True)
def _square(points, j, x, y, z):
    """Square of the distance of a point from a place."""
    dx, dy, dz = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
    return dx * dx + dy * dy + dz * dz


def _depth(body: Body, points: Floats) -> Floats:
    """Depth of points `(m, 3)` below the tangent plane of the nearest vertex of the surface [m]."""
    surface, slope = body.points[: body.cloud.surface_count], body.volume()[1][: body.cloud.surface_count]
    nearest = cKDTree(surface).query(points)[1]
    normal = slope[nearest] / np.linalg.norm(slope[nearest], axis=1)[:, None]
    return ((surface[nearest] - points) * normal).sum(axis=1)


def _height(body: Body, points: Floats) -> Floats:
    """Distance of points `(m, 3)` from the nearest wall [m]."""
    heights = [-plate.side * plate.local(points)[:, 2] for plate in body.plates]
    return np.min([np.full(len(points), np.inf), *heights], axis=0)


def _take(body: Body, change: Change) -> None:
    """Give a body its new particles."""
    wall: NDArray[np.int8] = body.cloud.wall
    walls = np.where(wall[change.first] == wall[change.second], wall[change.first], -1).astype(np.int8)
    body.points = change.mean(body.points)
    body.velocity, body.pressure = change.mean(body.velocity), change.mean(body.pressure)
    body.triangles, body.volumes = change.triangles, change.mean(body.volumes)
    body.cloud = replace(
        body.cloud,
        points=body.points.copy(),
        surface_count=change.surface_count,
        triangles=change.triangles,
        rings=change.rings,
        wall=walls,
    )


def _taken(state: GalerkinState, change: Change) -> GalerkinState:
    """What the last step left, at the new particles."""
    last = state.history
    displacement, change_of_velocity = change.mean(last.displacement), change.mean(last.velocity_change)
    return replace(
        state,
        points=change.mean(state.points),
        velocity=change.mean(state.velocity),
        gradient=change.mean(state.gradient),
        pressure=change.mean(state.pressure),
        acceleration=change.mean(state.acceleration),
        volumes=change.mean(state.volumes),
        history=replace(last, displacement=displacement, velocity_change=change_of_velocity),
    )
