"""Numba kernels of corotational elastic boxes (finite rotations, small strains), in rows of equal boxes or in blocks.

The mean deformation of a box, F = R U, has the stretch U = 1 + E. The higher modes q_k of its eight nodes have the
components q^_k = R^T q_k in the corotated frame, where the strain energy equals the energy of the linear box,
V E : C E / 2 + sum over k, l of q^_k . H_kl q^_l / 2. The force is its exact derivative. With T = V C : E,
Q^ = H q^ and M = T U,

    P = R (T - [w]x),    (tr(U) 1 - U) w = axial(M - M^T) + sum over k of q^_k x Q^_k

is the force on F and R Q^_k the force on q_k; [w]x is the matrix of the cross product. It arises because a change of F
rotates the frame by omega, (tr(U) 1 - U) omega = axial(R^T dF - dF^T R). Energy and momenta are conserved.

Rows, lines and faces: ``kernels.box_rows``, modes: ``force_congruent``, lanes: ``kernels.lanes``. The workspace
``w`` has component c of mode p of box e at 16 (3 p + c) + e, entries of F at 384 + 16 i + e, of R at 528 + 16 i + e.
"""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.box_rows import COLUMNS, FIRST, add_transform, transform_lines
from reflowshock.fem.kernels.lanes import (
    LANE_OPTIONS,
    LANES,
    applied,
    cofactor_symmetric,
    full,
    nine,
    put_nine,
    put_three,
    three,
    times,
    transposed,
)
from reflowshock.fem.kernels.nonlinear import rotate, stretch

DEFORMATION, ROTATION, TURNED_SLOTS = (LANES * k for k in (24, 33, 42))
WIDTH = COLUMNS + LANES
SCALE = 27 * LANES  # where the scales of sixteen boxes follow on their constants
UPRIGHT = -1  # no box is turned inside out
X, Y, Z, XY, XZ, YZ, XYZ = (3 * LANES * p for p in (1, 2, 4, 3, 5, 6, 7))  # slots of the modes, by their parity


@njit(**LANE_OPTIONS)
def read_modes(faces, start, w):
    """Write the modes of the boxes ``start`` to ``start + 15`` of a row from the face values at its nodes.

    Args:
        faces: Component c of face parity k at node i at ``(4 c + k) WIDTH + FIRST + i``, shape (12 WIDTH,) [m].
        start: Number of the first of the sixteen boxes in the row, integer.
        w: Workspace (672,); writes component c of mode p (bit d: odd along d) of box e to ``16 (3 p + c) + e`` [m].
    """
    for k in range(4):
        values, modes = faces[k * WIDTH + FIRST + start :], w[6 * LANES * k :]
        for lane in range(LANES):
            a, b = values[lane], values[lane + 1]
            c, d = values[4 * WIDTH + lane], values[4 * WIDTH + lane + 1]
            e, f = values[8 * WIDTH + lane], values[8 * WIDTH + lane + 1]
            put_three(modes, lane, (a + b, c + d, e + f))
            put_three(modes, 3 * LANES + lane, (a - b, c - d, e - f))


@njit(**LANE_OPTIONS)
def add_faces(w, start, count, faces):
    """Add the forces on the modes of boxes of a row to the face values at its nodes, the transpose of ``read_modes``.

    Args:
        w: Workspace (672,); force on component c of mode p (bit d: odd along d) of box e at ``16 (3 p + c) + e`` [N].
        start: Number of the first of the sixteen boxes in the row, integer.
        count: Number of these boxes that are added, integer; the others repeat the last box of the row.
        faces: Component c of face parity k at node i at ``(4 c + k) WIDTH + FIRST + i``, (12 WIDTH,) [N], added to.
    """
    for k in range(4):
        values, modes = faces[k * WIDTH + FIRST + start :], w[6 * LANES * k :]
        for lane in range(count):
            a, b = three(modes, lane), three(modes, 3 * LANES + lane)
            values[lane] += a[0] + b[0]
            values[4 * WIDTH + lane] += a[1] + b[1]
            values[8 * WIDTH + lane] += a[2] + b[2]
        for lane in range(count):
            a, b = three(modes, lane), three(modes, 3 * LANES + lane)
            values[lane + 1] += a[0] - b[0]
            values[4 * WIDTH + lane + 1] += a[1] - b[1]
            values[8 * WIDTH + lane + 1] += a[2] - b[2]


