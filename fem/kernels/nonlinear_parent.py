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
    """Return where the derivatives at a Gauss point begin in an array that ``write_edges`` has written.

    Args:
        g: Number of the Gauss point, 0 to 7; bits 0, 1 and 2 are its sides along x, y and z.

    Returns:
        Positions of the first component of the first element, for derivatives along x, y and z, three integers.
    """
    x, y, z = g & 1, (g >> 1) & 1, (g >> 2) & 1
    return LANES * (3 * y + 6 * z), LANES * (12 + 3 * x + 6 * z), LANES * (24 + 3 * x + 6 * y)


@njit(**LANE_OPTIONS)
def write_edges(w, field, edges, start):
    """Write the derivatives of a vector field at the Gauss points of sixteen hexahedra.

    Args:
        w: Flat workspace with the transformed nodal values of the field (sums and differences over the corners), 24
            entries of sixteen elements: entry k of element e at ``field + 16 * k + e``.
        field: Position of these values in ``w``, integer.
        edges: Written, shape (>= start + 576,): component c along direction d, at the sides i (0 to 3) of the other two
            directions, of element e at ``start + 16 * (3 (4 d + i) + c) + e``.
        start: Position of the first derivative in ``edges``, integer.
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
    """Write the forces on the transformed nodal values of sixteen hexahedra, the transpose of ``write_edges``.

    Args:
        forces: Forces on the derivatives at each Gauss point: component c along direction d of element e in column
            ``16 * (3 d + c) + e``, shape (8, 144), in the unit of the nodal forces.
        w: Flat workspace; its first 384 entries are overwritten by the forces on the 24 transformed nodal values.
    """
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
    """Write the least-squares fit of scalars at the Gauss points of sixteen hexahedra by four linear functions.

    Args:
        values: Row of each Gauss point, shape (8, >= at + 16).
        at: Column of the scalar of the first element, integer; that of element e is ``at + e``.
        weight: Volume of each Gauss point, shape (8, 16) [m^3].
        basis: Four linear functions, orthonormal under the weights; function k at point g of element e at
            ``16 * (8 k + g) + e``, shape (512,).
        fitted: Written: fitted value at point g of element e at ``16 * g + e``, shape (128,).
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
