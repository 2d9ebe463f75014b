"""Insertion and removal of particles: on the surface by edge length, below it by distance.

An event before a step. Surface edges longer than 1.6 spacings are split, those shorter than 0.4 collapse. Below the
surface a particle is inserted midway between two that are more than 1.5 spacings apart with nothing in between, and
one of two nearer than 0.2 is removed. Position, velocity and pressure of a new particle are the mean of two old ones.

The surface keeps its volume and centre: where a collapse changes them, vertices move along the normals. The next step
restores the momenta with the new masses. The change of energy is a remeshing loss.
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

# In spacings. Halves of a split edge are far from collapsing, and diagonals of a cube's faces, 1.41, are not split.
LONGEST_EDGE, SHORTEST_EDGE = 1.6, 0.4
GAP, NEAREST = 1.5, 0.2
# Radius of an empty ball that counts as a gap; the centre of a cubic lattice cell is only 0.87 from the corners.
EMPTY = 0.95
# Largest distance of the particles on either side of a gap, over twice ``EMPTY``.
WIDEST_GAP = 1.2
# Particle shifting would push back particles nearer to the surface than this.
DEPTH = 0.6
MOMENT_PASSES, ROUNDING = 16, 1e-15


@dataclass(frozen=True, slots=True)
class Change:
    """Replacement of old particles by new ones.

    Attributes:
        first: First old particle whose mean with the second each new particle is, shape (n,).
        second: Second old particle, equal to the first for particles that stay, shape (n,).
        surface_count: Number of new particles that are vertices of the surface.
        triangles: Triangles of the new surface, shape (t, 3).
        rings: Contact lines.
    """

    first: Indices
    second: Indices
    surface_count: int
    triangles: Indices
    rings: tuple[Indices, ...]

    def mean(self, field: Floats) -> Floats:
        """Return a field of the old particles, shape (m, ...), at the new ones, shape (n, ...)."""
        return 0.5 * (field[self.first] + field[self.second])


@dataclass(frozen=True, slots=True)
class Adaptation:
    """Event that inserts and removes particles before a step.

    Attributes:
        solver: Step solver whose state follows the change.
        physics: Effects that act on the body.
    """

    solver: IspgStep
    physics: Physics

    def update(self, body: Body) -> None:
        """Insert and remove particles that are too far apart or too close."""
        if self.solver.state is None:
            return
        on_rings = not any(line.has_edge for line in self.physics.lines)
        for remesh in (_split_edges, _collapse_edges):
            surface = remesh(body, on_rings)
            if surface is not None:
                self._apply(body, _with_inner(body, surface))
        inner = _inner_change(body)
        if inner is not None:
            self._apply(body, inner)

    def attempt(self, _body: Body) -> bool:
        """Return False: the event tries nothing that a step may reject."""
        return False

    def _apply(self, body: Body, change: Change) -> None:
        state = self.solver.state
        if state is None:
            raise ValueError("particles can be inserted or removed after the first step only")
        volume, first, _ = body_moments(body)
        before = self.physics.energy(body)
        for line in self.physics.lines:
            line.follow(body.cloud.rings[line.wall], change.first[change.rings[line.wall]])
        changed = not np.array_equal(change.triangles, body.triangles)
        _apply_to_body(body, change)
        if changed:
            restore_moments(body, self.physics, volume, first)
        after = self.physics.energy(body)
        losses = replace(state.losses, rebuilding=state.losses.rebuilding + before - after)
        state = replace(_applied_to_state(state, change), potential=state.potential + after - before, losses=losses)
        self.solver.state = state


def restore_moments(body: Body, physics: Physics, volume: float, first: Floats) -> None:
    """Move a surface so that it encloses a given volume with a given first moment, as walls and pad edges admit.

    Vertices move along their normals by amounts that are linear in space.

    Args:
        body: Liquid body; its points are moved in place.
        physics: Effects that act on the body; its contact lines and walls restrict the motion.
        volume: Volume to enclose [m^3].
        first: Integral of the position x over the body to reach, shape (3,) [m^4].
    """
    length = np.cbrt(volume)
    for _ in range(MOMENT_PASSES):
        enclosed, moments, _ = body_moments(body)
        centre = first / volume
        missing = np.append(volume - enclosed, (first - moments - (volume - enclosed) * centre) / length)
        if np.abs(missing).max() <= ROUNDING * volume:
            return
        slope = body.volume()[1]
        normal = physics.admit(body, slope)
        powers = np.column_stack((np.ones(len(slope)), (body.points - centre) / length))
        flux = (slope * normal).sum(axis=1)
        matrix = (powers * flux[:, None]).T @ powers
        amount = np.linalg.lstsq(matrix, missing, rcond=1e-9)[0]
        body.points = body.points + (powers @ amount)[:, None] * normal


def _split_edges(body: Body, on_rings: bool) -> NewSurface | None:
    longest = LONGEST_EDGE * body.cloud.spacing
    if extreme_edges(body.points, body.triangles)[1] <= longest:
        return None
    return _if_changed(body, split_long(*_surface(body), longest, on_rings))


def _collapse_edges(body: Body, on_rings: bool) -> NewSurface | None:
    shortest = SHORTEST_EDGE * body.cloud.spacing
    if extreme_edges(body.points, body.triangles)[0] >= shortest:
        return None
    return _if_changed(body, collapse_short(*_surface(body), shortest, on_rings))


def _surface(body: Body) -> tuple[Floats, Indices, Sequence[Indices]]:
    return body.points[: body.cloud.surface_count], body.triangles, body.cloud.rings


def _if_changed(body: Body, surface: NewSurface) -> NewSurface | None:
    vertices = np.arange(body.cloud.surface_count)
    is_same = np.array_equal(surface.first, vertices) and np.array_equal(surface.second, vertices)
    return None if is_same else surface


def _with_inner(body: Body, surface: NewSurface) -> Change:
    """Return the change to a new surface with the old particles below it."""
    inner = body.interior
    first, second = np.concatenate((surface.first, inner)), np.concatenate((surface.second, inner))
    return Change(first, second, len(surface.first), surface.triangles, surface.rings)


def _inner_change(body: Body) -> Change | None:
    """Return the insertions and removals below the surface, or None without any."""
    offsets, indices = find_neighbours(body.points, 2.0 * EMPTY * WIDEST_GAP * body.cloud.spacing)
    removed, pairs = _too_close(body, offsets, indices), _gaps(body, offsets, indices)
    if not len(removed) and not len(pairs):
        return None
    remaining = np.setdiff1d(np.arange(len(body.points), dtype=np.int32), removed)
    first, second = np.concatenate((remaining, pairs[:, 0])), np.concatenate((remaining, pairs[:, 1]))
    return Change(first, second, body.cloud.surface_count, body.triangles, body.cloud.rings)


def _too_close(body: Body, offsets: Indices, indices: Indices) -> Indices:
    """Return the particles below the surface to remove: one of two that are too close."""
    crowded = _crowded(body.points, offsets, indices, NEAREST * body.cloud.spacing)
    return crowded[crowded >= body.cloud.surface_count]


@njit(cache=True)
def _crowded(points, offsets, indices, nearest):
    """Return the larger index of each pair of particles closer than ``nearest``, shape (m,), ascending."""
    crowded, count = np.empty(points.shape[0], np.int32), 0
    for i in range(points.shape[0]):
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            if j < i and _square(points, j, points[i, 0], points[i, 1], points[i, 2]) <= nearest**2:
                crowded[count] = i
                count += 1
                break
    return crowded[:count]


def _gaps(body: Body, offsets: Indices, indices: Indices) -> Indices:
    """Return pairs of particles with room for another one in the middle, shape (m, 2)."""
    spacing, points = body.cloud.spacing, body.points
    pairs, room = _open_pairs(points, offsets, indices, GAP * spacing, EMPTY * spacing)
    if not len(pairs):
        return pairs
    middle = 0.5 * (points[pairs[:, 0]] + points[pairs[:, 1]])
    inside = _depth(body, middle) > DEPTH * spacing
    wall = body.cloud.wall[pairs]
    inside &= (wall[:, 0] == wall[:, 1]) | (_height(body, middle) > DEPTH * spacing)
    chosen: list[int] = []
    for candidate in np.argsort(-room, kind="stable"):
        distances = [np.linalg.norm(middle[candidate] - middle[other]) for other in chosen]
        if inside[candidate] and min(distances, default=np.inf) > EMPTY * spacing:
            chosen.append(int(candidate))
    return pairs[chosen].reshape(-1, 2)


@njit(cache=True)
def _open_pairs(points, offsets, indices, gap, empty):
    """Return pairs more than ``gap`` apart with no particle within ``empty`` of their middle, and their distances."""
    pairs, apart, count = np.empty((indices.shape[0] // 2 + 1, 2), np.int32), np.empty(indices.shape[0] // 2 + 1), 0
    least, limit = max(gap, 2.0 * empty) ** 2, empty**2
    for i in range(points.shape[0]):
        last = i  # the particle in the middle of the last pair is likely to be in this one, too
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
    """Return the squared distance of point j from (x, y, z)."""
    dx, dy, dz = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
    return dx * dx + dy * dy + dz * dz


def _depth(body: Body, points: Floats) -> Floats:
    """Return the depth of points of shape (m, 3) below the tangent plane of the nearest vertex, shape (m,) [m]."""
    surface, slope = body.points[: body.cloud.surface_count], body.volume()[1][: body.cloud.surface_count]
    nearest = cKDTree(surface).query(points)[1]
    normal = slope[nearest] / np.linalg.norm(slope[nearest], axis=1)[:, None]
    return ((surface[nearest] - points) * normal).sum(axis=1)


def _height(body: Body, points: Floats) -> Floats:
    """Return the distance of points of shape (m, 3) from the nearest wall, shape (m,) [m]."""
    heights = [-plate.side * plate.local(points)[:, 2] for plate in body.plates]
    return np.min([np.full(len(points), np.inf), *heights], axis=0)


def _apply_to_body(body: Body, change: Change) -> None:
    """Replace the particles of a body in place."""
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


def _applied_to_state(state: GalerkinState, change: Change) -> GalerkinState:
    """Return the state of the last step at the new particles."""
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
