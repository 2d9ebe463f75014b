"""Polar decomposition F = R (1 + E) of deformation gradients, for vectors of elements.

With A = F^T F - 1, the rotation is R = F (1 + A)^(-1/2). Where A is small, the series of the inverse square root is
evaluated by Horner's rule on polynomials p + q A + r A^2, since A^3 = i_1 A^2 - i_2 A + i_3 (Cayley and Hamilton); E
then has no error of cancellation either. Otherwise Newton's iteration X -> (X + X^-T) / 2 (Higham 1986) starts from F.
"""

from numba import njit

from reflowshock.fem.kernels.lanes import cofactor, cofactor_symmetric, determinant, full, times
from reflowshock.fem.kernels.vectors.memory import all_below
from reflowshock.fem.kernels.vectors.vector import VECTOR_OPTIONS

SERIES = (-1 / 2, 3 / 8, -5 / 16, 35 / 128, -63 / 256, 231 / 1024, -429 / 2048, 6435 / 32768, -12155 / 65536)
SMALL = 0.025**2  # squared norm of A below which the first term left out is below rounding
POLAR_ITERATIONS = 40  # stretches of 1e6 need 25
POLAR_CONVERGED = 1e-18  # squared change after which the next one is below rounding (quadratic convergence)


@njit(**VECTOR_OPTIONS)
def polar(f):
    """Return rotation R and strain E = U - 1 of F = R U, and whether det F > 0 in all lanes.

    Args:
        f: Deformation gradient F, nine SIMD vectors of ``WIDTH`` lanes, row by row.

    Returns:
        R, nine SIMD vectors row by row; E, six SIMD vectors xx, yy, zz, xy, yz, xz with tensor shear; and a boolean. If
        it is False, R and E are meaningless.
    """
    a = metric_change(f)
    square = a[0] * a[0] + a[1] * a[1] + a[2] * a[2] + 2.0 * (a[3] * a[3] + a[4] * a[4] + a[5] * a[5])
    upright = all_below(-determinant(f, cofactor(f)), 0.0)
    if all_below(square, SMALL):
        r, e = by_series(f, a)
        return r, e, upright
    r = f
    if upright:
        r = by_newton(f)
    return r, strain(r, f), upright


@njit(**VECTOR_OPTIONS)
def metric_change(f):
    """Return F^T F - 1 as six SIMD vectors xx, yy, zz, xy, yz, xz.

    Args:
        f: Deformation gradient F, nine SIMD vectors of ``WIDTH`` lanes, row by row.
    """
    return (
        f[0] * f[0] + f[3] * f[3] + f[6] * f[6] - 1.0,
        f[1] * f[1] + f[4] * f[4] + f[7] * f[7] - 1.0,
        f[2] * f[2] + f[5] * f[5] + f[8] * f[8] - 1.0,
        f[0] * f[1] + f[3] * f[4] + f[6] * f[7],
        f[1] * f[2] + f[4] * f[5] + f[7] * f[8],
        f[0] * f[2] + f[3] * f[5] + f[6] * f[8],
    )


@njit(**VECTOR_OPTIONS)
def by_series(f, a):
    """Return R and E = U - 1 of small strains: nine SIMD vectors row by row, and six xx, yy, zz, xy, yz, xz.

    Args:
        f: Deformation gradient F, nine SIMD vectors row by row.
        a: F^T F - 1, six SIMD vectors xx, yy, zz, xy, yz, xz.
    """
    minors = cofactor_symmetric(a)
    i1, i2 = a[0] + a[1] + a[2], minors[0] + minors[1] + minors[2]
    i = i1, i2, a[0] * minors[0] + a[3] * minors[3] + a[5] * minors[5]
    c = SERIES[8] * i[2], SERIES[6] - SERIES[8] * i2, SERIES[7] + SERIES[8] * i1
    c = times_a(c, SERIES[5], i)
    c = times_a(c, SERIES[4], i)
    c = times_a(c, SERIES[3], i)
    c = times_a(c, SERIES[2], i)
    c = times_a(c, SERIES[1], i)
    c = times_a(c, SERIES[0], i)
    d, change = times_a(c, 0.0, i), times(f, full(polynomial(c, a, minors, i)))
    rotation = (
        f[0] + change[0], f[1] + change[1], f[2] + change[2],
        f[3] + change[3], f[4] + change[4], f[5] + change[5],
        f[6] + change[6], f[7] + change[7], f[8] + change[8],
    )  # fmt: skip
    return rotation, polynomial((c[0] + d[0], c[1] + d[1] + 1.0, c[2] + d[2]), a, minors, i)


