"""Coupling between the vertices of a liquid's surface and the particles near them.

A vertex moves with the mean velocity of the particles within the support of the kernel W, weighted by W; its force is
distributed to the same particles by the same weights. So the particles receive exactly the work of the forces,
and momentum is conserved. Above a wall in z = 0 mirror images of the particles count, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf, sqrt

import numpy as np
from numba import njit, prange
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.neighbours import find_near, have_moved
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.smoothing import SUPPORT, shape
from reflowshock.particles.surface.surface_mesh import SurfaceMesh

# Skin of the neighbour lists of vertices, in particle spacings.
SKIN = 0.5
# In particle spacings: least and largest distance of the surface beyond its particles (they may be a bit outside), its
# radius of curvature about a particle that it follows, and the distance outside a vertex from which on a particle
# belongs to other liquid.
COVER, CREST, OWN = (-0.25, 2.0), 1.5, 0.75


@dataclass(slots=True)
class SurfaceCoupling:
    """Particles near each vertex of a surface, with the weights by which they carry it.

    Attributes:
        law: Parameters of the pair interactions.
        built_at: Vertices and particles for which neighbours were found, shape (3, m + n) [m].
        lists: Offsets (m + 1,) and indices of the particles near each vertex, in compressed rows.
        shares: Weights of the particles of each vertex, whose sum is one, along and across the wall, shape (2, pairs).
    """

    law: Law
    built_at: Floats = field(default_factory=lambda: np.empty((3, 0)))
    lists: tuple[Indices, Indices] = field(default_factory=lambda: (np.zeros(1, np.int32), np.empty(0, np.int32)))
    shares: Floats = field(default_factory=lambda: np.empty((2, 0)))
    _revision: int = -1

    def restore(self, mesh: SurfaceMesh, built_at: Floats, shares: Floats) -> None:
        """Continue from saved positions and weights."""
        self.built_at, self.shares = built_at, shares
        if len(mesh.points):
            self._build(mesh, built_at)

    def update(self, mesh: SurfaceMesh, particles: Sequence[Floats]) -> None:
        """Find neighbours again if vertices or particles have moved by the skin, or vertices were renumbered.

        Args:
            mesh: The surface.
            particles: Positions of the particles that carry it, as rows x, y, z, shape (3, n) [m].
        """
        positions = np.concatenate((mesh.points.T, particles), axis=1)
        is_new = mesh.revision != self._revision or positions.shape != self.built_at.shape
        if is_new or have_moved(positions, self.built_at, SKIN * self.law.spacing):
            self._build(mesh, positions)

    def _build(self, mesh: SurfaceMesh, positions: Floats) -> None:
        self.built_at, self._revision, vertices = positions, mesh.revision, len(mesh.points)
        reach, points = SUPPORT * self.law.length + SKIN * self.law.spacing, np.ascontiguousarray(positions.T)
        self.lists = find_near_vertices(points[:vertices], points[vertices:], reach)

    def weights(self, points: Floats, fields: Fields) -> tuple[Floats, Floats]:
        """Compute the kernel between points, one for each vertex, and the particles near the vertices.

        Returns:
            Weights and their sums at the points, as ``find_weights`` writes and returns them.
        """
        weights = np.empty((2, 2, len(self.lists[1])))
        return weights, find_weights(points, self.lists, fields, self.law, weights)

    def carry(self, mesh: SurfaceMesh, velocity: Floats, time_step: float) -> None:
        """Move the vertices with the particles' velocities (3, n) [m/s] over a time step [s]."""
        if mesh.revision == self._revision:
            carry(self.lists, self.shares, velocity, time_step, mesh.points)

    def velocities(self, fields: Fields) -> Floats:
        """Return the velocities with which particles carry the vertices, shape (m, 3) [m/s]."""
        result = np.zeros((len(self.lists[0]) - 1, 3))
        carry(self.lists, self.shares, np.array((fields.u, fields.v, fields.w)), 1.0, result)
        return result

    def distances_to_cover(self, points: Floats, normals: Floats, fields: Fields) -> Floats:
        """Return how far vertices have to move outward to lie just beyond their particles, shape (m,) [m].

        Args:
            points: Vertices, shape (m, 3) [m].
            normals: Outward unit normals, shape (m, 3).
            fields: Fields of the particles.
        """
        spacing = self.law.spacing
        cover = COVER[0] * spacing, COVER[1] * spacing, 0.5 / (CREST * spacing), OWN * spacing
        distances = np.empty(len(points))
        find_distances_to_cover((points, normals), self.lists, fields, cover, distances)
        return distances


def find_near_vertices(vertices: Floats, particles: Floats, reach: float) -> tuple[Indices, Indices]:
    """Find the particles near each vertex, or the nearest one if none is within the kernel support.

    Args:
        vertices: Vertices, shape (m, 3) [m].
        particles: Particles, shape (n, 3) [m].
        reach: Search radius [m].

    Returns:
        Compressed rows: offsets, shape (m + 1,), and particle numbers, shape (pairs,); no row is empty.
    """
    offsets, indices = find_near(vertices, particles, reach)
    is_alone = np.diff(offsets) == 0
    if is_alone.any():
        nearest = cKDTree(particles).query(vertices[is_alone])[1]
        indices = np.insert(indices, offsets[:-1][is_alone], nearest.astype(indices.dtype))
        offsets = offsets + np.concatenate(([0], np.cumsum(is_alone))).astype(offsets.dtype)
    return offsets, indices


