"""Rows of linear MLS shape functions with their derivatives, from neighbour lists; kernels of the Galerkin space.

Columns are particles, followed by their ghosts. A row stores the weights (psi, psi,x psi,y psi,z) of each pair side by
side, so that sums over a row (``galerkin_kernels.py``) visit each pair once.
"""

import numpy as np
from numba import njit, prange

from reflowshock.particles.ispg.stencils import factor_spd, substitute

# Support radius in spacings; it is extended until the 16th neighbour lies within 1 / 1.2 of it.
SUPPORT, FEWEST, WIDER = 2.0, 16, 1.2
ROWS = 64  # rows that share work arrays


@njit(cache=True, parallel=True)
def supports(rows, points, lists, spacing):
    """Return the squared support radius of some particles, and the number of points within it.

    The support is a ball of two spacings, or a wider one that holds at least 16 neighbours.

    Args:
        rows: Numbers of the particles whose support is computed, integers, shape (m,).
        points: Positions of n particles, then of g ghost particles (mirror images at walls), shape (n + g, 3) [m].
        lists: Tuple of three: start of each particle's neighbours, shape (n + 1,); neighbour numbers, shape (k,);
            radius within which these neighbours were searched, a scalar [m].
        spacing: Particle spacing, a scalar [m].

    Returns:
        Squared support radii, zero where the search radius was too small for 16 neighbours, shape (m,) [m^2]; numbers
        of points in the support, the particle itself included, shape (m,).
    """
    offsets, indices, reach = lists
    squares, lengths = np.zeros(rows.shape[0]), np.ones(rows.shape[0], np.int64)
    for r in prange(rows.shape[0]):
        i, support = np.int64(rows[r]), (SUPPORT * spacing) ** 2
        neighbours, limit = indices[offsets[i] : offsets[i + 1]], support / WIDER**2
        near, within = 0, 0
        for j in neighbours:
            square = _square(points, i, j)
            near += square < limit
            within += square < support
        if near < FEWEST and len(neighbours) >= FEWEST:
            support = max(support, WIDER**2 * _square_of_the_fewest(points, i, neighbours))
            within = _count_within(points, i, neighbours, support)
        if max(near, len(neighbours)) >= FEWEST and support <= reach**2:
            squares[r] = support
            lengths[r] += within
    return squares, lengths


@njit(cache=True)
def _square(points, i, j):
    """Return the squared distance of two points."""
    x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    return x * x + y * y + z * z


@njit(cache=True)
def _count_within(points, i, neighbours, limit):
    """Return the number of neighbours of a point within a squared distance."""
    count = 0
    for j in neighbours:
        count += _square(points, i, j) < limit
    return count


@njit(cache=True)
def _square_of_the_fewest(points, i, neighbours):
    """Return the squared distance of the 16th neighbour of a point."""
    nearest = np.full(FEWEST, np.inf)  # ascending
    for j in neighbours:
        square, at = _square(points, i, j), FEWEST - 1
        if square < nearest[at]:
            while at > 0 and nearest[at - 1] > square:
                nearest[at] = nearest[at - 1]
                at -= 1
            nearest[at] = square
    return nearest[-1]


@njit(cache=True)
def with_rows(lists, rows, others):
    """Return new neighbour lists in which the rows of some particles are replaced.

    A row lists the neighbours of one particle; the particle itself is left out of it. No argument is changed.

    Args:
        lists: Old lists, a tuple: start of each row, shape (n + 1,), and neighbour numbers, shape (k,).
        rows: Numbers of the particles whose rows are replaced, integers, shape (m,).
        others: Their new rows, a tuple: start of each row, shape (m + 1,), and neighbour numbers, shape (l,).

    Returns:
        Start of each row, shape (n + 1,), and neighbour numbers.
    """
    (offsets, indices), (starts, replacements) = lists, others
    number = np.full(offsets.shape[0] - 1, -1)
    for r in range(rows.shape[0]):
        number[rows[r]] = r
    result, ends = np.empty(indices.shape[0] + replacements.shape[0], np.int32), np.zeros_like(offsets)
    at = 0
    for i in range(number.shape[0]):
        n = number[i]
        for j in indices[offsets[i] : offsets[i + 1]] if n < 0 else replacements[starts[n] : starts[n + 1]]:
            if j != i:
                result[at] = j
                at += 1
        ends[i + 1] = at
    return ends, result[:at]


@njit(cache=True, fastmath={"contract", "reassoc"})
def _stencil(points, row, support, places):
    """Write the offsets of a row's points over the support radius and 1 - their squares to ``places`` (4, m)."""
    i, columns = row
    x, y, z, scale = points[i, 0], points[i, 1], points[i, 2], 1.0 / support
    for k in range(columns.shape[0]):
        j = columns[k]
        places[0, k], places[1, k], places[2, k] = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
    for k in range(columns.shape[0]):
        x, y, z = scale * places[0, k], scale * places[1, k], scale * places[2, k]
        places[0, k], places[1, k], places[2, k], places[3, k] = x, y, z, 1.0 - (x * x + y * y + z * z)


