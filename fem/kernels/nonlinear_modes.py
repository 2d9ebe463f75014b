"""Numba kernels of the incompatible modes of sixteen hexahedra, see ``kernels.nonlinear_hexahedron``."""

from numba import njit

from reflowshock.fem.kernels.box_rotation import X, Y, Z
from reflowshock.fem.kernels.lanes import (
    LANE_OPTIONS,
    LANES,
    add_elastic,
    applied,
    cofactor,
    cross,
    determinant,
    full,
    nine,
    put_nine,
    put_six,
    put_three,
    scaled,
    six,
    three,
    times,
    transposed,
)
from reflowshock.fem.kernels.nonlinear_parent import SIDE

# Slots of the workspace after F and R: transformed midpoint positions, their change, n_k, sums of xi_k s over the Gauss
# points before and after the step, the same sums of the strains, then residual and operator of the linear system.
MIDDLE, CHANGE, NORMAL, BEFORE, AFTER, SUMS, RESIDUAL, OPERATOR, ALL_SLOTS = (
    LANES * n for n in (58, 82, 106, 115, 133, 151, 169, 178, 232)
)


@njit(**LANE_OPTIONS)
def write_normals(w):
    """Write n_k, the gradients of the parent coordinates at the centres of sixteen hexahedra in the middle of the step.

    Args:
        w: Flat workspace of ``ALL_SLOTS`` entries, entry k of element e at ``16 * k + e``; reads the transformed
            positions (sums and differences over the corners) in the middle of the step at ``MIDDLE`` [m], writes the
            three vectors n_1, n_2, n_3 at ``NORMAL``.
    """
    for lane in range(LANES):
        a, b, c = three(w, MIDDLE + X + lane), three(w, MIDDLE + Y + lane), three(w, MIDDLE + Z + lane)
        u, v, t = cross(b, c), cross(c, a), cross(a, b)
        s = 1.0 / (a[0] * u[0] + a[1] * u[1] + a[2] * u[2])
        put_nine(
            w,
            NORMAL + lane,
            (s * u[0], s * u[1], s * u[2], s * v[0], s * v[1], s * v[2], s * t[0], s * t[1], s * t[2]),
        )


@njit(**LANE_OPTIONS)
def write_sums(values, w, at):
    """Write the sums of xi_k s, k = 1 to 3, over the Gauss points of sixteen hexahedra, for six scalars s per point.

    xi_k are the parent coordinates of the Gauss points, from -1 to 1.

    Args:
        values: Stresses or strain increments of each Gauss point, entry i of element e in column ``16 * i + e``, shape
            (8, >= 96).
        w: Flat workspace, of which 288 entries are written: the sum of entry i for xi_k of element e at ``at + 16 * (6
            (k - 1) + i) + e``.
        at: Position of the first sum in ``w``, integer: ``BEFORE`` or ``AFTER`` for stresses before or after the step,
            ``SUMS`` for strains.
    """
    for i in range(6 * LANES):
        a, b, c, d = values[0, i], values[1, i], values[2, i], values[3, i]
        e, f, g, h = values[4, i], values[5, i], values[6, i], values[7, i]
        w[at + i] = SIDE * ((b - a) + (d - c) + (f - e) + (h - g))
        w[at + 6 * LANES + i] = SIDE * ((c - a) + (d - b) + (g - e) + (h - f))
        w[at + 12 * LANES + i] = SIDE * ((e - a) + (f - b) + (g - c) + (h - d))


