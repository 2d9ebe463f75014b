"""Numba kernels of trilinear fields on sixteen hexahedra: derivatives at the Gauss points, linear fit.

A field is given by the transformed values q_p of its corners (``box_rotation.transform_corners``), p a parity: it is
the sum of q_p m_p / 8, m_p the monomial of the coordinates that p names, each turned to the other side (-xi). The
factor and the sides are left out here: they cancel wherever derivatives are divided by derivatives. A derivative along
x is the same at both Gauss points on a line along x, so that there are twelve of them, not twenty-four: ``edges``
has three components of each, entry 3 (4 d + i) + c, i counting sides of the other two directions.
"""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.box_rotation import XY, XYZ, XZ, YZ, X, Y, Z
from reflowshock.fem.kernels.lanes import LANE_OPTIONS, LANES

SIDE = 1.0 / np.sqrt(3.0)  # of the Gauss points
# Modes with a derivative along each direction: linear, and bilinear with the first and second other direction.
LINES = ((X, XY, XZ), (Y, XY, YZ), (Z, XZ, YZ))
EDGES = 36 * LANES
# Gauss points in pairs along x, y, z; the pairs in the order of the edges.
PAIRS = ((0, 1, 2, 3, 4, 5, 6, 7), (0, 2, 1, 3, 4, 6, 5, 7), (0, 4, 1, 5, 2, 6, 3, 7))


@njit(**LANE_OPTIONS)
def places(g):
    """Return where the derivatives along x, y, z of a Gauss point begin."""
    x, y, z = g & 1, (g >> 1) & 1, (g >> 2) & 1
    return LANES * (3 * y + 6 * z), LANES * (12 + 3 * x + 6 * z), LANES * (24 + 3 * x + 6 * y)


@njit(**LANE_OPTIONS)
def write_edges(w, field, edges, start):
    """Write the derivatives of a field.

    Args:
        w: Workspace.
        field: Where its transformed values ``(16 * 24,)`` begin there.
        edges: ``(>= start + 16 * 36,)``.
        start: Where to write.
    """
    for d in range(3):
        own, first, second = LINES[d]
        own, first, second, third, at = field + own, field + first, field + second, field + XYZ, start + 12 * LANES * d
        for k in range(3 * LANES):
            a, b, c, e = w[own + k], SIDE * w[first + k], SIDE * w[second + k], SIDE * SIDE * w[third + k]
            edges[at + k], edges[at + 3 * LANES + k] = a + b + (c + e), a - b + (c - e)
            edges[at + 6 * LANES + k], edges[at + 9 * LANES + k] = a + b - (c + e), a - b - (c - e)


@njit(**LANE_OPTIONS)
def write_modes(forces, w):
    """Write the forces on the transformed values of forces ``(8, 16 * 9)`` on the derivatives at the Gauss points."""
    for k in range(24 * LANES):
        w[k] = 0.0
    for d in range(3):
        own, first, second = LINES[d]
        i, j, m, n, o, p, q, r = PAIRS[d]
        at = 3 * LANES * d
        for k in range(3 * LANES):
            a, b = forces[i, at + k] + forces[j, at + k], forces[m, at + k] + forces[n, at + k]
            c, e = forces[o, at + k] + forces[p, at + k], forces[q, at + k] + forces[r, at + k]
            w[own + k] += a + b + (c + e)
            w[first + k] += SIDE * (a - b + (c - e))
            w[second + k] += SIDE * (a + b - (c + e))
            w[XYZ + k] += SIDE * SIDE * (a - b - (c - e))


@njit(**LANE_OPTIONS)
def write_fit(values, at, weight, basis, fitted):
    """Write the least-squares fit of values at the Gauss points by four orthonormal functions.

    Args:
        values: ``(8, >= at + 16)``.
        at: Which of their entries.
        weight: ``(8, 16)``.
        basis: ``(16 * 32,)`` the functions, orthonormal under the weights.
        fitted: ``(16 * 8,)``.
    """
    for k in range(8 * LANES):
        fitted[k] = 0.0
    for k in range(4):
        start = 8 * LANES * k
        for lane in range(LANES):
            coefficient = 0.0
            for g in range(8):
                coefficient += weight[g, lane] * basis[start + LANES * g + lane] * values[g, at + lane]
            for g in range(8):
                fitted[LANES * g + lane] += coefficient * basis[start + LANES * g + lane]