@njit(cache=True, fastmath={"contract", "reassoc"})
def _moments(places, count, moments):
    """Write the lower triangle of the moment matrix M = sum of w p p^T, p = (1, x, y, z), w = (1 - r^2)^3."""
    m0 = mx = my = mz = xx = xy = xz = yy = yz = zz = 0.0
    for k in range(count):
        x, y, z, rest = places[0, k], places[1, k], places[2, k], places[3, k]
        weight = rest * rest * rest
        wx, wy, wz = weight * x, weight * y, weight * z
        m0, mx, my, mz = m0 + weight, mx + wx, my + wy, mz + wz
        xx, xy, xz, yy, yz, zz = xx + wx * x, xy + wx * y, xz + wx * z, yy + wy * y, yz + wy * z, zz + wz * z
    moments[0, 0], moments[1, 0], moments[2, 0], moments[3, 0] = m0, mx, my, mz
    moments[1, 1], moments[2, 1], moments[3, 1] = xx, xy, xz
    moments[2, 2], moments[3, 2], moments[3, 3] = yy, yz, zz


@njit(cache=True, fastmath={"contract", "reassoc"})
def _slope_loads(places, count, first, loads):
    """Write the right-hand sides e_c - M,c b to the columns of ``loads`` (4, 3); b is ``first``."""
    sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
    b0, b1, b2, b3 = first[0, 0], first[1, 0], first[2, 0], first[3, 0]
    for k in range(count):
        x, y, z, rest = places[0, k], places[1, k], places[2, k], places[3, k]
        slope = 6.0 * rest * rest * (b0 + b1 * x + b2 * y + b3 * z)
        wx, wy, wz = slope * x, slope * y, slope * z
        sx, sy, sz, xx, xy, xz = sx + wx, sy + wy, sz + wz, xx + wx * x, xy + wx * y, xz + wx * z
        yy, yz, zz = yy + wy * y, yz + wy * z, zz + wz * z
    loads[0, 0], loads[0, 1], loads[0, 2] = -sx, -sy, -sz
    loads[1, 0], loads[1, 1], loads[1, 2] = 1.0 - xx, -xy, -xz
    loads[2, 0], loads[2, 1], loads[2, 2] = -xy, 1.0 - yy, -yz
    loads[3, 0], loads[3, 1], loads[3, 2] = -xz, -yz, 1.0 - zz


@njit(cache=True, fastmath={"contract", "reassoc"})
def _weights(places, count, solved, result):
    """Write the weights of a row to ``result`` (m, 4) from b (4, 1) and its derivatives (4, 3); the support is one."""
    first, slopes = solved
    for k in range(count):
        x, y, z, rest = places[0, k], places[1, k], places[2, k], places[3, k]
        square = rest * rest
        value = first[0, 0] + first[1, 0] * x + first[2, 0] * y + first[3, 0] * z
        gradient, cube = 6.0 * value * square, square * rest
        result[k, 0] = value * cube
        result[k, 1] = (slopes[0, 0] + slopes[1, 0] * x + slopes[2, 0] * y + slopes[3, 0] * z) * cube + gradient * x
        result[k, 2] = (slopes[0, 1] + slopes[1, 1] * x + slopes[2, 1] * y + slopes[3, 1] * z) * cube + gradient * y
        result[k, 3] = (slopes[0, 2] + slopes[1, 2] * x + slopes[2, 2] * y + slopes[3, 2] * z) * cube + gradient * z


@njit(cache=True, parallel=True)
def shape_rows(points, lists, squares, starts, shares):
    """Compute the linear MLS shape functions psi_J and their gradients at all particles, and the particle densities.

    psi_J = w_J b . p_J with M b = (1, 0, 0, 0); psi_J,c = w_J b,c . p_J + w_J,c b . p_J with M b,c = e_c - M,c b.

    Args:
        points: Positions of n particles, then of g ghost particles (mirror images at walls), shape (n + g, 3) [m].
        lists: Neighbours of each particle, a tuple: start of each row, shape (n + 1,), and neighbour numbers without
            the particle itself.
        squares: Squared support radii, shape (n,) [m^2]; neighbours beyond are left out.
        starts: Start of each row of the result, shape (n + 1,): cumulated numbers of points in the supports.
        shares: Weight with which each point counts in the density, 0 to 1, shape (n + g,).

    Returns:
        Points in the rows, the particle itself first, shape (k,); weights psi [1] and their derivatives by x, y, z
        [1/m], shape (k, 4); densities up to a constant factor, shape (n,) [1/m^3], zero where the neighbours lie in a
        plane.
    """
    offsets, indices = lists
    count, longest = squares.shape[0], np.diff(starts).max()
    columns, weights = np.empty(starts[count], np.int32), np.empty((starts[count], 4))
    density = np.zeros(count)
    for part in prange((count + ROWS - 1) // ROWS):
        places, moments, first, slopes = np.empty((4, longest)), np.empty((4, 4)), np.empty((4, 1)), np.empty((4, 3))
        begin = ROWS * np.int64(part)  # a signed index, or numba compiles every callee twice
        for i in range(begin, min(count, begin + ROWS)):
            support, at = np.sqrt(squares[i]), starts[i]
            columns[at] = i
            for k in range(offsets[i], offsets[i + 1]):
                if _square(points, i, indices[k]) < squares[i]:
                    at += 1
                    columns[at] = indices[k]
            stencil, result = columns[starts[i] : at + 1], weights[starts[i] : at + 1]
            _stencil(points, (i, stencil), support, places)
            _moments(places, len(stencil), moments)
            if not factor_spd(moments, 4):
                continue
            first[:], first[0] = 0.0, 1.0
            substitute(moments, first, 4)
            _slope_loads(places, len(stencil), first, slopes)
            substitute(moments, slopes, 4)
            _weights(places, len(stencil), (first, slopes), result)
            total = 0.0
            for k in range(len(stencil)):
                total += shares[stencil[k]] * places[3, k] ** 3
                for c in range(1, 4):
                    result[k, c] /= support
            density[i] = total / support**3
    return columns, weights, density