@njit(**LANE_OPTIONS)
def write_trial(w, elastic):
    """Write the forces on the modes of sixteen hexahedra after an elastic step with modes at rest: (S_k + C T_k) n_k.

    For the mode k = 1 to 3, S_k and T_k are the sums of xi_k s over the Gauss points for the stresses s before the step
    and for the strain increments of the step, n_k is the gradient of the parent coordinate xi_k at the centre, C the
    elasticity.

    Args:
        w: Flat workspace of ``ALL_SLOTS`` entries, entry k of element e at ``16 * k + e``; reads S_k at ``BEFORE``, T_k
            at ``SUMS`` (six entries xx, yy, zz, xy, yz, xz for each k), the vectors n_k at ``NORMAL``; writes the three
            force vectors at ``RESIDUAL``.
        elastic: Nine scalars [Pa]: C_xx, C_yy, C_zz, C_xy, C_yz, C_xz (normal), G_xy, G_yz, G_xz.
    """
    for lane in range(LANES):
        u, v, t = three(w, NORMAL + lane), three(w, NORMAL + 3 * LANES + lane), three(w, NORMAL + 6 * LANES + lane)
        a = add_elastic(six(w, BEFORE + lane), six(w, SUMS + lane), elastic)
        b = add_elastic(six(w, BEFORE + 6 * LANES + lane), six(w, SUMS + 6 * LANES + lane), elastic)
        c = add_elastic(six(w, BEFORE + 12 * LANES + lane), six(w, SUMS + 12 * LANES + lane), elastic)
        put_three(w, RESIDUAL + lane, applied(full(a), u))
        put_three(w, RESIDUAL + 3 * LANES + lane, applied(full(b), v))
        put_three(w, RESIDUAL + 6 * LANES + lane, applied(full(c), t))


@njit(**LANE_OPTIONS)
def strain_of(a, n):
    """Return the strain -sym(a (x) n) as six scalars xx, yy, zz, xy, yz, xz (engineering shear).

    Args:
        a: Vector of three scalars, such as the step of a mode.
        n: Vector of three scalars, such as the gradient of the mode.
    """
    return (
        -a[0] * n[0],
        -a[1] * n[1],
        -a[2] * n[2],
        -a[0] * n[1] - a[1] * n[0],
        -a[1] * n[2] - a[2] * n[1],
        -a[0] * n[2] - a[2] * n[0],
    )


@njit(**LANE_OPTIONS)
def add_remainder(w, energy):
    """Subtract the work of the residual forces on the modes in a step from the hourglass energy of sixteen hexahedra.

    Each element has three incompatible modes, to which belong six sums of stresses and six strains each.

    Args:
        w: Flat workspace of ``ALL_SLOTS`` entries, entry k of element e at ``16 * k + e``; reads, 18 entries each, the
            sums of the stresses over the Gauss points before and after the step at ``BEFORE`` and ``AFTER`` [Pa], and
            the strains of the modes at ``SUMS``.
        energy: Hourglass energy, shape (16,) [J], updated.
    """
    for lane in range(LANES):
        total = 0.0
        for k in range(0, 18 * LANES, LANES):
            total += (w[BEFORE + k + lane] + w[AFTER + k + lane]) * w[SUMS + k + lane]
        energy[lane] -= 0.5 * total


@njit(**LANE_OPTIONS)
def elastic_block(m, n, elastic):
    """Return B(m)^T C B(n) as nine scalars, row by row; B(m) is the strain of a vector field with gradient m.

    Args:
        m: Gradient of the first field, three scalars.
        n: Gradient of the second field, three scalars.
        elastic: Nine scalars [Pa]: C_xx, C_yy, C_zz, C_xy, C_yz, C_xz (normal), G_xy, G_yz, G_xz.
    """
    xx, yy, zz, xy, yz, xz, gxy, gyz, gxz = elastic
    return (
        xx * m[0] * n[0] + gxy * m[1] * n[1] + gxz * m[2] * n[2],
        xy * m[0] * n[1] + gxy * m[1] * n[0],
        xz * m[0] * n[2] + gxz * m[2] * n[0],
        xy * m[1] * n[0] + gxy * m[0] * n[1],
        yy * m[1] * n[1] + gxy * m[0] * n[0] + gyz * m[2] * n[2],
        yz * m[1] * n[2] + gyz * m[2] * n[1],
        xz * m[2] * n[0] + gxz * m[0] * n[2],
        yz * m[2] * n[1] + gyz * m[1] * n[2],
        zz * m[2] * n[2] + gxz * m[0] * n[0] + gyz * m[1] * n[1],
    )


