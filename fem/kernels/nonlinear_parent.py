"""Numba kernels of trilinear fields on sixteen hexahedra: derivatives, strains and forces at the Gauss points.

A field is given by the transformed values q_p of its corners (``box_rotation.transform_corners``), p a parity: it is
the sum of q_p m_p / 8, m_p the monomial of the coordinates that p names, each turned to the other side (-xi). The
factor and the sides are left out here: they cancel wherever derivatives are divided by derivatives. A derivative along
x is the same at both Gauss points on a line along x, so that there are twelve of them, not twenty-four: ``edges``
has three components of each, entry 3 (4 d + i) + c, i counting sides of the other two directions.
"""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.box_rotation import XY, XYZ, XZ, YZ, X, Y, Z
from reflowshock.fem.kernels.lanes import LANE_OPTIONS, LANES, cross, six_of, three

SIDE = 1.0 / np.sqrt(3.0)  # of the Gauss points
# Modes with a derivative along each direction: linear, and bilinear with the first and second other direction.
LINES = ((X, XY, XZ), (Y, XY, YZ), (Z, XZ, YZ))
EDGES = 36 * LANES
TRACE = 6 * LANES  # where a Gauss point has its trace, then its equivalent stress, then its pressure
# Gauss points in pairs along x, y, z; the pairs in the order of the edges.
PAIRS = ((0, 1, 2, 3, 4, 5, 6, 7), (0, 2, 1, 3, 4, 6, 5, 7), (0, 4, 1, 5, 2, 6, 3, 7))


@njit(**LANE_OPTIONS)
def places(g):
    """Return where the derivatives at a Gauss point begin in an array that ``write_edges`` has written.

    There, each derivative is a vector of three components for sixteen elements, 48 consecutive entries.

    Args:
        g: Number of the Gauss point, integer 0 to 7; bits 0, 1 and 2 are its sides along x, y and z.

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
    """Compute the forces on the transformed nodal values of sixteen hexahedra, the transpose of ``write_edges``.

    Transformed nodal values are sums and differences of the values at the eight corners.

    Args:
        forces: Forces on the derivatives at each Gauss point: component c along direction d of element e in column ``16
            * (3 d + c) + e``, shape (8, 144), in the unit of the nodal forces.
        w: Flat workspace; its first 384 entries are overwritten by the forces on the 24 transformed nodal values, entry
            k of element e at ``16 * k + e``.
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


@njit(**LANE_OPTIONS)
def write_strains(edges, points):
    """Compute the compatible strain increments of a step at the Gauss points of sixteen hexahedra.

    Args:
        edges: Derivatives along the parent coordinates by ``write_edges``: the first 576 entries of the positions in
            the middle of the step, the other 576 of their change in the step, shape (1152,) [m].
        points: Written, one row per Gauss point, shape (8, 112): strain increment xx, yy, zz, xy, yz, xz (engineering
            shear) and its trace, entry k of element e in column ``16 * k + e``.
    """
    for g in range(8):
        p, q, r = places(g)
        for lane in range(LANES):
            a, b, c = three(edges, p + lane), three(edges, q + lane), three(edges, r + lane)
            d, e, f = three(edges, EDGES + p + lane), three(edges, EDGES + q + lane), three(edges, EDGES + r + lane)
            u, v, t = cross(b, c), cross(c, a), cross(a, b)
            s = 1.0 / (a[0] * u[0] + a[1] * u[1] + a[2] * u[2])
            xx = s * (d[0] * u[0] + e[0] * v[0] + f[0] * t[0])
            yy = s * (d[1] * u[1] + e[1] * v[1] + f[1] * t[1])
            zz = s * (d[2] * u[2] + e[2] * v[2] + f[2] * t[2])
            xy = d[0] * u[1] + e[0] * v[1] + f[0] * t[1] + d[1] * u[0] + e[1] * v[0] + f[1] * t[0]
            yz = d[1] * u[2] + e[1] * v[2] + f[1] * t[2] + d[2] * u[1] + e[2] * v[1] + f[2] * t[1]
            xz = d[0] * u[2] + e[0] * v[2] + f[0] * t[2] + d[2] * u[0] + e[2] * v[0] + f[2] * t[0]
            row = points[g]
            row[lane], row[LANES + lane], row[2 * LANES + lane] = xx, yy, zz
            row[3 * LANES + lane], row[4 * LANES + lane], row[5 * LANES + lane] = s * xy, s * yz, s * xz
            row[TRACE + lane] = xx + yy + zz