@njit(**LANE_OPTIONS)
def transform_corners(w):
    """Replace the values at eight corners of sixteen elements by their Walsh-Hadamard transform, in place.

    ``w (>= 384,)``: component c of corner a of element e, then of mode a (bit d: odd along d), at ``16 (3 a + c) + e``.
    """
    for component in range(3):
        v = w[LANES * component :]
        for lane in range(LANES):
            a, b = v[lane] + v[X + lane], v[lane] - v[X + lane]
            c, d = v[Y + lane] + v[XY + lane], v[Y + lane] - v[XY + lane]
            e, f = v[Z + lane] + v[XZ + lane], v[Z + lane] - v[XZ + lane]
            g, h = v[YZ + lane] + v[XYZ + lane], v[YZ + lane] - v[XYZ + lane]
            a, b, c, d, e, f, g, h = a + c, b + d, a - c, b - d, e + g, f + h, e - g, f - h
            v[lane], v[X + lane], v[Y + lane], v[XY + lane] = a + e, b + f, c + g, d + h
            v[Z + lane], v[XZ + lane], v[YZ + lane], v[XYZ + lane] = a - e, b - f, c - g, d - h


@njit(**LANE_OPTIONS)
def write_deformation(k, w):
    """Write the mean deformation gradients F of sixteen boxes to the workspace.

    Args:
        k: Constants, shape (480,): entry i of box e at ``16 i + e``; 27 elastic ones, then -1 / (4 h) in x, y, z [1/m].
        w: Workspace (672,): reads mode p of box e at ``16 (3 p + c) + e`` [m], writes F, row by row, at ``384 + 16 i +
            e``.
    """
    for lane in range(LANES):
        scale, x, y, z = three(k, SCALE + lane), three(w, X + lane), three(w, Y + lane), three(w, Z + lane)
        f = (
            1.0 + scale[0] * x[0], scale[1] * y[0], scale[2] * z[0],
            scale[0] * x[1], 1.0 + scale[1] * y[1], scale[2] * z[1],
            scale[0] * x[2], scale[1] * y[2], 1.0 + scale[2] * z[2],
        )  # fmt: skip
        put_nine(w, DEFORMATION + lane, f)


@njit(**LANE_OPTIONS)
def stress(k, u):
    """Return the stress of a box times its volume, T = V C : (U - 1), as six scalars xx, yy, zz, xy, yz, xz [J].

    ``u``: stretch U, six scalars in this order; ``k``: nine scalars or more, V times C_xx, C_yy, C_zz, C_xy, C_yz,
    C_xz, G_xy, G_yz, G_xz [J].
    """
    x, y, z = u[0] - 1.0, u[1] - 1.0, u[2] - 1.0
    return (
        k[0] * x + k[3] * y + k[5] * z,
        k[3] * x + k[1] * y + k[4] * z,
        k[5] * x + k[4] * y + k[2] * z,
        2.0 * k[6] * u[3],
        2.0 * k[7] * u[4],
        2.0 * k[8] * u[5],
    )


@njit(**LANE_OPTIONS)
def resistance(k, a, b, c, d):
    """Return the elastic forces Q^ [N] on the modes xy, xz, yz, xyz, four tuples (x, y, z).

    All entries are scalars of one box, or all are SIMD vectors of several boxes.

    Args:
        k: Constants: volume times elasticity, 9 entries [J], then the stiffness of these modes, 18 entries [N/m].
        a: Amplitude of the mode xy, tuple (x, y, z) [m].
        b: Amplitude of the mode xz, tuple (x, y, z) [m].
        c: Amplitude of the mode yz, tuple (x, y, z) [m].
        d: Amplitude of the mode xyz, tuple (x, y, z) [m].
    """
    return (
        (k[18] * a[0] + k[19] * c[2], k[15] * a[1] + k[16] * b[2], k[11] * c[0] + k[13] * b[1] + k[14] * a[2]),
        (k[21] * b[0] + k[22] * c[1], k[10] * c[0] + k[12] * b[1] + k[13] * a[2], k[16] * a[1] + k[17] * b[2]),
        (k[9] * c[0] + k[10] * b[1] + k[11] * a[2], k[22] * b[0] + k[23] * c[1], k[19] * a[0] + k[20] * c[2]),
        (k[24] * d[0], k[25] * d[1], k[26] * d[2]),
    )


