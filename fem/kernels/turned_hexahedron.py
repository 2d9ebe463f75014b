"""Numba kernels of corotational elastic hexahedra of any shape (finite rotations, small strains), on vectors.

As ``kernels.box_rotation``, with the mean gradients and the hourglass stiffness of each element. In the transformed
nodal values q_p, p a parity of ``force_congruent``, the mean deformation is F = 1 + sum over p of q_p (x) b_p, and the
hourglass part of the mode k of xy, xz, yz, xyz is g_k = q_k - (F - 1) c_k, c_k the transform of the corners. The energy
is the energy of the linear element in the frame that rotates with F = R U,

    W = V E : C E / 2 + sum over k, l of g^_k . H_kl g^_l / 2,    E = U - 1, g^_k = R^T g_k,

and the force its exact derivative: with P as in ``box_rotation`` and G_k = R (H g^)_k, that on F at fixed q_k is
D = P - sum over k of G_k (x) c_k; that on q_p is D b_p, of the four modes with G_k.

The constants of a pattern of ``WIDTH`` elements, entry i of element e at ``WIDTH i + e``, are V C as in
``vectors.corotational``, b_p of p = 1 to 7, c_k, then H in blocks of the modes: aa, bb, cc, dd with six entries each,
ab, ac, ad, bc, bd, cd with nine. They do not fit in the fast caches: each is read once, and the next pattern is fetched
meanwhile.
"""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.box_rotation import UPRIGHT, add_cross
from reflowshock.fem.kernels.lanes import LANE_OPTIONS, applied, full, transposed
from reflowshock.fem.kernels.vectors.corotational import force_on_gradient, twice_energy
from reflowshock.fem.kernels.vectors.memory import (
    broadcast,
    first_lanes,
    nine,
    place,
    prefetch_range,
    six,
    three,
    total,
)
from reflowshock.fem.kernels.vectors.modes import dot, minus, plus, read_modes, subtract_modes
from reflowshock.fem.kernels.vectors.polar import polar
from reflowshock.fem.kernels.vectors.vector import VECTOR_OPTIONS, WIDTH

GRADIENT, CORNERS, STIFFNESS, ENTRIES = (WIDTH * n for n in (9, 30, 42, 120))
TRIPLE = 3 * WIDTH


@njit(**VECTOR_OPTIONS)
def add_product(f, a, b):
    """Return f + a (x) b, with the outer product of ``a`` and ``b``, nine SIMD vectors row by row.

    Args:
        f: Matrix, nine SIMD vectors of ``WIDTH`` lanes, row by row.
        a: Tuple (x, y, z) of three SIMD vectors, whose component is the row.
        b: Tuple (x, y, z) of three SIMD vectors, whose component is the column.
    """
    return (
        f[0] + a[0] * b[0], f[1] + a[0] * b[1], f[2] + a[0] * b[2],
        f[3] + a[1] * b[0], f[4] + a[1] * b[1], f[5] + a[1] * b[2],
        f[6] + a[2] * b[0], f[7] + a[2] * b[1], f[8] + a[2] * b[2],
    )  # fmt: skip


@njit(**VECTOR_OPTIONS)
def less_product(f, a, b):
    """Return f - a (x) b, with the outer product of ``a`` and ``b``, nine SIMD vectors row by row.

    Args:
        f: Matrix, nine SIMD vectors of ``WIDTH`` lanes, row by row.
        a: Tuple (x, y, z) of three SIMD vectors, whose component is the row.
        b: Tuple (x, y, z) of three SIMD vectors, whose component is the column.
    """
    return add_product(f, (-a[0], -a[1], -a[2]), b)


@njit(**VECTOR_OPTIONS)
def displacement_gradient(k, at, q):
    """Return the mean displacement gradient F - 1 of hexahedra, nine SIMD vectors of ``WIDTH`` lanes, row by row.

    Args:
        k: Pointer to the constants of all patterns, float64.
        at: Position of the constants of the pattern behind ``k``, integer.
        q: Displacement modes of the eight nodes, eight tuples (x, y, z) of three SIMD vectors [m].
    """
    at, none = at + GRADIENT, broadcast(0.0)
    h = add_product((none, none, none, none, none, none, none, none, none), q[1], three(k, at))
    h = add_product(h, q[2], three(k, at + TRIPLE))
    h = add_product(h, q[3], three(k, at + 2 * TRIPLE))
    h = add_product(h, q[4], three(k, at + 3 * TRIPLE))
    h = add_product(h, q[5], three(k, at + 4 * TRIPLE))
    h = add_product(h, q[6], three(k, at + 5 * TRIPLE))
    return add_product(h, q[7], three(k, at + 6 * TRIPLE))


