"""Kernels of the Galerkin space: linear MLS shape functions with their derivatives, and sums over their rows.

Columns are particles, followed by their ghosts. A row stores the weights (psi, psi,x psi,y psi,z) of each pair side by
side, so that sums over a row, or over a column for transposes, visit each pair once. The order of summation does not
depend on the number of threads.
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

    Args:
        rows: Numbers of the particles, shape (m,).
        points: Positions of n particles, then of g ghosts, shape (n + g, 3) [m].
        lists: Offsets (n + 1,) and indices (k,) of the neighbours, and the radius of the search, a scalar [m].
        spacing: Particle spacing, scalar [m]; the support is two spacings, or wider to hold 16 neighbours.

    Returns:
        Squared radii, zero where the search found too few points, shape (m,) [m^2], and numbers of points, shape (m,).
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
    """Return neighbour lists, offsets (n + 1,) and indices (k,), with some rows replaced.

    ``lists`` are the old offsets and indices, ``rows`` (m,) the particles whose rows change, ``others`` the offsets
    (m + 1,) and indices of their new rows. A particle itself is left out of its row.
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
    """Return the columns and weights of all rows, and the particle densities.

    psi_J = w_J b . p_J with M b = (1, 0, 0, 0); psi_J,c = w_J b,c . p_J + w_J,c b . p_J with M b,c = e_c - M,c b.

    Args:
        points: Positions of n particles, then of g ghosts, shape (n + g, 3) [m].
        lists: Offsets (n + 1,) and indices of the neighbours.
        squares: Squared support radii, shape (n,) [m^2].
        starts: Start of each row, shape (n + 1,).
        shares: Share with which each point counts in the density, shape (n + g,).

    Returns:
        Columns, shape (k,); weights psi, psi,x, psi,y, psi,z, shape (k, 4) [1, 1/m]; densities up to a constant factor,
        zero where M is singular, shape (n,) [1/m^3].
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


@njit(cache=True)
def values(starts, columns, weights, field):
    """Return N f at the particles, shape (n, d), of a field f on particles and ghosts, shape (n + g, d).

    ``starts`` (n + 1,), ``columns`` (k,), ``weights`` (k, 4) are the rows of shape functions N and their derivatives.
    """
    result = np.zeros((starts.shape[0] - 1, field.shape[1]))
    for i in range(result.shape[0]):
        for k in range(starts[i], starts[i + 1]):
            for d in range(field.shape[1]):
                result[i, d] += weights[k, 0] * field[columns[k], d]
    return result


@njit(cache=True)
def spread(starts, columns, weights, parts, source):
    """Distribute a scalar, ``parts`` (n,), to particles by shape functions, ghosts counting as their particles: (n,).

    ``source`` (g,) is the particle that each ghost mirrors; ``starts`` (n + 1,), ``columns`` (k,), ``weights`` (k, 4).
    """
    count = starts.shape[0] - 1
    result = np.zeros(count)
    for i in range(count):
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            result[source[j - count] if j >= count else j] += weights[k, 0] * parts[i]
    return result


@njit(cache=True, fastmath={"contract"})
def lost_power(rows, fields, factors, walls):
    """Return the power in one velocity field of the forces that resist another one.

    Args:
        rows: Starts (n + 1,), columns (k,) and weights (k, 4) of the shape functions N.
        fields: Velocity that causes the forces and velocity in which they act, both with ghosts, (n + g, 3) [m/s].
        factors: Coefficients of v - N v [kg/s], of N v [kg/s] and of twice the strain rate [N m s], shape (n, 3).
        walls: Wall velocities at the particles, shape (n, 3) [m/s].

    Returns:
        Power of smoothing, of wall drag and of viscosity, three scalars [W].
    """
    (starts, columns, weights), (first, second) = rows, fields
    smoothing = sliding = viscous = 0.0
    a, b = np.empty((4, 3)), np.empty((4, 3))
    for i in range(starts.shape[0] - 1):
        a[:], b[:] = 0.0, 0.0
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            for c in range(4):
                for d in range(3):
                    a[c, d] += weights[k, c] * first[j, d]
                    b[c, d] += weights[k, c] * second[j, d]
        for d in range(3):
            smoothing += factors[i, 0] * (first[i, d] - a[0, d]) * (second[i, d] - b[0, d])
            sliding += factors[i, 1] * (a[0, d] - walls[i, d]) * (b[0, d] - walls[i, d])
            for c in range(3):
                viscous += factors[i, 2] * (a[1 + c, d] + a[1 + d, c]) * b[1 + c, d]
    return smoothing, sliding, viscous


@njit(cache=True)
def velocity_gradient(starts, columns, weights, field):
    """Return dv_c / dx_d (n, 3, 3) [1/s] of ``field`` (n + g, 3) [m/s]; starts (n + 1), columns (k), weights (k, 4)."""
    count = starts.shape[0] - 1
    gradient = np.empty((count, 3, 3))
    for i in range(count):
        g00 = g01 = g02 = g10 = g11 = g12 = g20 = g21 = g22 = 0.0
        for k in range(starts[i], starts[i + 1]):
            j, w = columns[k], weights[k]
            wx, wy, wz = w[1], w[2], w[3]
            x, y, z = field[j, 0], field[j, 1], field[j, 2]
            g00 += wx * x
            g01 += wy * x
            g02 += wz * x
            g10 += wx * y
            g11 += wy * y
            g12 += wz * y
            g20 += wx * z
            g21 += wy * z
            g22 += wz * z
        gradient[i, 0, 0], gradient[i, 0, 1], gradient[i, 0, 2] = g00, g01, g02
        gradient[i, 1, 0], gradient[i, 1, 1], gradient[i, 1, 2] = g10, g11, g12
        gradient[i, 2, 0], gradient[i, 2, 1], gradient[i, 2, 2] = g20, g21, g22
    return gradient


@njit(cache=True, fastmath={"contract"})
def resistance(starts, columns, weights, field, factors):
    """Return the forces of smoothing, wall drag and viscosity that resist a velocity field, in one pass over the rows.

    Args:
        starts: Start of each row of the shape functions N, shape (n + 1,).
        columns: Particles and ghosts in the rows, shape (k,).
        weights: Shape functions and their derivatives by x, y, z, shape (k, 4) [1, 1/m].
        field: Velocities v with ghosts, shape (n + g, 3) [m/s].
        factors: Coefficients of v - N v [kg/s], of N v [kg/s] and of twice the strain rate [N m s], shape (n, 3).

    Returns:
        Forces on particles and ghosts, shape (n + g, 3) [N].
    """
    result = np.zeros(field.shape)
    for i in range(starts.shape[0] - 1):
        x0 = x1 = x2 = x3 = y0 = y1 = y2 = y3 = z0 = z1 = z2 = z3 = 0.0
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            w0, w1, w2, w3 = weights[k, 0], weights[k, 1], weights[k, 2], weights[k, 3]
            x, y, z = field[j, 0], field[j, 1], field[j, 2]
            x0, x1, x2, x3 = x0 + w0 * x, x1 + w1 * x, x2 + w2 * x, x3 + w3 * x
            y0, y1, y2, y3 = y0 + w0 * y, y1 + w1 * y, y2 + w2 * y, y3 + w3 * y
            z0, z1, z2, z3 = z0 + w0 * z, z1 + w1 * z, z2 + w2 * z, z3 + w3 * z
        smoothing, drag, viscous = factors[i, 0], factors[i, 1], factors[i, 2]
        fx, fy, fz = smoothing * (field[i, 0] - x0), smoothing * (field[i, 1] - y0), smoothing * (field[i, 2] - z0)
        result[i, 0] += fx
        result[i, 1] += fy
        result[i, 2] += fz
        # Distribute the force on N v and the stresses over the columns by the weights of psi and its derivatives.
        x0, y0, z0 = drag * x0 - fx, drag * y0 - fy, drag * z0 - fz
        xy, xz, yz = viscous * (x2 + y1), viscous * (x3 + z1), viscous * (y3 + z2)
        xx, yy, zz = 2.0 * viscous * x1, 2.0 * viscous * y2, 2.0 * viscous * z3
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            w0, w1, w2, w3 = weights[k, 0], weights[k, 1], weights[k, 2], weights[k, 3]
            result[j, 0] += w0 * x0 + w1 * xx + w2 * xy + w3 * xz
            result[j, 1] += w0 * y0 + w1 * xy + w2 * yy + w3 * yz
            result[j, 2] += w0 * z0 + w1 * xz + w2 * yz + w3 * zz
    return result


@njit(cache=True)
def divergence(starts, columns, weights, field):
    """Return the divergence (n,) [1/s] of velocities (n + g, 3) [m/s]; starts (n + 1), columns (k), weights (k, 4)."""
    count = starts.shape[0] - 1
    result = np.empty(count)
    for i in range(count):
        total = 0.0
        for k in range(starts[i], starts[i + 1]):
            j, w = columns[k], weights[k]
            total += w[1] * field[j, 0] + w[2] * field[j, 1] + w[3] * field[j, 2]
        result[i] = total
    return result


@njit(cache=True)
def divergence_transposed(starts, columns, weights, factor, result):
    """Add div^T ``factor`` (n,) [N m] to ``result`` (n + g, 3) [N]; starts (n + 1), columns (k), weights (k, 4)."""
    for i in range(starts.shape[0] - 1):
        f = factor[i]
        if f != 0.0:
            for k in range(starts[i], starts[i + 1]):
                j, w = columns[k], weights[k]
                result[j, 0] += f * w[1]
                result[j, 1] += f * w[2]
                result[j, 2] += f * w[3]


@njit(cache=True)
def reflected(field, source, reflection):
    """Append the reflected vectors of the ghosts to a vector field, shape (n, 3) to (n + g, 3).

    ``source`` (g,) is the particle that each ghost mirrors; ``reflection`` (g, 3, 3) maps its vector to the ghost.
    """
    count = field.shape[0]
    result = np.empty((count + source.shape[0], 3))
    for i in range(count):
        for c in range(3):
            result[i, c] = field[i, c]
    for g in range(source.shape[0]):
        for c in range(3):
            total = 0.0
            for d in range(3):
                total += reflection[g, c, d] * field[source[g], d]
            result[count + g, c] = total
    return result


@njit(cache=True)
def folded(forces, source, reflection):
    """Add ghost forces, turned by ``reflection`` (g, 3, 3), to particles ``source`` (g,): (n + g, 3) to (n, 3) [N]."""
    count = forces.shape[0] - source.shape[0]
    result = forces[:count].copy()
    for g in range(source.shape[0]):
        for d in range(3):
            for c in range(3):
                result[source[g], d] += reflection[g, c, d] * forces[count + g, c]
    return result