@njit(**LANE_OPTIONS)
def add_cross(m, a, b):
    """Return m + a x b, a tuple (x, y, z); all arguments are tuples of three scalars, or of three SIMD vectors."""
    return m[0] + a[1] * b[2] - a[2] * b[1], m[1] + a[2] * b[0] - a[0] * b[2], m[2] + a[0] * b[1] - a[1] * b[0]


@njit(**LANE_OPTIONS)
def spin(u, moment):
    """Return w with (tr(U) 1 - U) w = ``moment``, a tuple (x, y, z); entries are scalars, or all SIMD vectors.

    Args:
        u: Stretch U, six entries xx, yy, zz, xy, yz, xz.
        moment: Right-hand side, tuple (x, y, z) [J]; w has the same unit.
    """
    t = u[1] + u[2], u[0] + u[2], u[0] + u[1], -u[3], -u[4], -u[5]
    c = cofactor_symmetric(t)
    s = 1.0 / (t[0] * c[0] + t[3] * c[3] + t[5] * c[5])
    return applied(full(c), (s * moment[0], s * moment[1], s * moment[2]))


@njit(**LANE_OPTIONS)
def resist(k, w):
    """Replace the modes xy, xz, yz, xyz of sixteen boxes by the forces on them [N]; write their moments [J] to mode 0.

    Args:
        k: Constants, shape (480,): entry i of box e at ``16 i + e``; 27 elastic ones [J, N/m] come first.
        w: Workspace (672,): modes p = 3, 5, 6, 7 at ``16 (3 p + c) + e`` [m], rotations R at ``528 + 16 i + e``.
    """
    for lane in range(LANES):
        back = transposed(nine(w, ROTATION + lane))
        a, b = applied(back, three(w, XY + lane)), applied(back, three(w, XZ + lane))
        c, d = applied(back, three(w, YZ + lane)), applied(back, three(w, XYZ + lane))
        fa, fb, fc, fd = resistance(own_constants(k, lane), a, b, c, d)
        moment = add_cross(add_cross((0.0, 0.0, 0.0), a, fa), b, fb)
        put_three(w, lane, add_cross(add_cross(moment, c, fc), d, fd))
        put_three(w, XY + lane, fa)
        put_three(w, XZ + lane, fb)
        put_three(w, YZ + lane, fc)
        put_three(w, XYZ + lane, fd)


@njit(**LANE_OPTIONS)
def write_stress(k, w):
    """Replace deformation gradients F of sixteen boxes by nominal stresses times volume P [J], the forces on F.

    Args:
        k: Constants, shape (480,): entry i of box e at ``16 i + e``; the first nine are volume times elasticity [J].
        w: Workspace (672,): F, then P, of box e row by row at ``384 + 16 i + e``; reads its rotation R at ``528 + 16 i
            + e`` and the moment of its higher modes at ``16 c + e`` [J].
    """
    for lane in range(LANES):
        r, higher = nine(w, ROTATION + lane), three(w, lane)
        u = stretch(r, nine(w, DEFORMATION + lane))
        t = full(stress(nine(k, lane), u))
        m = times(t, full(u))
        x, y, z = spin(u, (m[7] - m[5] + higher[0], m[2] - m[6] + higher[1], m[3] - m[1] + higher[2]))
        p = times(r, (t[0], t[1] + z, t[2] - y, t[3] - z, t[4], t[5] + x, t[6] + y, t[7] - x, t[8]))
        put_nine(w, DEFORMATION + lane, p)


