"""Lanes: sixteen elements side by side, so that one vector instruction works on several of them.

An array over a block of elements is flat, ``a[16 * k + lane]``, with k counting the entries of one element. Loops over
lanes are innermost, without branches and with constant bounds, so that the compiler vectorises them (not with eight
lanes, for which it considers the check for overlapping arrays too expensive). A 3 x 3 matrix is nine scalars, row by
row; functions of such tuples also take tuples of vectors (``vectors.vector``), which later kernels use instead.
"""

from numba import njit

from reflowshock.fem.kernels.hexahedron import FINITE

LANES = 16
LANE_OPTIONS = {"cache": True, "fastmath": FINITE, "error_model": "numpy"}


@njit(**LANE_OPTIONS)
def nine(values, at):
    """Return the 3 x 3 matrix of one element as nine scalars, row by row.

    Args:
        values: Flat array of sixteen elements, shape (>= at + 129,); entry k of the matrix is ``values[at + 16 * k]``.
        at: Position of its first entry, integer: a multiple of 16 plus the number of the element (0 to 15).
    """
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
    """Write the 3 x 3 matrix of one element into an array of sixteen elements.

    Args:
        values: Flat array of sixteen elements, shape (>= at + 129,); entry k of the matrix is written to ``values[at +
            16 * k]``.
        at: Position of its first entry, integer: a multiple of 16 plus the number of the element (0 to 15).
        m: Matrix, a tuple of nine scalars row by row.
    """
    values[at], values[at + LANES], values[at + 2 * LANES] = m[0], m[1], m[2]
    values[at + 3 * LANES], values[at + 4 * LANES], values[at + 5 * LANES] = m[3], m[4], m[5]
    values[at + 6 * LANES], values[at + 7 * LANES], values[at + 8 * LANES] = m[6], m[7], m[8]


@njit(**LANE_OPTIONS)
def six(values, at):
    """Return the symmetric 3 x 3 matrix of one element as six scalars: xx, yy, zz, xy, yz, xz.

    Args:
        values: Flat array of sixteen elements, shape (>= at + 81,); entry k of the matrix is ``values[at + 16 * k]``.
        at: Position of its first entry, integer: a multiple of 16 plus the number of the element (0 to 15).
    """
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
    """Write the symmetric 3 x 3 matrix of one element into an array of sixteen elements.

    Args:
        values: Flat array of sixteen elements, shape (>= at + 81,); entry k of the matrix is written to ``values[at +
            16 * k]``.
        at: Position of its first entry, integer: a multiple of 16 plus the number of the element (0 to 15).
        m: Matrix, a tuple of six scalars: xx, yy, zz, xy, yz, xz.
    """
    values[at], values[at + LANES], values[at + 2 * LANES] = m[0], m[1], m[2]
    values[at + 3 * LANES], values[at + 4 * LANES], values[at + 5 * LANES] = m[3], m[4], m[5]


@njit(**LANE_OPTIONS)
def six_of(values, g, at):
    """Return the symmetric 3 x 3 matrix of one element at one integration point as six scalars: xx, yy, zz, xy, yz, xz.

    Args:
        values: One row per integration point, shape (m, >= at + 81); entry k is ``values[g, at + 16 * k]``.
        g: Row, number of the integration point, integer.
        at: Column of the first entry, a multiple of 16 plus the number of the element (0 to 15).
    """
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
    """Write the symmetric 3 x 3 matrix of one element at one integration point.

    Args:
        values: One row per integration point, shape (m, >= at + 81); entry k is written to ``values[g, at + 16 * k]``.
        g: Row, number of the integration point, integer.
        at: Column of the first entry, a multiple of 16 plus the number of the element (0 to 15).
        m: Matrix, six scalars: xx, yy, zz, xy, yz, xz.
    """
    values[g, at], values[g, at + LANES], values[g, at + 2 * LANES] = m[0], m[1], m[2]
    values[g, at + 3 * LANES], values[g, at + 4 * LANES], values[g, at + 5 * LANES] = m[3], m[4], m[5]


@njit(**LANE_OPTIONS)
def three(values, at):
    """Return a vector of one element among sixteen as three scalars.

    Args:
        values: Flat array of sixteen elements, shape (>= at + 33,); component k of the vector is ``values[at + 16 *
            k]``.
        at: Position of its first component, integer: a multiple of 16 plus the number of the element (0 to 15).
    """
    return values[at], values[at + LANES], values[at + 2 * LANES]


@njit(**LANE_OPTIONS)
def put_three(values, at, v):
    """Write a vector of one element into an array of sixteen elements.

    Args:
        values: Flat array of sixteen elements, shape (>= at + 33,); component k of the vector is written to ``values[at
            + 16 * k]``.
        at: Position of its first component, integer: a multiple of 16 plus the number of the element (0 to 15).
        v: Vector, a tuple of three scalars.
    """
    values[at], values[at + LANES], values[at + 2 * LANES] = v[0], v[1], v[2]


