"""Numba kernels of corotational elastic hexahedra of any shape (finite rotations, small strains), in sixteen lanes.

As ``kernels.box_rotation``, with the mean gradients and the hourglass stiffness of each element. In the transformed
nodal values q_p, p a parity of ``force_congruent``, the mean deformation is F = 1 + sum over p of q_p (x) b_p, and the
hourglass part of the mode k of xy, xz, yz, xyz is g_k = q_k - (F - 1) c_k, c_k the transform of the corners. The energy
is the energy of the linear element in the frame that rotates with F = R U,

    W = V E : C E / 2 + sum over k, l of g^_k . H_kl g^_l / 2,    E = U - 1, g^_k = R^T g_k,

and the force its exact derivative: with P as in ``box_rotation`` and G_k = R (H g^)_k, that on F at fixed q_k is
D = P - sum over k of G_k (x) c_k; that on q_p is D b_p, of the four modes with G_k.

Slots of the workspace ``w``, in units of lanes: the modes, F and R as in ``box_rotation``, room for the rest of
``kernels.nonlinear``, then g^ of the modes xy, xz, yz, xyz as A, B, C, D, and H g^ of them. Offsets are constants: only
then does the compiler know that nothing overlaps.
"""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.box_rotation import (
    DEFORMATION,
    ROTATION,
    UPRIGHT,
    XY,
    XYZ,
    XZ,
    YZ,
    X,
    Y,
    Z,
    add_cross,
    spin,
    stress,
    transform_corners,
)
from reflowshock.fem.kernels.lanes import (
    LANE_OPTIONS,
    LANES,
    applied,
    full,
    gather_lanes,
    nine,
    put_nine,
    put_three,
    scatter_lanes,
    six,
    three,
    times,
    transposed,
)
from reflowshock.fem.kernels.nonlinear import rotate, stretch

A, B, C, D, SHIFT, SLOTS = (LANES * n for n in (58, 61, 64, 67, 12, 82))
# Entries of an element: V C as in ``box_rotation.stress``, b_p of p = 1 to 7, c_k, then H in blocks of the modes: aa,
# bb, cc, dd with six entries each, ab, ac, ad, bc, bd, cd with nine.
GRADIENT, CORNERS, STIFFNESS = 9 * LANES, 30 * LANES, 42 * LANES


@njit(**LANE_OPTIONS)
def add_product(f, a, b):
    """Return f + a (x) b as nine scalars, row by row.

    Args:
        f: 3 x 3 matrix, nine scalars row by row.
        a: Vector, three scalars.
        b: Vector, three scalars.
    """
    return (
        f[0] + a[0] * b[0], f[1] + a[0] * b[1], f[2] + a[0] * b[2],
        f[3] + a[1] * b[0], f[4] + a[1] * b[1], f[5] + a[1] * b[2],
        f[6] + a[2] * b[0], f[7] + a[2] * b[1], f[8] + a[2] * b[2],
    )  # fmt: skip


@njit(**LANE_OPTIONS)
def write_mean_deformation(k, w, unit):
    """Write the mean deformation gradient F of sixteen elements.

    Args:
        k: Constants of the elements (V C, b_p, c_k, H), entry i of element e at ``16 * i + e``, shape (1920,); reads
            the mean gradients b_p [1/m].
        w: Flat workspace of ``SLOTS`` entries in the same order; reads the transformed displacements [m], writes F at
            ``DEFORMATION``, nine entries row by row.
        unit: 1.0, or 0.0 to write the displacement gradient F - 1 instead of F; a scalar.
    """
    b = k[GRADIENT - 3 * LANES :]
    for lane in range(LANES):
        f = add_product((unit, 0.0, 0.0, 0.0, unit, 0.0, 0.0, 0.0, unit), three(w, X + lane), three(b, X + lane))
        f = add_product(f, three(w, Y + lane), three(b, Y + lane))
        f = add_product(f, three(w, Z + lane), three(b, Z + lane))
        f = add_product(f, three(w, XY + lane), three(b, XY + lane))
        f = add_product(f, three(w, XZ + lane), three(b, XZ + lane))
        f = add_product(f, three(w, YZ + lane), three(b, YZ + lane))
        put_nine(w, DEFORMATION + lane, add_product(f, three(w, XYZ + lane), three(b, XYZ + lane)))