@njit(**VECTOR_OPTIONS)
def times_a(c, constant, i):
    """Return the coefficients of 1, A, A^2 of the product A (p + q A + r A^2), three SIMD vectors.

    Args:
        c: Coefficients p, q, r, three SIMD vectors.
        constant: Scalar that is added to p before the product.
        i: Invariants i_1, i_2, i_3 of A, three SIMD vectors.
    """
    p = c[0] + constant
    return c[2] * i[2], p - c[2] * i[1], c[1] + c[2] * i[0]


@njit(**VECTOR_OPTIONS)
def polynomial(c, a, minors, i):
    """Return p + q A + r A^2 as six SIMD vectors xx, yy, zz, xy, yz, xz, with A^2 = i_1 A - i_2 + cof A.

    Args:
        c: Coefficients p, q, r, three SIMD vectors.
        a: Symmetric matrix A, six SIMD vectors xx, yy, zz, xy, yz, xz.
        minors: Cofactor matrix of A, six SIMD vectors in this order.
        i: Invariants i_1, i_2, i_3 of A, three SIMD vectors.
    """
    d, g, r = c[0] - c[2] * i[1], c[1] + c[2] * i[0], c[2]
    return (
        d + g * a[0] + r * minors[0],
        d + g * a[1] + r * minors[1],
        d + g * a[2] + r * minors[2],
        g * a[3] + r * minors[3],
        g * a[4] + r * minors[4],
        g * a[5] + r * minors[5],
    )


@njit(**VECTOR_OPTIONS)
def by_newton(f):
    """Return the rotation R of F by Newton's iteration, nine SIMD vectors row by row.

    Args:
        f: Deformation gradient F, nine SIMD vectors row by row; det F must be positive in all lanes.
    """
    x = f
    for _ in range(POLAR_ITERATIONS):
        c = cofactor(x)
        scale = 0.5 / determinant(x, c)
        d = (
            scale * c[0] - 0.5 * x[0], scale * c[1] - 0.5 * x[1], scale * c[2] - 0.5 * x[2],
            scale * c[3] - 0.5 * x[3], scale * c[4] - 0.5 * x[4], scale * c[5] - 0.5 * x[5],
            scale * c[6] - 0.5 * x[6], scale * c[7] - 0.5 * x[7], scale * c[8] - 0.5 * x[8],
        )  # fmt: skip
        x = (
            x[0] + d[0], x[1] + d[1], x[2] + d[2],
            x[3] + d[3], x[4] + d[4], x[5] + d[5],
            x[6] + d[6], x[7] + d[7], x[8] + d[8],
        )  # fmt: skip
        change = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + d[3] * d[3] + d[4] * d[4]
        if all_below(change + d[5] * d[5] + d[6] * d[6] + d[7] * d[7] + d[8] * d[8], POLAR_CONVERGED):
            break
    return x


@njit(**VECTOR_OPTIONS)
def strain(r, f):
    """Return U - 1 = R^T F - 1, made symmetric, as six SIMD vectors xx, yy, zz, xy, yz, xz with tensor shear.

    Args:
        r: Rotation R, nine SIMD vectors of ``WIDTH`` lanes, row by row.
        f: Deformation gradient F, nine SIMD vectors row by row.
    """
    return (
        r[0] * f[0] + r[3] * f[3] + r[6] * f[6] - 1.0,
        r[1] * f[1] + r[4] * f[4] + r[7] * f[7] - 1.0,
        r[2] * f[2] + r[5] * f[5] + r[8] * f[8] - 1.0,
        0.5 * (r[0] * f[1] + r[3] * f[4] + r[6] * f[7] + r[1] * f[0] + r[4] * f[3] + r[7] * f[6]),
        0.5 * (r[1] * f[2] + r[4] * f[5] + r[7] * f[8] + r[2] * f[1] + r[5] * f[4] + r[8] * f[7]),
        0.5 * (r[0] * f[2] + r[3] * f[5] + r[6] * f[8] + r[2] * f[0] + r[5] * f[3] + r[8] * f[6]),
    )
