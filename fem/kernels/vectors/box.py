"""Numba kernels of corotational boxes of any shapes in blocks of ``WIDTH``; formulas in ``kernels.box_rotation``.

Blocks of equal boxes share a pattern, so that the constants of a graded mesh stay in the cache. Entry i of element e of
a pattern is at ``WIDTH i + e``: 27 constants of ``force_corotational.box_constants`` [J, N/m], then the three scales
-1 / (4 h) with the edge lengths h [1/m].
"""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.box_rotation import UPRIGHT, add_cross, resistance
from reflowshock.fem.kernels.lanes import LANE_OPTIONS, applied, transposed
from reflowshock.fem.kernels.vectors.corotational import force_on_gradient, twice_energy
from reflowshock.fem.kernels.vectors.memory import broadcast, first_lanes, nine, place, prefetch_range, three, total
from reflowshock.fem.kernels.vectors.modes import dot, read_modes, subtract_modes
from reflowshock.fem.kernels.vectors.polar import polar
from reflowshock.fem.kernels.vectors.vector import VECTOR_OPTIONS, WIDTH

SCALE, ENTRIES = 27 * WIDTH, 30 * WIDTH


@njit(**VECTOR_OPTIONS)
def mean_deformation(k, at, q):
    """Return the mean deformation gradient F of boxes, a tuple of nine SIMD vectors of ``WIDTH`` lanes, row by row.

    Args:
        k: Pointer to the constants of all patterns, float64.
        at: Position of the constants of the pattern behind ``k``, integer.
        q: Displacement modes of the eight nodes, eight tuples (x, y, z) of three SIMD vectors [m].
    """
    s, x, y, z = three(k, at + SCALE), q[1], q[2], q[4]
    return (
        s[0] * x[0] + 1.0, s[1] * y[0], s[2] * z[0],
        s[0] * x[1], s[1] * y[1] + 1.0, s[2] * z[1],
        s[0] * x[2], s[1] * y[2], s[2] * z[2] + 1.0,
    )  # fmt: skip


@njit(**VECTOR_OPTIONS)
def higher_modes(k, at, q, r):
    """Return the modes xy, xz, yz, xyz in the rotated frame [m] and the elastic forces on them [N].

    Args:
        k: Pointer to the constants of all patterns, float64.
        at: Position of the constants of the pattern behind ``k``, integer.
        q: Displacement modes of the eight nodes, eight tuples (x, y, z) of three SIMD vectors [m].
        r: Rotation R, nine SIMD vectors row by row.

    Returns:
        Modes and forces, each four tuples (x, y, z) of three SIMD vectors of ``WIDTH`` lanes.
    """
    back = transposed(r)
    a, b, c, d = applied(back, q[3]), applied(back, q[5]), applied(back, q[6]), applied(back, q[7])
    constants = nine(k, at) + nine(k, at + 9 * WIDTH) + nine(k, at + 18 * WIDTH)
    return (a, b, c, d), resistance(constants, a, b, c, d)


@njit(**VECTOR_OPTIONS)
def box_forces(k, at, q, r, e):
    """Return the forces on the modes of boxes, eight tuples (x, y, z) of three SIMD vectors of ``WIDTH`` lanes [N].

    Args:
        k: Pointer to the constants of all patterns, float64.
        at: Position of the constants of the pattern behind ``k``, integer.
        q: Displacement modes of the eight nodes, eight tuples (x, y, z) of three SIMD vectors [m].
        r: Rotation R, nine SIMD vectors row by row.
        e: Strain U - 1, six SIMD vectors xx, yy, zz, xy, yz, xz with tensor shear.
    """
    (a, b, c, d), (fa, fb, fc, fd) = higher_modes(k, at, q, r)
    none = broadcast(0.0)
    zero = none, none, none
    moment = add_cross(add_cross(add_cross(add_cross(zero, a, fa), b, fb), c, fc), d, fd)
    p, s = force_on_gradient(nine(k, at), r, e, moment), three(k, at + SCALE)
    x = s[0] * p[0], s[0] * p[3], s[0] * p[6]
    y = s[1] * p[1], s[1] * p[4], s[1] * p[7]
    z = s[2] * p[2], s[2] * p[5], s[2] * p[8]
    return zero, x, y, applied(r, fa), z, applied(r, fb), applied(r, fc), applied(r, fd)


@njit(**LANE_OPTIONS)
def add_turned_block_forces(blocks, displacement, force):
    """Subtract the internal force of corotational boxes of any shapes.

    Args:
        blocks: Four arrays: nodes of blocks in tensor order, where boxes after the last one repeat it, (nb, 8, WIDTH)
            int32; number of boxes of each block, (nb,) int32; its pattern, (nb,) int32; constants of each pattern [J,
            N/m, 1/m], (np, 30 WIDTH).
        displacement: Nodal displacement, shape (n, 3) [m].
        force: Nodal force, shape (n, 3) [N], subtracted from.

    Returns:
        ``UPRIGHT`` (-1), or the first block with a box that is turned inside out; then the force is not complete.
    """
    cells, filled, pattern, constants = blocks
    nodes, k, u, f = place(cells), place(constants), place(displacement), place(force)
    for b in range(len(filled)):
        at = ENTRIES * np.int64(pattern[b])
        if b + 1 < len(filled):
            prefetch_range(k, ENTRIES * np.int64(pattern[b + 1]), ENTRIES)
        q = read_modes(u, nodes, b)
        r, e, upright = polar(mean_deformation(k, at, q))
        if not upright:
            return b
        subtract_modes(f, nodes, b, np.int64(filled[b]), box_forces(k, at, q, r, e))
    return UPRIGHT


@njit(**LANE_OPTIONS)
def block_energies(blocks, displacement):
    """Return the total energies of mean strains and of higher modes of boxes in blocks, two scalars [J].

    Args:
        blocks: Four arrays: nodes of blocks in tensor order, (nb, 8, WIDTH) int32; number of boxes of each block, (nb,)
            int32; its pattern, (nb,) int32; constants of each pattern [J, N/m, 1/m], (np, 30 WIDTH).
        displacement: Nodal displacement, shape (n, 3) [m].
    """
    cells, filled, pattern, constants = blocks
    nodes, k, u = place(cells), place(constants), place(displacement)
    mean = higher = 0.0
    for b in range(len(filled)):
        at, count = ENTRIES * np.int64(pattern[b]), np.int64(filled[b])
        q = read_modes(u, nodes, b)
        r, e, _ = polar(mean_deformation(k, at, q))
        (v, w, x, y), (fv, fw, fx, fy) = higher_modes(k, at, q, r)
        mean += 0.5 * total(first_lanes(twice_energy(nine(k, at), e), count))
        higher += 0.5 * total(first_lanes(dot(v, fv) + dot(w, fw) + dot(x, fx) + dot(y, fy), count))
    return mean, higher