@njit(**LANE_OPTIONS)
def fit_dilatation(points, fitted):
    """Shift the normal strains at the Gauss points of sixteen hexahedra so that their traces equal linear fits (B-bar).

    Args:
        points: One row per Gauss point, shape (8, 112): strain xx, yy, zz, xy, yz, xz and its trace, entry k of element
            e in column ``16 * k + e``; xx, yy and zz change by the same amount, the stored trace stays.
        fitted: Fit of the trace at point g of element e at ``16 * g + e``, shape (128,).
    """
    for g in range(8):
        for lane in range(LANES):
            third = (fitted[LANES * g + lane] - points[g, TRACE + lane]) / 3.0
            points[g, lane] += third
            points[g, LANES + lane] += third
            points[g, 2 * LANES + lane] += third


@njit(**LANE_OPTIONS)
def write_pressures(state, points):
    """Compute the mean stresses, positive in tension, at the Gauss points of sixteen hexahedra.

    Args:
        state: One row per Gauss point, shape (8, 112); the stresses xx, yy, zz are read [Pa], entry k of element e in
            column ``16 * k + e``.
        points: One row per Gauss point, shape (8, 112); the mean stress (xx + yy + zz) / 3 is written to the last
            sixteen columns [Pa].
    """
    for g in range(8):
        for lane in range(LANES):
            points[g, TRACE + lane] = (state[g, lane] + state[g, LANES + lane] + state[g, 2 * LANES + lane]) / 3.0


@njit(**LANE_OPTIONS)
def write_forces(edges, load, forces):
    """Compute the forces on the derivatives of positions at the Gauss points of sixteen hexahedra, from the stresses.

    Args:
        edges: Derivatives of the positions after the step along the parent coordinates, by ``write_edges``, shape (>=
            576,) [m].
        load: Tuple: stresses xx, yy, zz, xy, yz, xz and plastic strain of each Gauss point, shape (8, 112) [Pa]; mean
            stresses in the last 16 columns of an array of shape (8, 112) [Pa]; their linear fit, shape (128,) [Pa];
            volumes of the points, shape (8, 16) [m^3].
        forces: Written, one row per Gauss point, shape (8, 144) [J/m]: component c along direction d of element e in
            column ``16 * (3 d + c) + e``.

    Returns:
        Number of Gauss points of all elements that are turned inside out, as a float.
    """
    state, points, fitted, weight = load
    wrong = 0.0
    for g in range(8):
        p, q, r = places(g)
        for lane in range(LANES):
            a, b, c = three(edges, p + lane), three(edges, q + lane), three(edges, r + lane)
            u, v, t = cross(b, c), cross(c, a), cross(a, b)
            volume = a[0] * u[0] + a[1] * u[1] + a[2] * u[2]
            wrong += 0.0 if volume < 0.0 else 1.0
            f, m = weight[g, lane] / volume, six_of(state, g, lane)
            shift = fitted[LANES * g + lane] - points[g, TRACE + lane]
            s = (f * (m[0] + shift), f * (m[1] + shift), f * (m[2] + shift), f * m[3], f * m[4], f * m[5])
            forces[g, lane] = s[0] * u[0] + s[3] * u[1] + s[5] * u[2]
            forces[g, LANES + lane] = s[3] * u[0] + s[1] * u[1] + s[4] * u[2]
            forces[g, 2 * LANES + lane] = s[5] * u[0] + s[4] * u[1] + s[2] * u[2]
            forces[g, 3 * LANES + lane] = s[0] * v[0] + s[3] * v[1] + s[5] * v[2]
            forces[g, 4 * LANES + lane] = s[3] * v[0] + s[1] * v[1] + s[4] * v[2]
            forces[g, 5 * LANES + lane] = s[5] * v[0] + s[4] * v[1] + s[2] * v[2]
            forces[g, 6 * LANES + lane] = s[0] * t[0] + s[3] * t[1] + s[5] * t[2]
            forces[g, 7 * LANES + lane] = s[3] * t[0] + s[1] * t[1] + s[4] * t[2]
            forces[g, 8 * LANES + lane] = s[5] * t[0] + s[4] * t[1] + s[2] * t[2]
    return wrong
