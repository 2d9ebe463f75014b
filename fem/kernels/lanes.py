"""Lanes: sixteen elements side by side, so that one vector instruction works on several of them.

An array over a block of elements is flat, ``a[16 * k + lane]``, with k counting the entries of one element. Loops over
lanes are innermost, without branches and with constant bounds, so that the compiler vectorises them (not with eight
lanes, for which it considers the check for overlapping arrays too expensive). A 3 x 3 matrix is nine scalars, row by
row.
"""

from numba import njit

from reflowshock.fem.kernels.hexahedron import FINITE

LANES = 16
LANE_OPTIONS = {"cache": True, "fastmath": FINITE, "error_model": "numpy"}


@njit(**LANE_OPTIONS)
def nine(values, at):
    """Return nine entries of a lane, from ``at`` on."""
    return (
        values[at],
        values[at + LANES],
        values[at + 2 * LANES],
        values[at + 3 * LANES],
        values[at + 4 * LANES],
        values[at + 5 * LANES],
        values[at + 6 * LANES],
        values[at + 7 * LANES],
        values[at + 8 * LANES],
    )


@njit(**LANE_OPTIONS)
def put_nine(values, at, m):
    """Write nine entries of a lane, from ``at`` on."""
    values[at], values[at + LANES], values[at + 2 * LANES] = m[0], m[1], m[2]
    values[at + 3 * LANES], values[at + 4 * LANES], values[at + 5 * LANES] = m[3], m[4], m[5]
    values[at + 6 * LANES], values[at + 7 * LANES], values[at + 8 * LANES] = m[6], m[7], m[8]


@njit(**LANE_OPTIONS)
def six(values, at):
    """Return six entries of a lane, from ``at`` on: a symmetric matrix as xx, yy, zz, xy, yz, xz."""
    return (
        values[at],
        values[at + LANES],
        values[at + 2 * LANES],
        values[at + 3 * LANES],
        values[at + 4 * LANES],
        values[at + 5 * LANES],
    )


@njit(**LANE_OPTIONS)
def put_six(values, at, m):
    """Write six entries of a lane, from ``at`` on."""
    values[at], values[at + LANES], values[at + 2 * LANES] = m[0], m[1], m[2]
    values[at + 3 * LANES], values[at + 4 * LANES], values[at + 5 * LANES] = m[3], m[4], m[5]


@njit(**LANE_OPTIONS)
def six_of(values, g, at):
    """Return six entries of a lane, from ``at`` on, in a row of values."""
    return (
        values[g, at],
        values[g, at + LANES],
        values[g, at + 2 * LANES],
        values[g, at + 3 * LANES],
        values[g, at + 4 * LANES],
        values[g, at + 5 * LANES],
    )


@njit(**LANE_OPTIONS)
def put_six_of(values, g, at, m):
    """Write six entries of a lane, from ``at`` on, in a row of values."""
    values[g, at], values[g, at + LANES], values[g, at + 2 * LANES] = m[0], m[1], m[2]
    values[g, at + 3 * LANES], values[g, at + 4 * LANES], values[g, at + 5 * LANES] = m[3], m[4], m[5]


@njit(**LANE_OPTIONS)
def three(values, at):
    """Return three entries of a lane, from ``at`` on."""
    return values[at], values[at + LANES], values[at + 2 * LANES]


@njit(**LANE_OPTIONS)
def put_three(values, at, v):
    """Write three entries of a lane, from ``at`` on."""
    values[at], values[at + LANES], values[at + 2 * LANES] = v[0], v[1], v[2]


