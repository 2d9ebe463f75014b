"""Walsh-Hadamard modes of the corners of ``WIDTH`` hexahedra, one in each lane of a SIMD vector.

The mode of parity p (bit d: odd along direction d) has the value sum over corners a of (-1)^|p & a| v_a, a tuple (x, y,
z) of three SIMD vectors; the modes are eight such tuples in the order of p: 1, x, y, xy, z, xz, yz, xyz.
"""

from numba import njit

from reflowshock.fem.kernels.vectors.memory import first_lanes, gather, subtract
from reflowshock.fem.kernels.vectors.vector import VECTOR_OPTIONS, WIDTH


@njit(**VECTOR_OPTIONS)
def plus(a, b):
    """Return the sum a + b of two tuples (x, y, z) of three SIMD vectors each, a tuple of three SIMD vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@njit(**VECTOR_OPTIONS)
def minus(a, b):
    """Return the difference a - b of two tuples (x, y, z) of three SIMD vectors each, a tuple of three SIMD vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(**VECTOR_OPTIONS)
def scaled(factor, a):
    """Return ``factor``, one SIMD vector, times ``a``, a tuple (x, y, z) of three SIMD vectors; again such a tuple."""
    return factor * a[0], factor * a[1], factor * a[2]


@njit(**VECTOR_OPTIONS)
def dot(a, b):
    """Return a . b, one SIMD vector; ``a`` and ``b`` are tuples (x, y, z) of three SIMD vectors each."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(**VECTOR_OPTIONS)
def transform(v):
    """Return the Walsh-Hadamard transform of eight corner values, which is its own transpose.

    Args:
        v: Values at the corners in tensor order (x fastest), eight tuples (x, y, z) of three SIMD vectors, any unit.

    Returns:
        Modes 1, x, y, xy, z, xz, yz, xyz, eight tuples (x, y, z) of three SIMD vectors in the same unit.
    """
    a, b, c, d = plus(v[0], v[1]), minus(v[0], v[1]), plus(v[2], v[3]), minus(v[2], v[3])
    e, f, g, h = plus(v[4], v[5]), minus(v[4], v[5]), plus(v[6], v[7]), minus(v[6], v[7])
    a, b, c, d = plus(a, c), plus(b, d), minus(a, c), minus(b, d)
    e, f, g, h = plus(e, g), plus(f, h), minus(e, g), minus(f, h)
    return plus(a, e), plus(b, f), plus(c, g), plus(d, h), minus(a, e), minus(b, f), minus(c, g), minus(d, h)


@njit(**VECTOR_OPTIONS)
def read_modes(values, cells, b):
    """Return the modes 1, x, y, xy, z, xz, yz, xyz of the elements of a block, eight tuples of three SIMD vectors.

    Args:
        values: Pointer to nodal values of three components, shape (n, 3), such as displacements [m].
        cells: Pointer to the nodes of blocks, node a of element e of block b at ``WIDTH (8 b + a) + e``, int32.
        b: Number of the block, integer.
    """
    at = 8 * WIDTH * b
    return transform(
        (
            gather(values, cells, at),
            gather(values, cells, at + WIDTH),
            gather(values, cells, at + 2 * WIDTH),
            gather(values, cells, at + 3 * WIDTH),
            gather(values, cells, at + 4 * WIDTH),
            gather(values, cells, at + 5 * WIDTH),
            gather(values, cells, at + 6 * WIDTH),
            gather(values, cells, at + 7 * WIDTH),
        )
    )


@njit(**VECTOR_OPTIONS)
def only_first(v, count):
    """Return a tuple of three SIMD vectors with zeros after the first ``count`` lanes.

    Args:
        v: Tuple (x, y, z) of three SIMD vectors of ``WIDTH`` lanes.
        count: Number of lanes that stay, integer.
    """
    return first_lanes(v[0], count), first_lanes(v[1], count), first_lanes(v[2], count)


@njit(**VECTOR_OPTIONS)
def subtract_modes(values, cells, b, count, forces):
    """Subtract forces on the modes of the elements of a block from nodal values.

    Args:
        values: Pointer to nodal values of three components, shape (n, 3), such as forces [N], subtracted from.
        cells: Pointer to the nodes of blocks, node a of element e of block b at ``WIDTH (8 b + a) + e``, int32.
        b: Number of the block, integer.
        count: Number of leading elements that are subtracted, integer; the others repeat the last of them.
        forces: Forces on the modes 1, x, y, xy, z, xz, yz, xyz, eight tuples (x, y, z) of three SIMD vectors.
    """
    at = 8 * WIDTH * b
    v = transform(forces)
    if count < WIDTH:
        v = (
            only_first(v[0], count),
            only_first(v[1], count),
            only_first(v[2], count),
            only_first(v[3], count),
            only_first(v[4], count),
            only_first(v[5], count),
            only_first(v[6], count),
            only_first(v[7], count),
        )
    subtract(values, cells, at, v[0])
    subtract(values, cells, at + WIDTH, v[1])
    subtract(values, cells, at + 2 * WIDTH, v[2])
    subtract(values, cells, at + 3 * WIDTH, v[3])
    subtract(values, cells, at + 4 * WIDTH, v[4])
    subtract(values, cells, at + 5 * WIDTH, v[5])
    subtract(values, cells, at + 6 * WIDTH, v[6])
    subtract(values, cells, at + 7 * WIDTH, v[7])