@njit(**LANE_OPTIONS)
def amplitude(c, q, r, f, unit):
    """Return the hourglass amplitude g^ = R^T (q - (F - 1) c) of one mode in the rotated frame, three scalars [m].

    Args:
        c: Transform of the corners for the mode, three scalars [m].
        q: Transformed displacement of the mode, three scalars [m].
        r: Rotation R, nine scalars row by row.
        f: F if ``unit`` is 1.0, F - 1 if it is 0.0; nine scalars.
        unit: 1.0 or 0.0, see ``f``; a scalar.
    """
    moved = applied(f, c)
    x, y, z = q[0] - moved[0] + unit * c[0], q[1] - moved[1] + unit * c[1], q[2] - moved[2] + unit * c[2]
    return applied(transposed(r), (x, y, z))


@njit(**LANE_OPTIONS)
def write_amplitudes(k, w, unit):
    """Write the hourglass amplitudes g^ [m] of sixteen elements at the slots ``A`` to ``D`` of the workspace.

    Args:
        k: Constants of the elements, entry i of element e at ``16 * i + e``, shape (1920,); reads the transformed
            corners c_k [m].
        w: Flat workspace of ``SLOTS`` entries in the same order, with transformed displacements [m], F (or F - 1) at
            ``DEFORMATION`` and R at ``ROTATION``; written at ``A`` to ``D``, three components of one mode each.
        unit: 1.0 if the workspace has F, 0.0 if it has F - 1; a scalar.
    """
    for lane in range(LANES):
        r, f = nine(w, ROTATION + lane), nine(w, DEFORMATION + lane)
        put_three(w, A + lane, amplitude(three(k, CORNERS + lane), three(w, XY + lane), r, f, unit))
        put_three(w, B + lane, amplitude(three(k, CORNERS + 3 * LANES + lane), three(w, XZ + lane), r, f, unit))
        put_three(w, C + lane, amplitude(three(k, CORNERS + 6 * LANES + lane), three(w, YZ + lane), r, f, unit))
        put_three(w, D + lane, amplitude(three(k, CORNERS + 9 * LANES + lane), three(w, XYZ + lane), r, f, unit))


@njit(**LANE_OPTIONS)
def add_applied(v, m, a):
    """Return v + m a as three scalars; m is a 3 x 3 matrix (nine scalars, row by row), v and a are vectors."""
    b = applied(m, a)
    return v[0] + b[0], v[1] + b[1], v[2] + b[2]


@njit(**LANE_OPTIONS)
def write_resistance(k, w):
    """Write the hourglass forces H g^ [N] of sixteen elements, at the slots ``A + SHIFT`` to ``D + SHIFT``.

    Args:
        k: Constants of the elements, entry i of element e at ``16 * i + e``, shape (1920,); reads the stiffness H
            [N/m], 3 x 3 blocks of the four modes; off-diagonal blocks are stored once and act twice.
        w: Flat workspace of ``SLOTS`` entries in the same order, with the amplitudes g^ [m] at ``A`` to ``D``, three
            components each; the forces are written ``SHIFT`` entries after them.
    """
    for lane in range(LANES):
        a, b, c, d = three(w, A + lane), three(w, B + lane), three(w, C + lane), three(w, D + lane)
        at = STIFFNESS + lane
        fa, fb = applied(full(six(k, at)), a), applied(full(six(k, at + 6 * LANES)), b)
        fc, fd = applied(full(six(k, at + 12 * LANES)), c), applied(full(six(k, at + 18 * LANES)), d)
        ab, ac, ad = nine(k, at + 24 * LANES), nine(k, at + 33 * LANES), nine(k, at + 42 * LANES)
        fa = add_applied(add_applied(add_applied(fa, ab, b), ac, c), ad, d)
        put_three(w, A + SHIFT + lane, fa)
        bc, bd, cd = nine(k, at + 51 * LANES), nine(k, at + 60 * LANES), nine(k, at + 69 * LANES)
        fb = add_applied(add_applied(add_applied(fb, transposed(ab), a), bc, c), bd, d)
        put_three(w, B + SHIFT + lane, fb)
        fc = add_applied(add_applied(add_applied(fc, transposed(ac), a), transposed(bc), b), cd, d)
        put_three(w, C + SHIFT + lane, fc)
        fd = add_applied(add_applied(add_applied(fd, transposed(ad), a), transposed(bd), b), transposed(cd), c)
        put_three(w, D + SHIFT + lane, fd)


