"""Numba kernels of the incompatible modes of sixteen hexahedra: gradients, forces, elastic operator."""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.lanes import (
    LANE_OPTIONS,
    LANES,
    applied,
    cofactor,
    cofactor_symmetric,
    determinant,
    full,
    nine,
    put_nine,
    put_three,
    scaled,
    six,
    three,
    times,
    transposed,
)
from reflowshock.fem.kernels.nonlinear import DEFORMATION, NOMINAL

PAIRS = ((0, 0, 0), (1, 1, 1), (2, 2, 2), (0, 1, 3), (1, 2, 4), (0, 2, 5))  # k, l, place in a symmetric matrix


@njit(**LANE_OPTIONS)
def add_modes(w, turned, normal, xi, weight):
    """Add the gradients of the incompatible modes at a Gauss point."""
    a, b, c = xi
    for lane in range(LANES):
        f = nine(w, DEFORMATION + lane)
        m, n = nine(turned, lane), nine(normal, lane)
        s = 1.0 / weight[lane]
        u, v, t = a * s, b * s, c * s
        new = (
            f[0] + u * m[0] * n[0] + v * m[3] * n[3] + t * m[6] * n[6],
            f[1] + u * m[0] * n[1] + v * m[3] * n[4] + t * m[6] * n[7],
            f[2] + u * m[0] * n[2] + v * m[3] * n[5] + t * m[6] * n[8],
            f[3] + u * m[1] * n[0] + v * m[4] * n[3] + t * m[7] * n[6],
            f[4] + u * m[1] * n[1] + v * m[4] * n[4] + t * m[7] * n[7],
            f[5] + u * m[1] * n[2] + v * m[4] * n[5] + t * m[7] * n[8],
            f[6] + u * m[2] * n[0] + v * m[5] * n[3] + t * m[8] * n[6],
            f[7] + u * m[2] * n[1] + v * m[5] * n[4] + t * m[8] * n[7],
            f[8] + u * m[2] * n[2] + v * m[5] * n[5] + t * m[8] * n[8],
        )
        put_nine(w, DEFORMATION + lane, new)


@njit(**LANE_OPTIONS)
def add_residual(w, normal, xi, residual):
    """Add the force of a Gauss point on the modes: xi_k P N_k."""
    for k in range(3):
        factor = xi[k]
        n, r = normal[3 * LANES * k :], residual[3 * LANES * k :]
        for lane in range(LANES):
            v = applied(nine(w, NOMINAL + lane), three(n, lane))
            r[lane] += factor * v[0]
            r[LANES + lane] += factor * v[1]
            r[2 * LANES + lane] += factor * v[2]


@njit(**LANE_OPTIONS)
def elastic_block(m, n, elastic):
    """Return B(m)^T C B(n), B the strain of a field with gradient m: 3 x 3."""
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
def push_normals(frame, normals):
    """Turn N_k into U_0^-1 N_k, in place; U_0 is in the frame behind the rotation."""
    for k in range(3):
        v = normals[3 * LANES * k :]
        for lane in range(LANES):
            u = six(frame, 9 * LANES + lane)
            c = cofactor_symmetric(u)
            scale = 1.0 / (u[0] * c[0] + u[3] * c[3] + u[5] * c[5])
            put_three(v, lane, applied(scaled(scale, full(c)), three(v, lane)))


@njit(**LANE_OPTIONS)
def write_operator(n, coupling, elastic, result):
    """Write the six different 3 x 3 blocks of the modes' elastic operator ``(16 * 54,)``, order xx yy zz xy yz xz."""
    c = (
        elastic[0], elastic[1], elastic[2], elastic[3], elastic[4], elastic[5], elastic[6], elastic[7], elastic[8],
    )  # fmt: skip
    for k, m, place in PAIRS:
        first, second, block = n[3 * LANES * k :], n[3 * LANES * m :], result[9 * LANES * place :]
        factor = coupling[LANES * place :]
        for lane in range(LANES):
            put_nine(block, lane, scaled(factor[lane], elastic_block(three(first, lane), three(second, lane), c)))


@njit(**LANE_OPTIONS)
def inverse(m):
    """Return the inverse of a 3 x 3 matrix."""
    c = cofactor(m)
    return scaled(1.0 / determinant(m, c), transposed(c))


@njit(**LANE_OPTIONS)
def minus(m, n):
    """Return the difference of two matrices."""
    return (
        m[0] - n[0], m[1] - n[1], m[2] - n[2], m[3] - n[3], m[4] - n[4],
        m[5] - n[5], m[6] - n[6], m[7] - n[7], m[8] - n[8],
    )  # fmt: skip


@njit(**LANE_OPTIONS)
def less(v, m, u):
    """Return v - m u."""
    p = applied(m, u)
    return v[0] - p[0], v[1] - p[1], v[2] - p[2]


@njit(**LANE_OPTIONS)
def correct_modes(operator, residual, modes, change):
    """Subtract the operator's inverse times the residual ``(16 * 9,)``, the change, from the modes, by blocks."""
    for lane in range(LANES):
        a12, a23 = nine(operator, 27 * LANES + lane), nine(operator, 36 * LANES + lane)
        a13 = nine(operator, 45 * LANES + lane)
        i1 = inverse(nine(operator, lane))
        l21, l31 = times(transposed(a12), i1), times(transposed(a13), i1)
        i2 = inverse(minus(nine(operator, 9 * LANES + lane), times(l21, a12)))
        a23 = minus(a23, times(l21, a13))
        l32 = times(transposed(a23), i2)
        i3 = inverse(minus(minus(nine(operator, 18 * LANES + lane), times(l31, a13)), times(l32, a23)))
        r1 = three(residual, lane)
        r2 = less(three(residual, 3 * LANES + lane), l21, r1)
        r3 = less(less(three(residual, 6 * LANES + lane), l31, r1), l32, r2)
        x3 = applied(i3, r3)
        x2 = applied(i2, less(r2, a23, x3))
        x1 = applied(i1, less(less(r1, a12, x2), a13, x3))
        put_three(change, lane, x1)
        put_three(change, 3 * LANES + lane, x2)
        put_three(change, 6 * LANES + lane, x3)
    for k in range(0, 9 * LANES, LANES):
        for lane in range(LANES):
            modes[k + lane] -= change[k + lane]


@njit(**LANE_OPTIONS)
def add_remainder(residual, change, before, energy):
    """Add the work of the mean residual of a step on minus the change of the modes; keep the residual."""
    for lane in range(LANES):
        total = 0.0
        for k in range(0, 9 * LANES, LANES):
            total += (residual[k + lane] + before[k + lane]) * change[k + lane]
        energy[lane] += 0.5 * total
    before[:] = residual


@njit(**LANE_OPTIONS)
def write_inverse(normal, result):
    """Write the inverse of the Jacobian at the centre J_0 from N = -2 det(J_0) J_0^-1: det N = -8 det(J_0)^2."""
    for lane in range(LANES):
        n = nine(normal, lane)
        put_nine(result, lane, scaled(-1.0 / np.sqrt(-0.5 * determinant(n, cofactor(n))), n))