@njit(**LANE_OPTIONS)
def write_linear_forces(k, w):
    """Write the forces [N] on constant and linear modes of sixteen boxes to the workspace.

    Args:
        k: Constants, shape (480,): entry i of box e at ``16 i + e``; the last three are -1 / (4 h) in x, y, z [1/m].
        w: Workspace (672,): reads stress P at ``384 + 16 i + e`` [J], writes modes p = 0 (zero), 1, 2, 4 to ``16 (3 p +
            c) + e``.
    """
    for lane in range(LANES):
        p, scale = nine(w, DEFORMATION + lane), three(k, SCALE + lane)
        put_three(w, lane, (0.0, 0.0, 0.0))
        put_three(w, X + lane, (scale[0] * p[0], scale[0] * p[3], scale[0] * p[6]))
        put_three(w, Y + lane, (scale[1] * p[1], scale[1] * p[4], scale[1] * p[7]))
        put_three(w, Z + lane, (scale[2] * p[2], scale[2] * p[5], scale[2] * p[8]))


@njit(**LANE_OPTIONS)
def turn_higher(w):
    """Rotate the forces [N] on the modes xy, xz, yz, xyz of sixteen boxes by their rotations R, in place.

    ``w (672,)``: component c for p = 3, 5, 6, 7 of box e at ``16 (3 p + c) + e``, R row by row at ``528 + 16 i + e``.
    """
    for lane in range(LANES):
        r = nine(w, ROTATION + lane)
        put_three(w, XY + lane, applied(r, three(w, XY + lane)))
        put_three(w, XZ + lane, applied(r, three(w, XZ + lane)))
        put_three(w, YZ + lane, applied(r, three(w, YZ + lane)))
        put_three(w, XYZ + lane, applied(r, three(w, XYZ + lane)))


@njit(cache=True)
def replace_by_forces(k, w):
    """Replace the modes [m] of sixteen boxes by the forces on them [N].

    The loops are short and unrolled: only then does the compiler vectorise them.

    Args:
        k: Constants, shape (480,): entry i of box e at ``16 i + e``; 27 elastic ones [J, N/m], then -1 / (4 h) in x, y,
            z [1/m].
        w: Workspace (672,): mode p of box e, then its force, at ``16 (3 p + c) + e``; reads rotation R at ``528 + 16 i
            + e`` and F at ``384 + 16 i + e`` (overwritten).
    """
    resist(k, w)
    write_stress(k, w)
    write_linear_forces(k, w)
    turn_higher(w)


@njit(**LANE_OPTIONS)
def own_constants(k, lane):
    """Return the 27 constants of one box: volume times elasticity, 9 scalars [J], stiffness of higher modes, 18 [N/m].

    Args:
        k: Constants of sixteen boxes, shape (480,): entry i of box e at ``16 i + e``.
        lane: Number of the box, 0 to 15.
    """
    return nine(k, lane) + nine(k, 9 * LANES + lane) + nine(k, 18 * LANES + lane)


@njit(cache=True)
def spread_shape(constants, scale, k):
    """Copy the constants of one shape to sixteen boxes.

    Args:
        constants: Volume times elasticity, 9 entries [J], then stiffness of the higher modes, 18 entries [N/m]; shape
            (27,).
        scale: -1 / (4 h) along x, y, z with the edge lengths h, shape (3,) [1/m].
        k: Written: entry i of box e at ``16 i + e``, first ``constants``, then ``scale``; shape (480,).
    """
    for i in range(27):
        k[LANES * i : LANES * (i + 1)] = constants[i]
    for i in range(3):
        k[SCALE + LANES * i : SCALE + LANES * (i + 1)] = scale[i]


@njit(cache=True)
def box_energies(w, lane, k):
    """Return the energies of the mean strain and of the higher modes of one box, two scalars [J].

    Args:
        w: Workspace (672,): component c of mode p at ``16 (3 p + c) + lane`` [m], deformation gradient F at ``384 + 16
            i + lane``, rotation R at ``528 + 16 i + lane``.
        lane: Number of the box in the workspace, 0 to 15.
        k: Constants of the box: volume times elasticity, 9 scalars [J], stiffness of the higher modes, 18 scalars
            [N/m].
    """
    higher, r = 0.0, nine(w, ROTATION + lane)
    u, back = stretch(r, nine(w, DEFORMATION + lane)), transposed(r)
    t = stress(k[:9], u)
    mean = 0.5 * (t[0] * (u[0] - 1.0) + t[1] * (u[1] - 1.0) + t[2] * (u[2] - 1.0))
    mean += t[3] * u[3] + t[4] * u[4] + t[5] * u[5]
    a, b = applied(back, three(w, XY + lane)), applied(back, three(w, XZ + lane))
    c, d = applied(back, three(w, YZ + lane)), applied(back, three(w, XYZ + lane))
    fa, fb, fc, fd = resistance(k, a, b, c, d)
    for i in range(3):
        higher += 0.5 * (a[i] * fa[i] + b[i] * fb[i] + c[i] * fc[i] + d[i] * fd[i])
    return mean, higher