@njit(**VECTOR_OPTIONS)
def deformation_gradient(h):
    """Return F from ``h``, the displacement gradient F - 1; both are nine SIMD vectors row by row."""
    return h[0] + 1.0, h[1], h[2], h[3], h[4] + 1.0, h[5], h[6], h[7], h[8] + 1.0


@njit(**VECTOR_OPTIONS)
def amplitudes(k, at, q, h, r):
    """Return the hourglass amplitudes g^ = R^T (q - (F - 1) c) of the modes xy, xz, yz, xyz [m].

    Args:
        k: Pointer to the constants of all patterns, float64.
        at: Position of the constants of the pattern behind ``k``, integer.
        q: Displacement modes of the eight nodes, eight tuples (x, y, z) of three SIMD vectors [m].
        h: Mean displacement gradient F - 1, nine SIMD vectors row by row.
        r: Rotation R, nine SIMD vectors row by row.

    Returns:
        Four tuples (x, y, z) of three SIMD vectors of ``WIDTH`` lanes.
    """
    at, back = at + CORNERS, transposed(r)
    return (
        applied(back, minus(q[3], applied(h, three(k, at)))),
        applied(back, minus(q[5], applied(h, three(k, at + TRIPLE)))),
        applied(back, minus(q[6], applied(h, three(k, at + 2 * TRIPLE)))),
        applied(back, minus(q[7], applied(h, three(k, at + 3 * TRIPLE)))),
    )


@njit(**VECTOR_OPTIONS)
def resistance(k, at, g):
    """Return the hourglass forces H g^ of the modes xy, xz, yz, xyz, four tuples of three SIMD vectors [N].

    Args:
        k: Pointer to the constants of all patterns, float64; off-diagonal blocks are stored once and act twice.
        at: Position of the constants of the pattern behind ``k``, integer.
        g: Amplitudes g^, four tuples (x, y, z) of three SIMD vectors [m].
    """
    a, b, c, d = g
    at = at + STIFFNESS
    fa, fb = applied(full(six(k, at)), a), applied(full(six(k, at + 6 * WIDTH)), b)
    fc, fd = applied(full(six(k, at + 12 * WIDTH)), c), applied(full(six(k, at + 18 * WIDTH)), d)
    m = nine(k, at + 24 * WIDTH)
    fa, fb = plus(fa, applied(m, b)), plus(fb, applied(transposed(m), a))
    m = nine(k, at + 33 * WIDTH)
    fa, fc = plus(fa, applied(m, c)), plus(fc, applied(transposed(m), a))
    m = nine(k, at + 42 * WIDTH)
    fa, fd = plus(fa, applied(m, d)), plus(fd, applied(transposed(m), a))
    m = nine(k, at + 51 * WIDTH)
    fb, fc = plus(fb, applied(m, c)), plus(fc, applied(transposed(m), b))
    m = nine(k, at + 60 * WIDTH)
    fb, fd = plus(fb, applied(m, d)), plus(fd, applied(transposed(m), b))
    m = nine(k, at + 69 * WIDTH)
    return fa, fb, plus(fc, applied(m, d)), plus(fd, applied(transposed(m), c))


@njit(**VECTOR_OPTIONS)
def moment_of(g, f):
    """Return the moment of hourglass forces, the sum of g^ x H g^, a tuple (x, y, z) of three SIMD vectors [J].

    Args:
        g: Amplitudes g^ of the modes xy, xz, yz, xyz, four tuples (x, y, z) of three SIMD vectors [m].
        f: Forces H g^ on these modes, four tuples (x, y, z) of three SIMD vectors [N].
    """
    none = broadcast(0.0)
    moment = add_cross(add_cross((none, none, none), g[0], f[0]), g[1], f[1])
    return add_cross(add_cross(moment, g[2], f[2]), g[3], f[3])


