"""Numba kernels of one integration point of sixteen elements: strain increment, stress, nominal stress.

Finite kinematics refer to the initial configuration. With F = R U (polar decomposition) the stress is kept in the frame
that turns with R, as Flanagan & Taylor (CMAME 62, 1987) do; its rate is then the Green-Naghdi rate,
s' = C : sym(U' U^-1), and axes of an orthotropic material turn with the body. R and U come from the whole deformation
F, not from a sum of increments: U does not see a rotation, so that a rigid rotation of any size, in one step or many,
gives no strain but round-off, and errors of rotation do not pile up. The increment over a step is taken at its middle
(as Hughes & Winget, IJNME 15, 1980): sym((U_1 - U_0) ((U_0 + U_1) / 2)^-1). s is the Kirchhoff stress, whose work s : D
per initial volume derives from the elastic energy s : C^-1 : s / 2; the nominal stress conjugate to F is P = R s U^-1.

Slots of the workspace ``w`` and of the state, in units of lanes:
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from reflowshock.fem.kernels.lanes import (
    LANE_OPTIONS,
    LANES,
    add_elastic,
    cofactor,
    cofactor_symmetric,
    determinant,
    full,
    nine,
    put_nine,
    put_six,
    six,
    times,
)

DEFORMATION, ROTATION, INCREMENT, MISES, NOMINAL, WORK_SLOTS = (LANES * k for k in (0, 9, 18, 24, 25, 34))
STRESS, PLASTIC, STRETCH, STATE_SLOTS = (LANES * k for k in (0, 6, 7, 13))
POLAR_ITERATIONS = 40  # stretches of 1e6 need 25
POLAR_CONVERGED = 1e-18  # squared change after which the next one is below rounding (quadratic convergence)


class Path(NamedTuple):
    """Kinematics and time step of path-dependent elements.

    Attributes:
        finite: Whether rotations and strains are finite.
        step: Time step dt of rate-dependent laws [s]; infinity means quasi-static.
    """

    finite: bool
    step: float


@njit(**LANE_OPTIONS)
def small_increment(w, state):
    """Write the small-strain increments of sixteen elements at one point, and store the new strains.

    Args:
        w: Flat workspace, entry k of element e at ``16 * k + e``; reads the displacement gradient (nine entries, row by
            row) at ``DEFORMATION``, writes the increment (xx, yy, zz, xy, yz, xz, engineering shear) at ``INCREMENT``.
        state: Flat state of the point in the same order, shape (208,); the six strains at ``STRETCH`` are replaced.
    """
    for lane in range(LANES):
        h = nine(w, DEFORMATION + lane)
        new = h[0], h[4], h[8], h[1] + h[3], h[5] + h[7], h[2] + h[6]
        old = six(state, STRETCH + lane)
        put_six(
            w,
            INCREMENT + lane,
            (
                new[0] - old[0],
                new[1] - old[1],
                new[2] - old[2],
                new[3] - old[3],
                new[4] - old[4],
                new[5] - old[5],
            ),
        )
        put_six(state, STRETCH + lane, new)


@njit(**LANE_OPTIONS)
def add_identity(w):
    """Add 1 to the displacement gradients of sixteen elements, which gives the deformation gradients F.

    Args:
        w: Flat workspace; the 3 x 3 matrices at ``DEFORMATION`` change, entry k of element e at ``16 * k + e``.
    """
    for lane in range(LANES):
        w[DEFORMATION + lane] += 1.0
        w[DEFORMATION + 4 * LANES + lane] += 1.0
        w[DEFORMATION + 8 * LANES + lane] += 1.0


@njit(**LANE_OPTIONS)
def start_rotation(w):
    """Copy F of sixteen elements as the start value of the iteration for the rotation R.

    Args:
        w: Flat workspace, entry k of element e at ``16 * k + e``; F (nine entries) is copied from ``DEFORMATION`` to
            ``ROTATION``.

    Returns:
        Number of elements that are turned inside out (det F <= 0), as a float.
    """
    inverted = 0.0
    for lane in range(LANES):
        f = nine(w, DEFORMATION + lane)
        put_nine(w, ROTATION + lane, f)
        inverted += 0.0 if determinant(f, cofactor(f)) > 0.0 else 1.0
    return inverted


@njit(**LANE_OPTIONS)
def improve_rotation(w):
    """Take one Newton step X -> (X + X^-T) / 2 towards the rotation of each of sixteen elements (Higham 1986).

    Args:
        w: Flat workspace; the 3 x 3 matrix X of each element at ``ROTATION``, its entry k (row by row) of element e at
            ``16 * k + e``, is improved.

    Returns:
        Sum of the squared changes of all entries of all elements, a scalar.
    """
    change = 0.0
    for lane in range(LANES):
        x = nine(w, ROTATION + lane)
        c = cofactor(x)
        scale = 0.5 / determinant(x, c)
        for k in range(9):
            step = scale * c[k] - 0.5 * x[k]
            change += step * step
            w[ROTATION + LANES * k + lane] = x[k] + step
    return change


@njit(cache=True)
def rotate(w):
    """Write the rotations R of the polar decomposition F = R U of sixteen elements.

    Args:
        w: Flat workspace; reads F at ``DEFORMATION`` and writes R at ``ROTATION``, entry k (row by row) of element e at
            ``16 * k + e``.

    Returns:
        Whether no element is turned inside out (det F > 0); otherwise R is not valid.
    """
    if start_rotation(w) > 0.0:
        return False
    for _ in range(POLAR_ITERATIONS):
        if improve_rotation(w) < POLAR_CONVERGED:
            break
    return True


@njit(**LANE_OPTIONS)
def stretch_increment(w, state):
    """Write the finite strain increments of sixteen elements at one point, and store the new stretches.

    Args:
        w: Flat workspace, entry k of element e at ``16 * k + e``; reads F at ``DEFORMATION`` and R at ``ROTATION`` (row
            by row), writes the increment (xx, yy, zz, xy, yz, xz, engineering shear) at ``INCREMENT``.
        state: Flat state of the point in the same order, shape (208,); the six entries of the stretch U at ``STRETCH``
            are replaced.
    """
    for lane in range(LANES):
        u = stretch(nine(w, ROTATION + lane), nine(w, DEFORMATION + lane))
        o = six(state, STRETCH + lane)
        d = u[0] - o[0], u[1] - o[1], u[2] - o[2], u[3] - o[3], u[4] - o[4], u[5] - o[5]
        m = (
            0.5 * (u[0] + o[0]),
            0.5 * (u[1] + o[1]),
            0.5 * (u[2] + o[2]),
            0.5 * (u[3] + o[3]),
            0.5 * (u[4] + o[4]),
            0.5 * (u[5] + o[5]),
        )
        c = cofactor_symmetric(m)
        scale = 1.0 / (m[0] * c[0] + m[3] * c[3] + m[5] * c[5])
        a = times(full(d), full(c))
        put_six(
            w,
            INCREMENT + lane,
            (
                scale * a[0],
                scale * a[4],
                scale * a[8],
                scale * (a[1] + a[3]),
                scale * (a[5] + a[7]),
                scale * (a[2] + a[6]),
            ),
        )
        put_six(state, STRETCH + lane, u)


@njit(**LANE_OPTIONS)
def stretch(r, f):
    """Return the stretch U = R^T F, made symmetric, as six scalars: xx, yy, zz, xy, yz, xz.

    Args:
        r: Rotation R, nine scalars row by row.
        f: Deformation gradient F, nine scalars row by row.
    """
    return (
        r[0] * f[0] + r[3] * f[3] + r[6] * f[6],
        r[1] * f[1] + r[4] * f[4] + r[7] * f[7],
        r[2] * f[2] + r[5] * f[5] + r[8] * f[8],
        0.5 * (r[0] * f[1] + r[3] * f[4] + r[6] * f[7] + r[1] * f[0] + r[4] * f[3] + r[7] * f[6]),
        0.5 * (r[1] * f[2] + r[4] * f[5] + r[7] * f[8] + r[2] * f[1] + r[5] * f[4] + r[8] * f[7]),
        0.5 * (r[0] * f[2] + r[3] * f[5] + r[6] * f[8] + r[2] * f[0] + r[5] * f[3] + r[8] * f[6]),
    )


@njit(**LANE_OPTIONS)
def elastic_stress(w, state, elastic):
    """Add C times the strain increment to the stress of sixteen elements at one point, and write the von Mises stress.

    Args:
        w: Flat workspace; reads the strain increment (xx, yy, zz, xy, yz, xz, engineering shear) at ``INCREMENT``,
            writes the von Mises stress [Pa] at ``MISES``; entry k of element e at ``16 * k + e``.
        state: Flat state of the point in the same order, at least 96 entries; the six stresses [Pa] at ``STRESS`` are
            updated.
        elastic: ``(9,)`` [Pa]: C_xx, C_yy, C_zz, C_xy, C_yz, C_xz (normal), G_xy, G_yz, G_xz.
    """
    for lane in range(LANES):
        s = add_elastic(six(state, STRESS + lane), six(w, INCREMENT + lane), elastic)
        put_six(state, STRESS + lane, s)
        x, y, z = s[0] - s[1], s[1] - s[2], s[2] - s[0]
        square = 0.5 * (x * x + y * y + z * z) + 3.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5])
        w[MISES + lane] = np.sqrt(square)


@njit(**LANE_OPTIONS)
def nominal_stress_small(w, state, weight):
    """Write the stress of sixteen elements at one point times the volume of the point, as 3 x 3 matrices.

    Args:
        w: Flat workspace; nine entries (row by row) are written at ``NOMINAL`` [J], entry k of element e at
            ``16 * k + e``.
        state: Flat state of the point in the same order, shape (208,); reads the six stresses [Pa] at ``STRESS``.
        weight: Volume of the point in each element, shape (16,) [m^3].
    """
    for lane in range(LANES):
        s = full(six(state, STRESS + lane))
        for k in range(9):
            w[NOMINAL + LANES * k + lane] = weight[lane] * s[k]


@njit(**LANE_OPTIONS)
def nominal_stress_finite(w, state, weight):
    """Write the nominal stress P = R s U^-1 of sixteen elements at one point times the volume of the point.

    Args:
        w: Flat workspace; reads R at ``ROTATION``, writes P times volume at ``NOMINAL`` [J], both nine entries row by
            row, entry k of element e at ``16 * k + e``.
        state: Flat state of the point in the same order, shape (208,); reads the six stresses s [Pa] at ``STRESS`` and
            the six entries of the stretch U at ``STRETCH``.
        weight: Initial volume of the point in each element, shape (16,) [m^3].
    """
    for lane in range(LANES):
        u = six(state, STRETCH + lane)
        c = cofactor_symmetric(u)
        scale = weight[lane] / (u[0] * c[0] + u[3] * c[3] + u[5] * c[5])
        p = times(nine(w, ROTATION + lane), times(full(six(state, STRESS + lane)), full(c)))
        for k in range(9):
            w[NOMINAL + LANES * k + lane] = scale * p[k]
