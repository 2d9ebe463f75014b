"""Volumes of particles, weights of direct nodal integration or masses: exact for 1 and x, nearly for x x.

A particle has the cell that the density of particles around it leaves, half of one on the free surface or a wall. These
volumes, which know the shape of the liquid only roughly, become v exp(q), q a quadratic polynomial, so that sums over
the particles of 1 and x equal the integrals over the body that the tracked surface encloses, and those of x x nearly:
of all positive volumes they have the least sum of their relative entropy to the first ones, over the volume of the
body, and of |missing x x / (V h^2)|^2 / (2 softness). Were second moments exact, a film of one or two spacings would
leave next to nothing to the particles of its surfaces: cells at z = 0 and h have three times the moment of a film of
thickness h, and particles without mass are thrown out of the liquid.
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
# Products of two directions stand for two entries of x x.
ENTRIES = np.concatenate((np.full(4, np.inf), np.where(PAIRS[0] == PAIRS[1], 1.0, 2.0)))
NEWTON_STEPS = 30
TOLERANCE = 1e-12
# Of the second moments: what a particle at the middle of its cell leaves out of it is 0.08 of volume times h^2.
SOFTNESS = 0.03


class NoNodalVolumes(RuntimeError):
    """No positive volumes of the particles have the centre of the body."""


def body_moments(body: Body) -> Moments:
    """Integrals of 1 [m^3], x `(3,)` [m^4] and x x `(3, 3)` [m^5] over the liquid, by tetrahedra with the origin."""
    if (own := body.moments()) is not None:
        return own
    moments = np.zeros(13)
    _add_moments(body.points, body.triangles, moments)
    for ring, plate in zip(body.cloud.rings, body.plates, strict=True):
        corners = np.concatenate((body.points[ring].mean(axis=0)[None], body.points[ring]))
        _add_moments(corners, _fan(len(ring), plate.side > 0.0), moments)
    return float(moments[0]), moments[1:4], moments[4:].reshape(3, 3)


@njit(cache=True)
def _fan(count, forward):
    """Triangles between a first point and each two of `count` others in a ring, `(count, 3)`."""
    result = np.empty((count, 3), np.int32)
    for k in range(count):
        own, after = 1 + k, 1 + (k + 1) % count
        result[k] = (0, own, after) if forward else (0, after, own)
    return result


@njit(cache=True)
def _add_moments(points, triangles, result):
    """Add integrals of 1, x and x x over tetrahedra between triangles `(t, 3)` and the origin, one after the other."""
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
    """Part of a whole cell that each particle has, were walls not there, `(n,)`."""
    on_surface = np.arange(len(body.points)) < body.cloud.surface_count
    return np.where(on_surface, 0.5, 1.0)


def wall_shares(body: Body, volumes: Floats) -> Floats:
    """Wetted area that each particle on a wall stands for `(n,)` [m^2]: shared out by their volumes `(n,)` [m^3]."""
    areas = np.zeros(len(body.points))
    for wall, ring in enumerate(body.cloud.rings):
        on_wall = body.cloud.wall == wall
        wetted = ring_area(body.points, ring)
        areas[on_wall] = wetted * volumes[on_wall] / volumes[on_wall].sum()
    return areas


def nodal_volumes(body: Body, density: Floats, moments: Moments) -> Floats:
    """Volumes of the particles `(n,)` [m^3].

    Args:
        body: the liquid body.
        density: `(n,)` of particles around each, walls mirrored, the free surface counted by `cell_share`.
        moments: of the body.

    Raises:
        NoNodalVolumes: there are none.
    """
    # Around a particle of the free surface only half of its surroundings are liquid.
    on_wall = np.where(body.cloud.wall >= 0, 0.5, 1.0)
    return with_moments(body, cell_share(body) ** 2 / density * on_wall * share(body.cloud), moments)


def with_moments(body: Body, cells: Floats, moments: Moments) -> Floats:
    """The volumes `(n,)` [m^3] closest to some cells `(n,)`, in any unit, that have the moments of the body.

    Raises:
        NoNodalVolumes: there are none.
    """
    volume, first, second = moments
    centre, length = first / volume, np.cbrt(volume)
    central = (second - np.outer(first, first) / volume) / length**2
    wanted = np.concatenate(([volume], np.zeros(3), central[PAIRS]))
    softness = SOFTNESS * volume * (body.cloud.spacing / length) ** 4 / ENTRIES
    return fitted_volumes(cells * (volume / cells.sum()), _powers(body.points, centre, length), wanted, softness)


@njit(cache=True)
def _powers(points, centre, length):
    """Monomials `(n, 10)` up to the second degree of points, from a centre `(3,)` in units of a length."""
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


def fitted_volumes(found: Floats, powers: Floats, wanted: Floats, softness: Floats) -> Floats:
    """Volumes v exp(q) of n particles `(n,)` with k moments, q a polynomial.

    Args:
        found: v, `(n,)` [m^3]; they add up to the volume of the body.
        powers: `(n, k)` monomials at the particles, without unit, the first one is 1.
        wanted: `(k,)` their integrals over the body [m^3].
        softness: `(k,)` of them [m^3], 0 where they are exact.

    Raises:
        NoNodalVolumes: there are none.
    """
    volume = wanted[0]
    found, missing = _fitted(powers, found, wanted, softness)
    if missing < TOLERANCE * volume:
        return found
    raise NoNodalVolumes("the particles fill the liquid too unevenly: no volumes of theirs have its centre")


@njit(cache=True)
def _fitted(powers, volumes, wanted, softness):
    """Volumes `(n,)` times exp(powers q) with wanted sums of powers `(n, k)`, and the largest that is missing of one.

    Newton's method for q; what is missing may be softness times q. Infinity: particles do not tell powers apart.
    """
    (count, size), found, growth = powers.shape, volumes.copy(), np.empty(len(volumes))
    factors, sums, change, matrix = np.zeros(size), np.empty(size), np.empty((size, 1)), np.empty((size, size))
    for step in range(NEWTON_STEPS + 1):
        _take_sums(powers, found, sums, matrix)
        missing = 0.0
        for a in range(size):
            change[a, 0] = wanted[a] - sums[a] - softness[a] * factors[a]
            matrix[a, a] += softness[a]
            if abs(change[a, 0]) > missing or np.isnan(change[a, 0]):
                missing = abs(change[a, 0])
        if missing < TOLERANCE * wanted[0] or step == NEWTON_STEPS:
            break
        if not _solve(matrix, change):
            return found, np.inf
        largest = 1.0
        for i in range(count):
            growth[i] = 0.0
            for a in range(size):
                growth[i] += powers[i, a] * change[a, 0]
            largest = max(largest, abs(growth[i]))
        for a in range(size):
            factors[a] += change[a, 0] / largest
        for i in range(count):
            found[i] *= np.exp(growth[i] / largest)
    return found, missing


@njit(cache=True, fastmath={"contract"})
def _take_sums(powers, volumes, sums, matrix):
    """Write the sums of powers times volumes `(k,)`, and of their products `(k, k)`."""
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
    """Solve a symmetric positive definite system in place, right-hand side `(k, 1)`; False where a pivot vanishes.

    In units of the unknowns that make its diagonal 1: powers of a film's thickness are small, but not dependent.
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