@njit(**VECTOR_OPTIONS)
def forces_on_modes(k, at, r, p, f):
    """Return the forces on the modes 1, x, y, xy, z, xz, yz, xyz of hexahedra, eight tuples of three SIMD vectors [N].

    Args:
        k: Pointer to the constants of all patterns, float64.
        at: Position of the constants of the pattern behind ``k``, integer.
        r: Rotation R, nine SIMD vectors of ``WIDTH`` lanes, row by row.
        p: P, the derivative of the energy by F, nine SIMD vectors row by row [J].
        f: Hourglass forces in the rotated frame, four tuples (x, y, z) of three SIMD vectors [N].
    """
    none, corners, at = broadcast(0.0), at + CORNERS, at + GRADIENT
    a, b, c, d = applied(r, f[0]), applied(r, f[1]), applied(r, f[2]), applied(r, f[3])
    p = less_product(less_product(p, a, three(k, corners)), b, three(k, corners + TRIPLE))
    p = less_product(less_product(p, c, three(k, corners + 2 * TRIPLE)), d, three(k, corners + 3 * TRIPLE))
    return (
        (none, none, none),
        applied(p, three(k, at)),
        applied(p, three(k, at + TRIPLE)),
        plus(a, applied(p, three(k, at + 2 * TRIPLE))),
        applied(p, three(k, at + 3 * TRIPLE)),
        plus(b, applied(p, three(k, at + 4 * TRIPLE))),
        plus(c, applied(p, three(k, at + 5 * TRIPLE))),
        plus(d, applied(p, three(k, at + 6 * TRIPLE))),
    )


@njit(**LANE_OPTIONS)
def add_turned_forces(blocks, displacement, force):
    """Subtract the internal force of corotational elastic hexahedra of any shapes.

    Args:
        blocks: Four arrays: nodes of blocks in tensor order, where elements after the last one repeat it, (nb, 8,
            WIDTH) int32; number of elements of each block, (nb,) int32; its pattern, (nb,) int32; constants of each
            pattern [J, 1/m, m, N/m], (np, 120 WIDTH).
        displacement: Nodal displacement, shape (n, 3) [m].
        force: Nodal force, shape (n, 3) [N], subtracted from.

    Returns:
        ``UPRIGHT`` (-1), or the first block with an element that is turned inside out; then the force is not complete.
    """
    cells, filled, pattern, constants = blocks
    nodes, k, u, f = place(cells), place(constants), place(displacement), place(force)
    for b in range(len(filled)):
        at = ENTRIES * np.int64(pattern[b])
        if b + 1 < len(filled):
            prefetch_range(k, ENTRIES * np.int64(pattern[b + 1]), ENTRIES)
        q = read_modes(u, nodes, b)
        h = displacement_gradient(k, at, q)
        r, e, upright = polar(deformation_gradient(h))
        if not upright:
            return b
        g = amplitudes(k, at, q, h, r)
        resisting = resistance(k, at, g)
        p = force_on_gradient(nine(k, at), r, e, moment_of(g, resisting))
        subtract_modes(f, nodes, b, np.int64(filled[b]), forces_on_modes(k, at, r, p, resisting))
    return UPRIGHT


@njit(**LANE_OPTIONS)
def turned_energies(blocks, displacement):
    """Return the total energies of mean strains and of hourglass modes, two scalars [J].

    Args:
        blocks: Four arrays: nodes of blocks in tensor order, (nb, 8, WIDTH) int32; number of elements of each block,
            (nb,) int32; its pattern, (nb,) int32; constants of each pattern [J, 1/m, m, N/m], (np, 120 WIDTH).
        displacement: Nodal displacement, shape (n, 3) [m].
    """
    cells, filled, pattern, constants = blocks
    nodes, k, u = place(cells), place(constants), place(displacement)
    mean = higher = 0.0
    for b in range(len(filled)):
        at, count = ENTRIES * np.int64(pattern[b]), np.int64(filled[b])
        q = read_modes(u, nodes, b)
        h = displacement_gradient(k, at, q)
        r, e, _ = polar(deformation_gradient(h))
        g = amplitudes(k, at, q, h, r)
        f = resistance(k, at, g)
        stored = dot(g[0], f[0]) + dot(g[1], f[1]) + dot(g[2], f[2]) + dot(g[3], f[3])
        mean += 0.5 * total(first_lanes(twice_energy(nine(k, at), e), count))
        higher += 0.5 * total(first_lanes(stored, count))
    return mean, higher
