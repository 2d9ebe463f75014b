"""Numba kernels of a Gauss point whose dilatation is a fit over the element; see ``kernels.nonlinear_hexahedron``."""

from numba import njit

from reflowshock.fem.kernels.lanes import (
    LANE_OPTIONS,
    LANES,
    cofactor,
    cofactor_symmetric,
    determinant,
    full,
    nine,
    put_nine,
    six,
    times,
)
from reflowshock.fem.kernels.nonlinear import DEFORMATION, NOMINAL, ROTATION, STRESS, STRETCH

CUBE_ROOT_STEPS = 5  # from ratios between 1/3 and 3


@njit(**LANE_OPTIONS)
def write_dilatation(w, finite, result):
    """Write det F, or the trace of the displacement gradient."""
    if finite:
        for lane in range(LANES):
            f = nine(w, DEFORMATION + lane)
            result[lane] = determinant(f, cofactor(f))
    else:
        for lane in range(LANES):
            f = nine(w, DEFORMATION + lane)
            result[lane] = f[0] + f[4] + f[8]


@njit(**LANE_OPTIONS)
def change_dilatation_small(w, before, after):
    """Replace the compatible dilatation by the fitted one."""
    for lane in range(LANES):
        third = (after[lane] - before[lane]) / 3.0
        w[DEFORMATION + lane] += third
        w[DEFORMATION + 4 * LANES + lane] += third
        w[DEFORMATION + 8 * LANES + lane] += third


@njit(**LANE_OPTIONS)
def change_dilatation_finite(w, before, after, factor):
    """Scale F to F'; write c. Return in how many lanes a determinant is not positive."""
    wrong = 0.0
    for lane in range(LANES):
        f = nine(w, DEFORMATION + lane)
        old = determinant(f, cofactor(f))
        new = old + after[lane] - before[lane]
        wrong += 0.0 if (old > 0.0) & (new > 0.0) else 1.0
        ratio = new / old
        c = (2.0 + ratio) / 3.0
        for _ in range(CUBE_ROOT_STEPS):
            c -= (c - ratio / (c * c)) / 3.0
        factor[lane] = c
        for k in range(9):
            w[DEFORMATION + LANES * k + lane] = c * f[k]
    return wrong


@njit(**LANE_OPTIONS)
def nominal_small(w, state, pressure):
    """Write the stress, and its pressure."""
    for lane in range(LANES):
        s = six(state, STRESS + lane)
        pressure[lane] = (s[0] + s[1] + s[2]) / 3.0
        put_nine(w, NOMINAL + lane, full(s))


@njit(**LANE_OPTIONS)
def nominal_finite(w, state, factor, pressure):
    """Write P of the total deformation, and p / J'."""
    for lane in range(LANES):
        s, u = six(state, STRESS + lane), six(state, STRETCH + lane)
        cofactors = cofactor_symmetric(u)
        jacobian = u[0] * cofactors[0] + u[3] * cofactors[3] + u[5] * cofactors[5]
        p = (s[0] + s[1] + s[2]) / 3.0
        c = factor[lane]
        shift = p / (c * c * c) - p
        scale = c / jacobian
        inner = times((s[0] + shift, s[3], s[5], s[3], s[1] + shift, s[4], s[5], s[4], s[2] + shift), full(cofactors))
        nominal = times(nine(w, ROTATION + lane), inner)
        for k in range(9):
            w[NOMINAL + LANES * k + lane] = scale * nominal[k]
        pressure[lane] = p / jacobian


@njit(**LANE_OPTIONS)
def finish_nominal(w, compatible, weight, change, finite):
    """Turn P into w P_c: add the change of p / J' by its fit, times cof F_c."""
    for lane in range(LANES):
        c = cofactor(nine(compatible, lane))
        e = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
        for k in range(9):
            at = LANES * k + lane
            w[at] = weight[lane] * (w[at] + change[lane] * (c[k] if finite else e[k]))