@njit(cache=True)
def repeat_last(w, count):
    """Copy the modes of the last of ``count`` boxes to the following boxes of a workspace of sixteen.

    Args:
        w: Workspace (>= 384,), changed in place: component c of mode p of box e at ``16 (3 p + c) + e`` [m].
        count: Number of boxes, integer; from 16 on nothing is copied.
    """
    for slot in range(0, DEFORMATION, LANES):
        for lane in range(count, LANES):
            w[slot + lane] = w[slot + count - 1]


@njit(cache=True)
def add_turned_row_forces(rows, scales, constants, displacement, force):
    """Add the internal force of rows of equal corotational boxes; the caller subtracts it.

    Args:
        rows: Positions where the four lines of a row begin, number of boxes, shape index; shape (nr, 6) int32.
        scales: -1 / (4 h) of each shape along x, y, z with the edge lengths h, shape (ns, 3) [1/m].
        constants: Volume times elasticity [J] and stiffness of higher modes [N/m] of each shape, shape (ns, 27).
        displacement: Displacement at the positions of the lines, shape (3, >= p + PAD) [m].
        force: Force at the positions, shape (3, >= p + PAD) [N], added to.

    Returns:
        ``UPRIGHT`` (-1), or the first row with a box that is turned inside out; then the force is not complete.
    """
    faces, forces, w = np.zeros((3, 4, WIDTH)), np.zeros((3, 4, WIDTH)), np.zeros(TURNED_SLOTS)
    k = np.empty(SCALE + 3 * LANES)
    for r in range(len(rows)):
        starts, count, shape = rows[r, :4], rows[r, 4], rows[r, 5]
        spread_shape(constants[shape], scales[shape], k)
        for c in range(3):
            transform_lines(displacement[c], starts, count + 1, faces[c])
        forces[:, :, FIRST : FIRST + count + 1] = 0.0
        for start in range(0, count, LANES):
            read_modes(faces.reshape(-1), start, w)
            repeat_last(w, count - start)
            write_deformation(k, w)
            if not rotate(w[DEFORMATION:]):
                return r
            replace_by_forces(k, w)
            add_faces(w, start, min(LANES, count - start), forces.reshape(-1))
        for c in range(3):
            add_transform(forces[c], starts, count + 1, force[c])
    return UPRIGHT


@njit(cache=True)
def row_energies(rows, scales, constants, displacement):
    """Return the total energies of mean strains and of higher modes of rows of boxes, two scalars [J].

    Args:
        rows: Positions where the four lines of a row begin, number of boxes, shape index; shape (nr, 6) int32.
        scales: -1 / (4 h) of each shape along x, y, z with the edge lengths h, shape (ns, 3) [1/m].
        constants: Volume times elasticity [J] and stiffness of higher modes [N/m] of each shape, shape (ns, 27).
        displacement: Displacement at the positions of the lines, shape (3, >= p + PAD) [m].
    """
    faces, w, k = np.zeros((3, 4, WIDTH)), np.zeros(TURNED_SLOTS), np.empty(SCALE + 3 * LANES)
    mean = higher = 0.0
    for r in range(len(rows)):
        starts, count, shape = rows[r, :4], rows[r, 4], rows[r, 5]
        spread_shape(constants[shape], scales[shape], k)
        for c in range(3):
            transform_lines(displacement[c], starts, count + 1, faces[c])
        for start in range(0, count, LANES):
            read_modes(faces.reshape(-1), start, w)
            repeat_last(w, count - start)
            write_deformation(k, w)
            rotate(w[DEFORMATION:])
            for lane in range(min(LANES, count - start)):
                energies = box_energies(w, lane, own_constants(k, lane))
                mean += energies[0]
                higher += energies[1]
    return mean, higher
