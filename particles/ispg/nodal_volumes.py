"""Nodal volumes: weights of direct nodal integration and volumes of masses, fitted to the moments of the body.

The cell of a particle follows from the particle density around it, halved on the free surface and on a wall. These
volumes v approximate the shape of the liquid only roughly. They become v exp(q), with a quadratic polynomial q, so that
sums over the particles of 1 and x equal the integrals over the enclosed body exactly, and sums of x x nearly. Among all
positive volumes they minimise the relative entropy to v over the volume V, plus |missing x x / (V h^2)|^2 /
(2 softness). With exact second moments, surface particles of a film of one or two spacings would get almost no mass
(cells at z = 0 and h have three times the moment of a film of thickness h) and be ejected from the liquid.
"""

from typing import TypeAlias

import numpy as np
from numba import njit

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.surface_measure import ring_area
from reflowshock.particles.core.symmetry import share
from reflowshock.particles.ispg.stencils import factor_spd, substitute

Moments: TypeAlias = tuple[float, Floats, Floats]
PAIRS = np.triu_indices(3)
# Multiplicity of the moments in x x; off-diagonal entries occur twice.
ENTRIES = np.concatenate((np.full(4, np.inf), np.where(PAIRS[0] == PAIRS[1], 1.0, 2.0)))
NEWTON_STEPS = 30
TOLERANCE = 1e-12
# Softness of the second moments: a particle at the centre of its cell misses 0.08 of volume times h^2.
SOFTNESS = 0.03


class NoNodalVolumes(RuntimeError):
    """Error of particles for which no positive volumes match the volume and the centre of the body."""


def body_moments(body: Body) -> Moments:
    """Return the integrals over the liquid of 1 [m^3], x, shape (3,) [m^4], and x x, shape (3, 3) [m^5].

    They are sums over tetrahedra between the triangles of the boundary and the origin.

    Args:
        body: Liquid body, whose free surface and walls are the boundary.

    Returns:
        Tuple of the three integrals, in this order.
    """
    if (exact := body.moments()) is not None:
        return exact
    moments = np.zeros(13)
    _add_moments(body.points, body.triangles, moments)
    for ring, plate in zip(body.cloud.rings, body.plates, strict=True):
        corners = np.concatenate((body.points[ring].mean(axis=0)[None], body.points[ring]))
        _add_moments(corners, _fan(len(ring), plate.side > 0.0), moments)
    return float(moments[0]), moments[1:4], moments[4:].reshape(3, 3)


@njit(cache=True)
def _fan(count, forward):
    """Return the triangles between point 0 and successive points 1 to ``count`` in a ring, shape (count, 3)."""
    result = np.empty((count, 3), np.int32)
    for k in range(count):
        point, after = 1 + k, 1 + (k + 1) % count
        result[k] = (0, point, after) if forward else (0, after, point)
    return result


