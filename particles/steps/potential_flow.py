"""Potential flow v = grad phi through the particles of a body, driven by the flux through its boundary.

The discrete Laplacian is a graph Laplacian: the edge between two particles conducts w_ij (phi_j - phi_i), so that flow
out of one particle is flow into another, and the fluxes sum to that through the boundary. With
w = 3 (s_i + s_j) W and s = V / sum of W r^2, the sum over j is V times the Laplacian of phi (Cummins and Rudman 1999).
At an impermeable plate each particle has a mirror image: phi is even there, and gradients near the plate are not
extrapolated from one side.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.neighbours import NeighbourList

# Relative leak of each particle, which fixes the constant, also that of disconnected particles.
LEAK = 1e-6
# Regularises the normal equations of particles without edges or with edges in a plane.
RIDGE = 1e-9
TINY = 1e-100


@njit(cache=True)
def _weight(square, support):
    """Return the weight (1 - q^2)^3 of an edge, zero from the support radius on."""
    q = square / (support * support)
    return (1.0 - q) ** 3 if q < 1.0 else 0.0


@njit(cache=True)
def _image_offset(points, pair, height, normal):
    """Return the offset from particle i to the mirror image of j, twice the height away from j."""
    i, j = pair
    x = points[j, 0] - points[i, 0] - 2.0 * height * normal[0]
    y = points[j, 1] - points[i, 1] - 2.0 * height * normal[1]
    z = points[j, 2] - points[i, 2] - 2.0 * height * normal[2]
    return x, y, z


@njit(cache=True)
def _edge(points, mirrors, pair, support):
    """Return the weight of an edge with those to mirror images of its end, and the same times squared lengths.

    A particle on a plate is its own image and counts once.
    """
    heights, normals = mirrors
    i, j = pair
    square = 0.0
    for d in range(3):
        square += (points[j, d] - points[i, d]) ** 2
    weight = _weight(square, support)
    moment = weight * square
    for p in range(heights.shape[0]):
        height = heights[p, j]
        if 0.0 < height < support and 0.0 < heights[p, i] < support:
            x, y, z = _image_offset(points, pair, height, normals[p])
            square = x * x + y * y + z * z
            weight += _weight(square, support)
            moment += _weight(square, support) * square
    return weight, moment


@njit(cache=True, parallel=True)
def _moments(points, mirrors, lists, support):
    """Return the sum of weight times squared length over each particle's edges, shape (n,) [m^2]."""
    offsets, indices = lists
    result = np.empty(points.shape[0])
    for row in prange(points.shape[0]):
        i, total = np.int64(row), 0.0  # a signed index, or numba compiles every callee twice
        for k in range(offsets[i], offsets[i + 1]):
            total += _edge(points, mirrors, (i, np.int64(indices[k])), support)[1]
        result[i] = total
    return result


@njit(cache=True, parallel=True)
def _rows(points, mirrors, lists, scale, support):
    """Return columns and values of the rows; the diagonal comes last and is one for a particle without edges."""
    offsets, indices = lists
    count = points.shape[0]
    columns = np.empty(offsets[count] + count, np.int32)
    values = np.empty(offsets[count] + count)
    for row in prange(count):
        i = np.int64(row)
        at, total = offsets[i] + i, 0.0
        for k in range(offsets[i], offsets[i + 1]):
            j = np.int64(indices[k])
            value = 3.0 * (scale[i] + scale[j]) * _edge(points, mirrors, (i, j), support)[0]
            columns[at], values[at] = j, -value
            total += value
            at += 1
        columns[at], values[at] = i, (1.0 + LEAK) * total if total > 0.0 else 1.0
    return columns, values


@njit(cache=True)
def _add_difference(sums, offset, difference, support):
    """Add an edge to the normal equations of a gradient: six moments and the right-hand side."""
    x, y, z = offset
    w = _weight(x * x + y * y + z * z, support)
    sums[0] += w * x * x
    sums[1] += w * x * y
    sums[2] += w * x * z
    sums[3] += w * y * y
    sums[4] += w * y * z
    sums[5] += w * z * z
    sums[6] += w * difference * x
    sums[7] += w * difference * y
    sums[8] += w * difference * z