@njit(**LANE_OPTIONS)
def write_operator(w, coupling, elastic):
    """Write the elastic operator of the three modes of sixteen hexahedra as six 3 x 3 blocks: 11 22 33 12 23 13.

    Args:
        w: Flat workspace of ``ALL_SLOTS`` entries, entry k of element e at ``16 * k + e``; reads the three vectors n_k
            at ``NORMAL``, writes the blocks (nine entries each, row by row) at ``OPERATOR``.
        coupling: Sums of xi_k xi_l / w over the Gauss points for kl = 11 22 33 12 23 13, sum i of element e at
            ``16 * i + e``, shape (96,) [1/m^3].
        elastic: Nine scalars [Pa]: C_xx, C_yy, C_zz, C_xy, C_yz, C_xz (normal), G_xy, G_yz, G_xz.
    """
    for lane in range(LANES):
        u, v, t = three(w, NORMAL + lane), three(w, NORMAL + 3 * LANES + lane), three(w, NORMAL + 6 * LANES + lane)
        c = six(coupling, lane)
        put_nine(w, OPERATOR + lane, scaled(c[0], elastic_block(u, u, elastic)))
        put_nine(w, OPERATOR + 9 * LANES + lane, scaled(c[1], elastic_block(v, v, elastic)))
        put_nine(w, OPERATOR + 18 * LANES + lane, scaled(c[2], elastic_block(t, t, elastic)))
        put_nine(w, OPERATOR + 27 * LANES + lane, scaled(c[3], elastic_block(u, v, elastic)))
        put_nine(w, OPERATOR + 36 * LANES + lane, scaled(c[4], elastic_block(v, t, elastic)))
        put_nine(w, OPERATOR + 45 * LANES + lane, scaled(c[5], elastic_block(u, t, elastic)))


@njit(**LANE_OPTIONS)
def inverse(m):
    """Return the inverse of a 3 x 3 matrix; both are nine scalars, row by row."""
    c = cofactor(m)
    return scaled(1.0 / determinant(m, c), transposed(c))


@njit(**LANE_OPTIONS)
def minus(m, n):
    """Return m - n for two 3 x 3 matrices; all three are nine scalars, row by row."""
    return (
        m[0] - n[0], m[1] - n[1], m[2] - n[2], m[3] - n[3], m[4] - n[4],
        m[5] - n[5], m[6] - n[6], m[7] - n[7], m[8] - n[8],
    )  # fmt: skip


@njit(**LANE_OPTIONS)
def less(v, m, u):
    """Return v - m u as three scalars; m: 3 x 3 matrix, nine scalars row by row; v and u: vectors of three scalars."""
    p = applied(m, u)
    return v[0] - p[0], v[1] - p[1], v[2] - p[2]


@njit(**LANE_OPTIONS)
def solve_modes(w):
    """Solve operator x = residual for the modes of sixteen elements, and write the strains of their steps -x.

    The nine unknowns of a lane are solved by block elimination with 3 x 3 blocks.

    Args:
        w: Flat workspace of ``ALL_SLOTS`` entries, entry k of element e at ``16 * k + e``: reads six 3 x 3 blocks of
            the operator at ``OPERATOR``, three vectors of residual forces at ``RESIDUAL`` and three mode gradients at
            ``NORMAL``; replaces the three strains (xx, yy, zz, xy, yz, xz each) at ``SUMS``.
    """
    for lane in range(LANES):
        a12, a23 = nine(w, OPERATOR + 27 * LANES + lane), nine(w, OPERATOR + 36 * LANES + lane)
        a13 = nine(w, OPERATOR + 45 * LANES + lane)
        i1 = inverse(nine(w, OPERATOR + lane))
        l21, l31 = times(transposed(a12), i1), times(transposed(a13), i1)
        i2 = inverse(minus(nine(w, OPERATOR + 9 * LANES + lane), times(l21, a12)))
        a23 = minus(a23, times(l21, a13))
        l32 = times(transposed(a23), i2)
        i3 = inverse(minus(minus(nine(w, OPERATOR + 18 * LANES + lane), times(l31, a13)), times(l32, a23)))
        r1 = three(w, RESIDUAL + lane)
        r2 = less(three(w, RESIDUAL + 3 * LANES + lane), l21, r1)
        r3 = less(less(three(w, RESIDUAL + 6 * LANES + lane), l31, r1), l32, r2)
        x3 = applied(i3, r3)
        x2 = applied(i2, less(r2, a23, x3))
        x1 = applied(i1, less(less(r1, a12, x2), a13, x3))
        put_six(w, SUMS + lane, strain_of(x1, three(w, NORMAL + lane)))
        put_six(w, SUMS + 6 * LANES + lane, strain_of(x2, three(w, NORMAL + 3 * LANES + lane)))
        put_six(w, SUMS + 12 * LANES + lane, strain_of(x3, three(w, NORMAL + 6 * LANES + lane)))