@njit(cache=True)
def _add_moments(points, triangles, result):
    """Add the integrals of 1, x and x x over tetrahedra between triangles (t, 3) and the origin to ``result`` (13,)."""
    for t in range(triangles.shape[0]):
        a, b, c = points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]]
        volume = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
        volume = (volume + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6.0
        result[0] += volume
        for d in range(3):
            total = a[d] + b[d] + c[d]
            result[1 + d] += volume * total / 4.0
            for e in range(3):
                product = total * (a[e] + b[e] + c[e]) + a[d] * a[e] + b[d] * b[e] + c[d] * c[e]
                result[4 + 3 * d + e] += volume * product / 20.0


def cell_share(body: Body) -> Floats:
    """Return the share of a full cell of each particle, shape (n,): 1/2 on the free surface, 1 inside and on walls.

    Args:
        body: Liquid body, of which the numbers of particles and of surface particles are used.
    """
    on_surface = np.arange(len(body.points)) < body.cloud.surface_count
    return np.where(on_surface, 0.5, 1.0)


def wall_shares(body: Body, volumes: Floats) -> Floats:
    """Divide the wetted area of each wall among the particles on it, in proportion to their volumes.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        volumes: Nodal volumes, shape (n,) [m^3].

    Returns:
        Wall area of each particle, shape (n,) [m^2]; zero off the walls.
    """
    areas = np.zeros(len(body.points))
    for wall, ring in enumerate(body.cloud.rings):
        on_wall = body.cloud.wall == wall
        wetted = ring_area(body.points, ring)
        areas[on_wall] = wetted * volumes[on_wall] / volumes[on_wall].sum()
    return areas


def nodal_volumes(body: Body, density: Floats, moments: Moments) -> Floats:
    """Return the nodal volumes, the weights of integration, shape (n,) [m^3].

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        density: Number of particles per volume at each particle, with walls mirrored and the free surface counted by
            ``cell_share``, shape (n,) [1/m^3].
        moments: Integrals over the body of 1 [m^3], x, shape (3,) [m^4], and x x, shape (3, 3) [m^5].

    Raises:
        NoNodalVolumes: No positive volumes match the volume and the centre of the body.
    """
    # Only half of the surroundings of a surface particle are liquid.
    on_wall = np.where(body.cloud.wall >= 0, 0.5, 1.0)
    return fit_to_moments(body, cell_share(body) ** 2 / density * on_wall * share(body.cloud), moments)


def fit_to_moments(body: Body, cells: Floats, moments: Moments) -> Floats:
    """Return the positive volumes closest to given cells that have the moments of the body, shape (n,) [m^3].

    Their sum and first moments are exact, second moments approximate.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        cells: Relative cell volumes, in any unit, shape (n,).
        moments: Integrals over the body of 1 [m^3], x, shape (3,) [m^4], and x x, shape (3, 3) [m^5].

    Raises:
        NoNodalVolumes: No positive volumes match the volume and the centre of the body.
    """
    volume, first, second = moments
    centre, length = first / volume, np.cbrt(volume)
    central = (second - np.outer(first, first) / volume) / length**2
    required = np.concatenate(([volume], np.zeros(3), central[PAIRS]))
    softness = SOFTNESS * volume * (body.cloud.spacing / length) ** 4 / ENTRIES
    return fit_volumes(cells * (volume / cells.sum()), _powers(body.points, centre, length), required, softness)


@njit(cache=True)
def _powers(points, centre, length):
    """Return the monomials up to degree two of (points - centre) / length, shape (n, 10)."""
    result = np.ones((points.shape[0], 10))
    for i in range(points.shape[0]):
        x, y, z = (
            (points[i, 0] - centre[0]) / length,
            (points[i, 1] - centre[1]) / length,
            (points[i, 2] - centre[2]) / length,
        )
        result[i, 1], result[i, 2], result[i, 3] = x, y, z
        result[i, 4], result[i, 5], result[i, 6] = x * x, x * y, x * z
        result[i, 7], result[i, 8], result[i, 9] = y * y, y * z, z * z
    return result


def fit_volumes(cells: Floats, powers: Floats, moments: Floats, softness: Floats) -> Floats:
    """Return positive volumes with given moments: cells v times exp(q), where q is a polynomial in the position.

    Args:
        cells: Volumes v, whose sum is the volume of the body, shape (n,) [m^3].
        powers: Dimensionless monomials at the particles, the first of which is 1, shape (n, k).
        moments: Required sums of volumes times monomials, shape (k,) [m^3].
        softness: Error that each moment may keep in exchange for volumes nearer to the cells; 0 for an exact moment,
            shape (k,) [m^3].

    Returns:
        Volumes, shape (n,) [m^3].

    Raises:
        NoNodalVolumes: No positive volumes have these moments.
    """
    volume = moments[0]
    volumes, missing = _fitted(powers, cells, moments, softness)
    if missing < TOLERANCE * volume:
        return volumes
    raise NoNodalVolumes(
        "the particles are too uneven: no nodal volumes match the volume and the centre of the liquid; "
        "try another solder.numerics.spacing"
    )


@njit(cache=True)
def _fitted(powers, volumes, required, softness):
    """Return volumes (n,) times exp(powers q) with required moments (k,), and the largest error of a moment.

    Newton's method for q; a moment may miss softness times q. The error is infinite if the monomials are dependent.
    """
    (count, size), result, growth = powers.shape, volumes.copy(), np.empty(len(volumes))
    factors, sums, change, matrix = np.zeros(size), np.empty(size), np.empty((size, 1)), np.empty((size, size))
    for step in range(NEWTON_STEPS + 1):
        _take_sums(powers, result, sums, matrix)
        missing = 0.0
        for a in range(size):
            change[a, 0] = required[a] - sums[a] - softness[a] * factors[a]
            matrix[a, a] += softness[a]
            if abs(change[a, 0]) > missing or np.isnan(change[a, 0]):
                missing = abs(change[a, 0])
        if missing < TOLERANCE * required[0] or step == NEWTON_STEPS:
            break
        if not _solve(matrix, change):
            return result, np.inf
        largest = 1.0
        for i in range(count):
            growth[i] = 0.0
            for a in range(size):
                growth[i] += powers[i, a] * change[a, 0]
            largest = max(largest, abs(growth[i]))
        for a in range(size):
            factors[a] += change[a, 0] / largest
        for i in range(count):
            result[i] *= np.exp(growth[i] / largest)
    return result, missing


@njit(cache=True, fastmath={"contract"})
def _take_sums(powers, volumes, sums, matrix):
    """Write the sums over particles of volume times monomial (k,) and of volume times products of two (k, k)."""
    sums[:] = 0.0
    matrix[:] = 0.0
    for i in range(powers.shape[0]):
        for a in range(powers.shape[1]):
            value = volumes[i] * powers[i, a]
            sums[a] += value
            for b in range(powers.shape[1]):
                matrix[a, b] += value * powers[i, b]


@njit(cache=True)
def _solve(matrix, right):
    """Solve a symmetric positive definite system in place, right-hand side (k, 1); return False if a pivot vanishes.

    The diagonal is scaled to 1, because powers of a film's thickness are small without being dependent.
    """
    size = matrix.shape[0]
    scale = np.empty(size)
    for a in range(size):
        if not matrix[a, a] > 0.0:
            return False
        scale[a] = 1.0 / np.sqrt(matrix[a, a])
        right[a, 0] *= scale[a]
    for a in range(size):
        for b in range(size):
            matrix[a, b] *= scale[a] * scale[b]
    if not factor_spd(matrix, size):
        return False
    substitute(matrix, right, size)
    for a in range(size):
        right[a, 0] *= scale[a]
    return True