@njit(**LANE_OPTIONS)
def cross(a, b):
    """Return the cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(**LANE_OPTIONS)
def applied(m, v):
    """Return a matrix times a vector of three entries."""
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
        m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
    )


@njit(**LANE_OPTIONS)
def full(m):
    """Return a symmetric matrix as nine entries."""
    return m[0], m[3], m[5], m[3], m[1], m[4], m[5], m[4], m[2]


@njit(**LANE_OPTIONS)
def times(m, n):
    """Return the product of two matrices."""
    return (
        m[0] * n[0] + m[1] * n[3] + m[2] * n[6],
        m[0] * n[1] + m[1] * n[4] + m[2] * n[7],
        m[0] * n[2] + m[1] * n[5] + m[2] * n[8],
        m[3] * n[0] + m[4] * n[3] + m[5] * n[6],
        m[3] * n[1] + m[4] * n[4] + m[5] * n[7],
        m[3] * n[2] + m[4] * n[5] + m[5] * n[8],
        m[6] * n[0] + m[7] * n[3] + m[8] * n[6],
        m[6] * n[1] + m[7] * n[4] + m[8] * n[7],
        m[6] * n[2] + m[7] * n[5] + m[8] * n[8],
    )


@njit(**LANE_OPTIONS)
def transposed(m):
    """Return the transpose."""
    return m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]


@njit(**LANE_OPTIONS)
def scaled(factor, m):
    """Return a factor times a matrix."""
    return (
        factor * m[0],
        factor * m[1],
        factor * m[2],
        factor * m[3],
        factor * m[4],
        factor * m[5],
        factor * m[6],
        factor * m[7],
        factor * m[8],
    )


@njit(**LANE_OPTIONS)
def cofactor(m):
    """Return the matrix of cofactors, det(m) m^-T."""
    return (
        m[4] * m[8] - m[5] * m[7],
        m[5] * m[6] - m[3] * m[8],
        m[3] * m[7] - m[4] * m[6],
        m[2] * m[7] - m[1] * m[8],
        m[0] * m[8] - m[2] * m[6],
        m[1] * m[6] - m[0] * m[7],
        m[1] * m[5] - m[2] * m[4],
        m[2] * m[3] - m[0] * m[5],
        m[0] * m[4] - m[1] * m[3],
    )


@njit(**LANE_OPTIONS)
def cofactor_symmetric(m):
    """Return the cofactors of a symmetric matrix of six entries, as six."""
    return (
        m[1] * m[2] - m[4] * m[4],
        m[0] * m[2] - m[5] * m[5],
        m[0] * m[1] - m[3] * m[3],
        m[4] * m[5] - m[3] * m[2],
        m[3] * m[5] - m[0] * m[4],
        m[3] * m[4] - m[1] * m[5],
    )


@njit(**LANE_OPTIONS)
def determinant(m, cofactors):
    """Return the determinant of nine entries with their cofactors."""
    return m[0] * cofactors[0] + m[1] * cofactors[1] + m[2] * cofactors[2]


@njit(cache=True)
def gather_lanes(cells, values, result):
    """Copy the rows ``values (n, 3)`` at the nodes ``cells (k, 16)`` of a block into lanes ``(48 k,)``."""
    for a in range(len(cells)):
        for lane in range(LANES):
            row = values[cells[a, lane]]
            at = 3 * LANES * a + lane
            result[at], result[at + LANES], result[at + 2 * LANES] = row[0], row[1], row[2]


@njit(cache=True)
def scatter_lanes(cells, count, source, values):
    """Subtract the lanes ``source (48 k,)`` from the rows ``values (n, 3)``; only the first ``count`` lanes."""
    for a in range(len(cells)):
        for lane in range(count):
            row = values[cells[a, lane]]
            at = 3 * LANES * a + lane
            row[0] -= source[at]
            row[1] -= source[at + LANES]
            row[2] -= source[at + 2 * LANES]


@njit(**LANE_OPTIONS)
def turn(rotation, vectors):
    """Turn vectors ``(16 * 3 m,)`` by a rotation ``(16 * 9,)``, in place."""
    for start in range(0, len(vectors), 3 * LANES):
        v = vectors[start : start + 3 * LANES]
        for lane in range(LANES):
            put_three(v, lane, applied(nine(rotation, lane), three(v, lane)))


@njit(**LANE_OPTIONS)
def turn_back(rotation, vectors):
    """Turn vectors by the transpose of a rotation, in place."""
    for start in range(0, len(vectors), 3 * LANES):
        v = vectors[start : start + 3 * LANES]
        for lane in range(LANES):
            put_three(v, lane, applied(transposed(nine(rotation, lane)), three(v, lane)))


@njit(**LANE_OPTIONS)
def add_elastic(s, d, c):
    """Return s + C d, six entries, d with engineering shear; c as in ``kernels.nonlinear.elastic_stress``."""
    return (
        s[0] + c[0] * d[0] + c[3] * d[1] + c[5] * d[2],
        s[1] + c[3] * d[0] + c[1] * d[1] + c[4] * d[2],
        s[2] + c[5] * d[0] + c[4] * d[1] + c[2] * d[2],
        s[3] + c[6] * d[3],
        s[4] + c[7] * d[4],
        s[5] + c[8] * d[5],
    )