@njit(cache=True, parallel=True, error_model="numpy")
def find_weights(points, lists, fields, law, weights):
    """Compute the kernel W between each vertex and the particles near it.

    Args:
        points: Vertices of the surface, shape (m, 3) [m].
        lists: Particles near each vertex in compressed rows: offsets, shape (m + 1,), and indices, shape (pairs,).
        fields: ``Fields``: arrays of position, velocity, density, pressure and mass of all particles, liquid first.
        law: ``Law``: constants of the particles, such as kernel, smoothing length, density and speed of sound.
        weights: Output, changed in place, shape (2, 2, pairs). ``weights[1]`` is W [1/m^3], mirror images added (``[1,
            0]``, for components along the wall z = 0) or subtracted (``[1, 1]``, across it); ``weights[0]`` is the same
            over the sum of W at the vertex. Without a particle within the support the nearest one has the whole weight.

    Returns:
        Sum of W at each vertex, shape (m,) [1/m^3].
    """
    offsets, indices = lists
    inverse, levels = 1.0 / law.length, np.empty(points.shape[0])
    for v in prange(points.shape[0]):
        level, nearest, least = 0.0, -1, inf
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            dx, dy, dz = points[v, 0] - fields.x[j], points[v, 1] - fields.y[j], points[v, 2] - fields.z[j]
            distance = sqrt(dx * dx + dy * dy + dz * dz)
            if distance < least:
                nearest, least = k, distance
            direct, image = shape(law.kernel, False, distance * inverse), 0.0
            if law.mirror:
                dz = points[v, 2] + fields.z[j]
                image = shape(law.kernel, False, sqrt(dx * dx + dy * dy + dz * dz) * inverse)
            weights[1, 0, k], weights[1, 1, k] = law.norm * (direct + image), law.norm * (direct - image)
            level += weights[1, 0, k]
        levels[v] = level
        for k in range(offsets[v], offsets[v + 1]):
            if level > 0.0:
                weights[0, 0, k], weights[0, 1, k] = weights[1, 0, k] / level, weights[1, 1, k] / level
            else:
                weights[0, 0, k] = weights[0, 1, k] = 1.0 if k == nearest else 0.0
    return levels


@njit(cache=True, parallel=True)
def carry(lists, shares, velocity, time_step, points):
    """Move vertices with the particles near them.

    Args:
        lists: Offsets, shape (m + 1,), and indices of the particles near each vertex, shape (pairs,).
        shares: Weights of the particles for the motion along and across the wall z = 0, shape (2, pairs); they sum to
            at most one at each vertex.
        velocity: Velocities of the particles, shape (3, n) [m/s].
        time_step: Time step, scalar [s].
        points: Vertices, shape (m, 3) [m]; moved in place.
    """
    offsets, indices = lists
    for v in prange(points.shape[0]):
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            points[v, 0] += time_step * shares[0, k] * velocity[0, j]
            points[v, 1] += time_step * shares[0, k] * velocity[1, j]
            points[v, 2] += time_step * shares[1, k] * velocity[2, j]


@njit(cache=True, parallel=True)
def distribute(lists, weights, vectors, result):
    """Distribute vectors at the vertices to the particles.

    Args:
        lists: Particles near each vertex in compressed rows: offsets, shape (m + 1,), and indices, shape (pairs,).
        weights: Weights of each kind of vector, for its components along (x, y) and across (z) the wall, shape (k, 2,
            pairs).
        vectors: Kinds of vectors at the vertices, such as forces, shape (k, m, 3). One thread sums each kind, in one
            order.
        result: Sums at the particles in the unit of the vectors, shape (k, 3, n); the vectors are added to it in place.
    """
    offsets, indices = lists
    for kind in prange(vectors.shape[0]):
        weight, vector, total = weights[kind], vectors[kind], result[kind]
        for v in range(vector.shape[0]):
            for k in range(offsets[v], offsets[v + 1]):
                j = indices[k]
                total[0, j] += weight[0, k] * vector[v, 0]
                total[1, j] += weight[0, k] * vector[v, 1]
                total[2, j] += weight[1, k] * vector[v, 2]


@njit(cache=True, parallel=True)
def find_distances_to_cover(vertices, lists, fields, cover, distances):
    """Compute how far vertices have to move along their normals to lie just beyond the particles near them.

    Args:
        vertices: Points, shape (m, 3) [m], and outward unit normals, shape (m, 3); a tuple.
        lists: Particles near each vertex in compressed rows: offsets, shape (m + 1,), and indices, shape (pairs,).
        fields: ``Fields``: arrays of position, velocity, density, pressure and mass of all particles, liquid first.
        cover: Tuple of four scalars: least and largest distance of the surface beyond a particle [m]; half the
            curvature of the surface about a particle [1/m]; distance outside a vertex from which on particles are left
            out [m].
        distances: Output, shape (m,) [m], positive outwards; overwritten.
    """
    (points, normals), (offsets, indices), (least, most, bend, before) = vertices, lists, cover
    for v in prange(points.shape[0]):
        top = -inf
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            dx, dy, dz = fields.x[j] - points[v, 0], fields.y[j] - points[v, 1], fields.z[j] - points[v, 2]
            along = dx * normals[v, 0] + dy * normals[v, 1] + dz * normals[v, 2]
            aside2 = dx * dx + dy * dy + dz * dz - along * along
            if along < before:
                top = max(top, along - bend * aside2)
        distances[v] = max(top + least, min(top + most, 0.0), -most) if top > -inf else 0.0
