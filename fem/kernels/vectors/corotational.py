"""Stress of small strains in a frame that turns with the element, for vectors of elements; see ``box_rotation``."""

from numba import njit

from reflowshock.fem.kernels.box_rotation import spin
from reflowshock.fem.kernels.lanes import full, times
from reflowshock.fem.kernels.vectors.vector import VECTOR_OPTIONS


@njit(**VECTOR_OPTIONS)
def stress_of(k, e):
    """Return the stress times volume T = V C : E as six SIMD vectors xx, yy, zz, xy, yz, xz [J].

    Args:
        k: V times C_xx, C_yy, C_zz, C_xy, C_yz, C_xz, G_xy, G_yz, G_xz, nine SIMD vectors of ``WIDTH`` lanes [J].
        e: Strain E = U - 1, six SIMD vectors xx, yy, zz, xy, yz, xz with tensor shear.
    """
    return (
        k[0] * e[0] + k[3] * e[1] + k[5] * e[2],
        k[3] * e[0] + k[1] * e[1] + k[4] * e[2],
        k[5] * e[0] + k[4] * e[1] + k[2] * e[2],
        2.0 * k[6] * e[3],
        2.0 * k[7] * e[4],
        2.0 * k[8] * e[5],
    )


@njit(**VECTOR_OPTIONS)
def twice_energy(k, e):
    """Return T : E, twice the energy of the mean strain, a SIMD vector of ``WIDTH`` lanes [J].

    Args:
        k: Volume V times C_xx, C_yy, C_zz, C_xy, C_yz, C_xz, G_xy, G_yz, G_xz, nine SIMD vectors [J].
        e: Strain E = U - 1, six SIMD vectors xx, yy, zz, xy, yz, xz with tensor shear.
    """
    t = stress_of(k, e)
    return t[0] * e[0] + t[1] * e[1] + t[2] * e[2] + 2.0 * (t[3] * e[3] + t[4] * e[4] + t[5] * e[5])


@njit(**VECTOR_OPTIONS)
def force_on_gradient(k, r, e, moment):
    """Return P = R (T - [w]x), the derivative of the energy by F, nine SIMD vectors row by row [J].

    Args:
        k: Volume V times C_xx, C_yy, C_zz, C_xy, C_yz, C_xz, G_xy, G_yz, G_xz, nine SIMD vectors of ``WIDTH`` lanes
            [J].
        r: Rotation R, nine SIMD vectors row by row.
        e: Strain E = U - 1, six SIMD vectors xx, yy, zz, xy, yz, xz with tensor shear.
        moment: Moment of the other forces in the rotated frame, tuple (x, y, z) of three SIMD vectors [J].
    """
    t = full(stress_of(k, e))
    m = times(t, full(e))
    u = e[0] + 1.0, e[1] + 1.0, e[2] + 1.0, e[3], e[4], e[5]
    x, y, z = spin(u, (m[7] - m[5] + moment[0], m[2] - m[6] + moment[1], m[3] - m[1] + moment[2]))
    return times(r, (t[0], t[1] + z, t[2] - y, t[3] - z, t[4], t[5] + x, t[6] + y, t[7] - x, t[8]))