@njit(**LANE_OPTIONS)
def cross(a, b):
    """Return the cross product a x b of two vectors; all three are three scalars."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(**LANE_OPTIONS)
def applied(m, v):
    """Return m v as three scalars; m is a 3 x 3 matrix (nine scalars, row by row), v a vector (three scalars)."""
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
        m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
    )


@njit(**LANE_OPTIONS)
def full(m):
    """Return a symmetric 3 x 3 matrix, given as six scalars xx, yy, zz, xy, yz, xz, as nine scalars row by row."""
    return m[0], m[3], m[5], m[3], m[1], m[4], m[5], m[4], m[2]


@njit(**LANE_OPTIONS)
def times(m, n):
    """Return the matrix product m n of two 3 x 3 matrices; all three are nine scalars, row by row."""
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
    """Return the transpose of a 3 x 3 matrix; both are nine scalars, row by row."""
    return m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]


@njit(**LANE_OPTIONS)
def scaled(factor, m):
    """Return a scalar factor times a 3 x 3 matrix; both matrices are nine scalars, row by row."""
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
    """Return the cofactor matrix det(m) m^-T of a 3 x 3 matrix; both are nine scalars, row by row."""
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
    """Return the cofactor matrix of a symmetric 3 x 3 matrix; both are six scalars: xx, yy, zz, xy, yz, xz."""
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
    """Return the determinant of a 3 x 3 matrix, a scalar.

    Args:
        m: Matrix, nine scalars row by row.
        cofactors: Its cofactors in the same order, see ``cofactor``, nine scalars.
    """
    return m[0] * cofactors[0] + m[1] * cofactors[1] + m[2] * cofactors[2]


@njit(cache=True)
def gather_lanes(cells, values, result):
    """Copy nodal vectors of sixteen elements with k nodes into a flat array.

    Args:
        cells: Nodes of the elements, local node by element, shape (k, 16).
        values: Nodal vectors, such as displacements [m], shape (n, 3).
        result: Written: component c at node a of element e at ``16 * (3 a + c) + e``, shape (>= 48 k,).
    """
    for a in range(len(cells)):
        for lane in range(LANES):
            row = values[cells[a, lane]]
            at = 3 * LANES * a + lane
            result[at], result[at + LANES], result[at + 2 * LANES] = row[0], row[1], row[2]


@njit(cache=True)
def scatter_lanes(cells, count, source, values):
    """Subtract nodal vectors of sixteen elements with k nodes from an array over all nodes.

    Args:
        cells: Nodes of the elements, local node by element, shape (k, 16).
        count: Number of leading elements that are subtracted, integer; the others repeat the last of them.
        source: Vectors of the elements, such as forces [N]: component c at local node a of element e at
            ``16 * (3 a + c) + e``, shape (>= 48 k,).
        values: Nodal vectors, shape (n, 3), subtracted from.
    """
    for a in range(len(cells)):
        for lane in range(count):
            row = values[cells[a, lane]]
            at = 3 * LANES * a + lane
            row[0] -= source[at]
            row[1] -= source[at + LANES]
            row[2] -= source[at + 2 * LANES]


@njit(**LANE_OPTIONS)
def turn(rotation, vectors):
    """Rotate vectors of sixteen elements in place: v becomes R v.

    Args:
        rotation: One matrix R per element, entry k of element e at ``16 * k + e``, row by row, shape (144,).
        vectors: m vectors per element, component c of vector i at ``16 * (3 i + c) + e``, shape (48 m,).
    """
    for start in range(0, len(vectors), 3 * LANES):
        v = vectors[start : start + 3 * LANES]
        for lane in range(LANES):
            put_three(v, lane, applied(nine(rotation, lane), three(v, lane)))


@njit(**LANE_OPTIONS)
def turn_back(rotation, vectors):
    """Rotate vectors of sixteen elements in place by the transpose: v becomes R^T v.

    Args:
        rotation: One matrix R per element, entry k of element e at ``16 * k + e``, row by row, shape (144,).
        vectors: m vectors per element, component c of vector i at ``16 * (3 i + c) + e``, shape (48 m,).
    """
    for start in range(0, len(vectors), 3 * LANES):
        v = vectors[start : start + 3 * LANES]
        for lane in range(LANES):
            put_three(v, lane, applied(transposed(nine(rotation, lane)), three(v, lane)))


@njit(**LANE_OPTIONS)
def add_elastic(s, d, c):
    """Return the stress s + C d of one point as six scalars: xx, yy, zz, xy, yz, xz.

    Args:
        s: Stress, six scalars in the same order [Pa].
        d: Strain increment, six scalars in the same order, with engineering shear.
        c: Orthotropic elasticity, nine scalars [Pa]: C_xx, C_yy, C_zz, C_xy, C_yz, C_xz (normal), G_xy, G_yz, G_xz.
    """
    return (
        s[0] + c[0] * d[0] + c[3] * d[1] + c[5] * d[2],
        s[1] + c[3] * d[0] + c[1] * d[1] + c[4] * d[2],
        s[2] + c[5] * d[0] + c[4] * d[1] + c[2] * d[2],
        s[3] + c[6] * d[3],
        s[4] + c[7] * d[4],
        s[5] + c[8] * d[5],
    )