@njit(**LANE_OPTIONS)
def write_stress(k, w):
    """Replace F of sixteen elements by P, the derivative of the energy by F (nominal stress times volume).

    Args:
        k: Constants of the elements, entry i of element e at ``16 * i + e``, shape (1920,); reads the elastic constants
            times volume, V C [J].
        w: Flat workspace of ``SLOTS`` entries in the same order, with R at ``ROTATION``, the amplitudes g^ at ``A`` to
            ``D`` [m] and the forces H g^ ``SHIFT`` entries after them [N]; F at ``DEFORMATION`` becomes P [J].
    """
    for lane in range(LANES):
        r = nine(w, ROTATION + lane)
        u = stretch(r, nine(w, DEFORMATION + lane))
        t = full(stress(nine(k, lane), u))
        m = times(t, full(u))
        moment = m[7] - m[5], m[2] - m[6], m[3] - m[1]
        moment = add_cross(moment, three(w, A + lane), three(w, A + SHIFT + lane))
        moment = add_cross(moment, three(w, B + lane), three(w, B + SHIFT + lane))
        moment = add_cross(moment, three(w, C + lane), three(w, C + SHIFT + lane))
        x, y, z = spin(u, add_cross(moment, three(w, D + lane), three(w, D + SHIFT + lane)))
        p = times(r, (t[0], t[1] + z, t[2] - y, t[3] - z, t[4], t[5] + x, t[6] + y, t[7] - x, t[8]))
        put_nine(w, DEFORMATION + lane, p)


@njit(**LANE_OPTIONS)
def replace_by_turned_forces(k, w):
    """Replace the transformed displacements of sixteen elements by the forces on them [N].

    Args:
        k: Constants of the elements (V C [J], b_p [1/m], c_k [m], H [N/m]), entry i of element e at ``16 * i + e``,
            shape (1920,).
        w: Flat workspace of ``SLOTS`` entries with P at ``DEFORMATION`` [J], R at ``ROTATION`` and the forces H g^ at
            ``A + SHIFT`` to ``D + SHIFT`` [N]; its first 24 entries of sixteen elements are overwritten.
    """
    b = k[GRADIENT - 3 * LANES :]
    for lane in range(LANES):
        r, d, c = nine(w, ROTATION + lane), nine(w, DEFORMATION + lane), CORNERS + lane
        ga, gb = applied(r, three(w, A + SHIFT + lane)), applied(r, three(w, B + SHIFT + lane))
        gc, gd = applied(r, three(w, C + SHIFT + lane)), applied(r, three(w, D + SHIFT + lane))
        d = less_product(less_product(d, ga, three(k, c)), gb, three(k, c + 3 * LANES))
        d = less_product(less_product(d, gc, three(k, c + 6 * LANES)), gd, three(k, c + 9 * LANES))
        put_three(w, lane, (0.0, 0.0, 0.0))
        put_three(w, X + lane, applied(d, three(b, X + lane)))
        put_three(w, Y + lane, applied(d, three(b, Y + lane)))
        put_three(w, Z + lane, applied(d, three(b, Z + lane)))
        put_three(w, XY + lane, add_applied(ga, d, three(b, XY + lane)))
        put_three(w, XZ + lane, add_applied(gb, d, three(b, XZ + lane)))
        put_three(w, YZ + lane, add_applied(gc, d, three(b, YZ + lane)))
        put_three(w, XYZ + lane, add_applied(gd, d, three(b, XYZ + lane)))