@njit(cache=True)
def _solve_symmetric(sums, result):
    """Solve the normal equations for the gradient by the adjugate; it is zero across a plane of edges."""
    xx, xy, xz, yy, yz, zz, a, b, c = sums
    ridge = RIDGE * (xx + yy + zz) + TINY
    xx, yy, zz = xx + ridge, yy + ridge, zz + ridge
    cxx, cxy, cxz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    cyy, cyz, czz = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    determinant = xx * cxx + xy * cxy + xz * cxz
    result[0] = (cxx * a + cxy * b + cxz * c) / determinant
    result[1] = (cxy * a + cyy * b + cyz * c) / determinant
    result[2] = (cxz * a + cyz * b + czz * c) / determinant


@njit(cache=True)
def _add_edges(points, mirrors, edge, support, sums):
    """Add an edge, given by its ends and the difference of the field, and those to mirror images."""
    heights, normals = mirrors
    i, j, difference = edge
    if i != j:
        offset = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        _add_difference(sums, offset, difference, support)
    for p in range(heights.shape[0]):
        if 0.0 < heights[p, j] < support and heights[p, i] < support:
            image = _image_offset(points, (i, j), heights[p, j], normals[p])
            _add_difference(sums, image, difference, support)


@njit(cache=True, parallel=True)
def _gradients(points, mirrors, lists, field, support):
    """Return the least-squares gradient of the field at the particles from ``lists[2]`` on, shape (m, 3)."""
    offsets, indices, first = lists
    count = points.shape[0] - first
    result, sums = np.empty((count, 3)), np.zeros((count, 9))
    for r in prange(count):
        i = first + r
        for k in range(offsets[i], offsets[i + 1]):
            j = np.int64(indices[k])
            _add_edges(points, mirrors, (i, j, field[j] - field[i]), support, sums[r])
        _add_edges(points, mirrors, (i, i, 0.0), support, sums[r])
        _solve_symmetric(sums[r], result[r])
    return result


def _mirrors(body: Body) -> tuple[Floats, Floats]:
    """Return heights above each plate and plane of symmetry, shape (p, n) [m], and their inward normals, (p, 3)."""
    symmetry, local = body.cloud.symmetry, [plate.local(body.points)[:, 2] for plate in body.plates]
    heights = [
        np.where(body.cloud.wall == wall, 0.0, -plate.side * local[wall]) for wall, plate in enumerate(body.plates)
    ] + [body.points[:, axis] for axis in symmetry]
    normals = [-plate.side * plate.normal for plate in body.plates] + [np.eye(3)[axis] for axis in symmetry]
    return np.array(heights).reshape(-1, len(body.points)), np.array(normals).reshape(-1, 3)


@dataclass(frozen=True, slots=True)
class PotentialFlow:
    """Operators of the potential at the current positions.

    Attributes:
        laplacian: Minus the Laplacian times volume, symmetric positive definite by a small leak, shape (n, n) [m].
    """

    laplacian: sparse.csr_matrix
    _body: Body
    _neighbours: NeighbourList
    _mirrors: tuple[Floats, Floats]

    @classmethod
    def of(cls, body: Body, neighbours: NeighbourList) -> "PotentialFlow":
        """Assemble the operators.

        Args:
            body: Liquid body.
            neighbours: Valid neighbour list; its radius is the support of the weights.
        """
        mirrors, lists = _mirrors(body), (neighbours.offsets, neighbours.indices)
        moments = _moments(body.points, mirrors, lists, neighbours.radius)
        scale = np.divide(body.volumes, moments, out=np.zeros_like(moments), where=moments > 0.0)
        columns, values = _rows(body.points, mirrors, lists, scale, neighbours.radius)
        starts = neighbours.offsets + np.arange(len(body.points) + 1, dtype=np.int32)
        size = len(body.points)
        laplacian = sparse.csr_matrix((values, columns, starts), shape=(size, size))
        laplacian.eliminate_zeros()
        return cls(laplacian, body, neighbours, mirrors)

    def balanced(self, flux: Floats) -> Floats:
        """Subtract the volume-weighted mean from fluxes of shape (n,) [m^3/s] in each connected group of particles.

        A film thinner than the particle distance has many groups, between which no flow is possible.
        """
        _, group = connected_components(self.laplacian, directed=False)
        mean = np.bincount(group, flux) / np.bincount(group, self._body.volumes)
        return flux - mean[group] * self._body.volumes

    def velocity(self, potential: Floats) -> Floats:
        """Return the gradient of a potential of shape (n,) [m^2/s] at the interior particles, shape (m, 3) [m/s]."""
        body, neighbours = self._body, self._neighbours
        lists = (neighbours.offsets, neighbours.indices, body.cloud.surface_count)
        return _gradients(body.points, self._mirrors, lists, potential, neighbours.radius)
