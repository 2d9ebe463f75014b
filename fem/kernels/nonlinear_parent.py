"""Numba kernels of trilinear fields on sixteen hexahedra: monomials of the parent cube, gradients, linear fit.

A field is sum_p c_p xi^p; bit d of p tells whether xi_d is a factor: c_p = sum_a s_pa u_a / 8 with s_pa = +-1, a
product of sides.
"""

from numba import njit

from reflowshock.fem.kernels.lanes import LANE_OPTIONS, LANES, nine


@njit(**LANE_OPTIONS)
def signed_sums(v):
    """Return sum_a s_pa v_a of eight values for each p; the transformation is its own transpose up to the sign of p."""
    a, b, c, d, e, f, g, h = v
    a, b, c, d, e, f, g, h = a + b, b - a, c + d, d - c, e + f, f - e, g + h, h - g
    a, b, c, d, e, f, g, h = a + c, b + d, c - a, d - b, e + g, f + h, g - e, h - f
    return a + e, b + f, c + g, d + h, e - a, f - b, g - c, h - d


@njit(**LANE_OPTIONS)
def eight(values, at):
    """Return one component at the eight nodes of a lane."""
    return (
        values[at],
        values[at + 3 * LANES],
        values[at + 6 * LANES],
        values[at + 9 * LANES],
        values[at + 12 * LANES],
        values[at + 15 * LANES],
        values[at + 18 * LANES],
        values[at + 21 * LANES],
    )


@njit(**LANE_OPTIONS)
def gather_monomials(nodal, monomials):
    """Write the monomials ``(16 * 24,)`` of nodal values ``(16 * 24,)``."""
    for i in range(3):
        source, target = nodal[LANES * i :], monomials[LANES * i :]
        for lane in range(LANES):
            c = signed_sums(eight(source, lane))
            for p in range(8):
                target[3 * LANES * p + lane] = 0.125 * c[p]


@njit(**LANE_OPTIONS)
def scatter_monomials(monomials, nodal):
    """Write the nodal forces of forces on the monomials, sum_p s_pa q_p / 8."""
    for i in range(3):
        source, target = monomials[LANES * i :], nodal[LANES * i :]
        for lane in range(LANES):
            a, b, c, d, e, f, g, h = eight(source, lane)
            v = signed_sums((a, -b, -c, d, -e, f, g, -h))
            signed = (v[0], -v[1], -v[2], v[3], -v[4], v[5], v[6], -v[7])
            for p in range(8):
                target[3 * LANES * p + lane] = 0.125 * signed[p]


@njit(**LANE_OPTIONS)
def point_gradient(monomials, xi, inverse, result):
    """Write the gradient at a point of the parent cube as the first nine entries of ``result``.

    Args:
        monomials: ``(16 * 24,)``.
        xi: Three coordinates.
        inverse: ``(16 * 9,)`` inverse Jacobian dxi_j/dx_k.
        result: ``(16 * 9 or more,)``.
    """
    x, y, z = xi
    for i in range(3):
        c, row = monomials[LANES * i :], result[3 * LANES * i :]
        for lane in range(LANES):
            v = eight(c, lane)
            dx = v[1] + v[3] * y + v[5] * z + v[7] * (y * z)
            dy = v[2] + v[3] * x + v[6] * z + v[7] * (x * z)
            dz = v[4] + v[5] * x + v[6] * y + v[7] * (x * y)
            m = nine(inverse, lane)
            row[lane] = dx * m[0] + dy * m[3] + dz * m[6]
            row[LANES + lane] = dx * m[1] + dy * m[4] + dz * m[7]
            row[2 * LANES + lane] = dx * m[2] + dy * m[5] + dz * m[8]


@njit(**LANE_OPTIONS)
def add_point_monomials(nominal, xi, inverse, monomials):
    """Add the force on the monomials of the weighted nominal stress ``(16 * 9,)`` at a point: the transpose."""
    x, y, z = xi
    for i in range(3):
        row, q = nominal[3 * LANES * i :], monomials[LANES * i :]
        for lane in range(LANES):
            m = nine(inverse, lane)
            a, b, c = row[lane], row[LANES + lane], row[2 * LANES + lane]
            dx = a * m[0] + b * m[1] + c * m[2]
            dy = a * m[3] + b * m[4] + c * m[5]
            dz = a * m[6] + b * m[7] + c * m[8]
            q[3 * LANES + lane] += dx
            q[6 * LANES + lane] += dy
            q[9 * LANES + lane] += dx * y + dy * x
            q[12 * LANES + lane] += dz
            q[15 * LANES + lane] += dx * z + dz * x
            q[18 * LANES + lane] += dy * z + dz * y
            q[21 * LANES + lane] += dx * (y * z) + dy * (x * z) + dz * (x * y)


@njit(**LANE_OPTIONS)
def fit(basis, weight, values, result):
    """Write the least-squares fit of values at the Gauss points ``(16 * 8,)`` by four orthonormal functions."""
    result[:] = 0.0
    for k in range(4):
        function = basis[8 * LANES * k :]
        for lane in range(LANES):
            coefficient = 0.0
            for g in range(8):
                coefficient += weight[LANES * g + lane] * function[LANES * g + lane] * values[LANES * g + lane]
            for g in range(8):
                result[LANES * g + lane] += coefficient * function[LANES * g + lane]