@njit(**LANE_OPTIONS)
def less_product(f, a, b):
    """Return f - a (x) b as nine scalars, row by row.

    Args:
        f: 3 x 3 matrix, nine scalars row by row.
        a: Vector, three scalars.
        b: Vector, three scalars.
    """
    return add_product(f, (-a[0], -a[1], -a[2]), b)


@njit(cache=True)
def read_block(cells, displacement, k, w):
    """Write transformed displacements, F, R, hourglass amplitudes g^ and forces H g^ of sixteen elements.

    Args:
        cells: Nodes of the elements, node a of element e in ``cells[a, e]``, shape (8, 16) int32.
        displacement: Nodal displacement, shape (n, 3) [m].
        k: Constants of the elements (V C [J], b_p [1/m], c_k [m], H [N/m]), entry i of element e at ``16 * i + e``,
            shape (1920,).
        w: Flat workspace of ``SLOTS`` entries, written: transformed displacements [m] first, F at ``DEFORMATION``, R at
            ``ROTATION``, g^ at ``A`` to ``D`` [m], H g^ at ``A + SHIFT`` to ``D + SHIFT`` [N].

    Returns:
        Whether no element is turned inside out; if one is, the results are meaningless.
    """
    gather_lanes(cells, displacement, w)
    transform_corners(w)
    write_mean_deformation(k, w, 1.0)
    upright = rotate(w[DEFORMATION:])
    write_amplitudes(k, w, 1.0)
    write_resistance(k, w)
    return upright


@njit(cache=True)
def add_turned_forces(cells, filled, constants, displacement, force):
    """Subtract the internal force of corotational elastic hexahedra of any shapes.

    Args:
        cells: Nodes of the elements in tensor order, in blocks of sixteen elements, shape (nb, 8, 16) int32; elements
            after the last one repeat it.
        filled: Number of elements of each block, shape (nb,) int32.
        constants: 120 constants of each element (V C [J], b_p [1/m], c_k [m], H [N/m]), entry i of element e at ``16 *
            i + e``, shape (nb, 1920).
        displacement: Nodal displacement, shape (n, 3) [m].
        force: Nodal force, shape (n, 3) [N], subtracted from.

    Returns:
        ``UPRIGHT`` (-1), or the first block with an element that is turned inside out; then the force is not complete.
    """
    w = np.empty(SLOTS)
    for b in range(len(cells)):
        if not read_block(cells[b], displacement, constants[b], w):
            return b
        write_stress(constants[b], w)
        replace_by_turned_forces(constants[b], w)
        transform_corners(w)
        scatter_lanes(cells[b], filled[b], w, force)
    return UPRIGHT


@njit(cache=True)
def turned_energies(cells, filled, constants, displacement):
    """Return the total energies of mean strains and of hourglass modes, two scalars [J].

    Args:
        cells: Nodes of the elements in tensor order, in blocks of sixteen elements, shape (nb, 8, 16) int32; elements
            after the last one repeat it and are not counted.
        filled: Number of elements of each block, shape (nb,) int32.
        constants: 120 constants of each element (V C [J], b_p [1/m], c_k [m], H [N/m]), entry i of element e at
            ``16 * i + e``, shape (nb, 1920).
        displacement: Nodal displacement, shape (n, 3) [m].
    """
    w = np.zeros(SLOTS)
    mean = higher = 0.0
    for b in range(len(cells)):
        k = constants[b]
        read_block(cells[b], displacement, k, w)
        for lane in range(np.int64(filled[b])):
            u = stretch(nine(w, ROTATION + lane), nine(w, DEFORMATION + lane))
            t = stress(nine(k, lane), u)
            mean += 0.5 * (t[0] * (u[0] - 1.0) + t[1] * (u[1] - 1.0) + t[2] * (u[2] - 1.0))
            mean += t[3] * u[3] + t[4] * u[4] + t[5] * u[5]
            for i in range(12):
                higher += 0.5 * w[A + LANES * i + lane] * w[A + SHIFT + LANES * i + lane]
    return mean, higher
