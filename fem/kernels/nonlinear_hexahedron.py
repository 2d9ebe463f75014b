"""Numba kernels of the fully integrated hexahedron with incompatible modes, material and geometric nonlinearity.

Positions are seen from the frame R that turns with the centre of the element (polar decomposition of the deformation
there), x^ = R^T x, and so are stresses and strains of all Gauss points. The strain increment of a step is taken at its
midpoint, with j = dx^/dxi of the positions between both ends (Hughes & Winget, IJNME 15, 1980):

    d = sym(dj j^-1) + (Pr(t) - t) 1 / 3 + sum_k xi_k / w sym(a_k x n_k),    t = tr(dj j^-1),

Pr the least-squares fit by 1, xi, eta, zeta with the weights w, a_k the steps of the incompatible modes, and n_k the
gradients of xi_k at the centre. Small kinematics have R = 1 and j of the body at rest. Forces are those with the same
power, s the Kirchhoff stress after the step and p its pressure: on x^, w (s + (Pr(p) - p) 1) j^-T; on the modes,
sum over points of xi_k s n_k = 0. A rotation gives no strain, stress gives no moment, and to first order in the
displacement all is that of ``kernels.hexahedron``.

Modes follow each step by one Newton correction with the elastic operator: exact while elastic; what plastic flow leaves
over is corrected in the next step, its work on the modes counts as hourglass energy.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.fem.kernels.box_rotation import DEFORMATION, ROTATION, X, Y, Z, transform_corners
from reflowshock.fem.kernels.hexahedron import GAUSS
from reflowshock.fem.kernels.lanes import (
    LANE_OPTIONS,
    LANES,
    add_elastic,
    applied,
    gather_lanes,
    nine,
    put_nine,
    put_six_of,
    put_three,
    scatter_lanes,
    six,
    six_of,
    three,
    transposed,
)
from reflowshock.fem.kernels.nonlinear import INCREMENT, MISES, WORK_SLOTS, rotate
from reflowshock.fem.kernels.nonlinear_gradient import FINE
from reflowshock.fem.kernels.nonlinear_modes import (
    AFTER,
    ALL_SLOTS,
    BEFORE,
    CHANGE,
    MIDDLE,
    SUMS,
    add_remainder,
    solve_modes,
    write_normals,
    write_operator,
    write_sums,
    write_trial,
)
from reflowshock.fem.kernels.nonlinear_parent import (
    EDGES,
    TRACE,
    fit_dilatation,
    write_edges,
    write_fit,
    write_forces,
    write_modes,
    write_pressures,
    write_strains,
)
from reflowshock.fem.kernels.plastic_lanes import add_work, law_of, plastic_flow
from reflowshock.materials.plasticity import FIRST_YIELD

CORNERS = 21 * LANES  # entries of positions but for their mean
MODES = 24 * LANES
POINT = 7 * LANES  # of the state of a Gauss point: stress, equivalent plastic strain


class HexahedronBlocks(NamedTuple):
    """Hexahedra in blocks of sixteen lanes; blocks of equal shapes share a pattern.

    Attributes:
        cells, filled, pattern, material, elastic, plastic: As in ``kernels.nonlinear_gradient.Blocks``.
        corners: ``(np, 16 * 21)`` [m] transformed positions at rest of the parities 1 to 7.
        inverse: ``(np, 16 * 9)`` [1/m] inverse of the matrix whose columns are those of x, y and z.
        weight, reciprocal: ``(np, 8, 16)`` [m^3], [1/m^3].
        basis: ``(np, 16 * 32)`` linear functions at the Gauss points, orthonormal under the weights.
        coupling: ``(np, 16 * 6)`` [1/m^3] sums of xi_k xi_l / w, order of a symmetric matrix.
        state: ``(nb, 8, 16 * 7)`` stress [Pa], equivalent plastic strain.
        place: ``(nb, 16 * 21)`` [m] transformed x^.
        plastic_work: ``(nb, 16)`` [J].
        hourglass_energy: ``(nb, 16)`` [J] work of forces on the modes.
    """

    cells: NDArray[np.int32]
    filled: NDArray[np.int32]
    pattern: NDArray[np.int32]
    material: NDArray[np.int32]
    elastic: NDArray[np.float64]
    plastic: NDArray[np.float64]
    corners: NDArray[np.float64]
    inverse: NDArray[np.float64]
    weight: NDArray[np.float64]
    reciprocal: NDArray[np.float64]
    basis: NDArray[np.float64]
    coupling: NDArray[np.float64]
    state: NDArray[np.float64]
    place: NDArray[np.float64]
    plastic_work: NDArray[np.float64]
    hourglass_energy: NDArray[np.float64]


@njit(**LANE_OPTIONS)
def write_centre(inverse, w):
    """Compute the deformation gradients F at the centres of sixteen elements from their displacements.

    Args:
        inverse: Inverse 3 x 3 matrix of the reference positions along x, y and z, entry k (row by row) of element e at
            ``16 * k + e``, shape (144,) [1/m].
        w: Flat workspace of ``ALL_SLOTS`` entries; reads the transformed nodal displacements (sums and differences over
            the corners) in its first 384 entries [m], writes F, nine entries in the same order, at ``DEFORMATION``.
    """
    for lane in range(LANES):
        m, x, y, z = nine(inverse, lane), three(w, X + lane), three(w, Y + lane), three(w, Z + lane)
        put_nine(
            w,
            DEFORMATION + lane,
            (
                1.0 + x[0] * m[0] + y[0] * m[3] + z[0] * m[6],
                x[0] * m[1] + y[0] * m[4] + z[0] * m[7],
                x[0] * m[2] + y[0] * m[5] + z[0] * m[8],
                x[1] * m[0] + y[1] * m[3] + z[1] * m[6],
                1.0 + x[1] * m[1] + y[1] * m[4] + z[1] * m[7],
                x[1] * m[2] + y[1] * m[5] + z[1] * m[8],
                x[2] * m[0] + y[2] * m[3] + z[2] * m[6],
                x[2] * m[1] + y[2] * m[4] + z[2] * m[7],
                1.0 + x[2] * m[2] + y[2] * m[5] + z[2] * m[8],
            ),
        )


@njit(**LANE_OPTIONS)
def add_corners(corners, p, w):
    """Add the reference positions of sixteen elements to their displacements, which gives the current positions.

    Args:
        corners: Reference positions of each element shape: 21 transformed nodal components (sums and differences over
            the corners, without their mean) of sixteen elements, shape (np, 336) [m].
        p: Row of ``corners``, integer.
        w: Flat workspace of ``ALL_SLOTS`` entries; the 336 entries from ``X`` are displacements in the same order [m]
            on entry, positions [m] on return.
    """
    for k in range(CORNERS):
        w[X + k] += corners[p, k]


@njit(**LANE_OPTIONS)
def turn_back(w):
    """Rotate the positions of sixteen elements into their corotated frames, in place: x becomes R^T x.

    Args:
        w: Flat workspace of ``ALL_SLOTS`` entries, entry k of element e at ``16 * k + e``; the seven transformed
            position vectors x from ``X`` [m] change, the rotation R (nine entries, row by row) at ``ROTATION`` is read.
    """
    for k in range(X, MODES, 3 * LANES):
        for lane in range(LANES):
            put_three(w, k + lane, applied(transposed(nine(w, ROTATION + lane)), three(w, k + lane)))


@njit(**LANE_OPTIONS)
def turn(w):
    """Rotate the forces of sixteen elements from their corotated frames back into space, in place: f becomes R f.

    Args:
        w: Flat workspace of ``ALL_SLOTS`` entries, entry k of element e at ``16 * k + e``; the seven transformed force
            vectors f from ``X`` [N] change, the rotation R (nine entries, row by row) at ``ROTATION`` is read.
    """
    for k in range(X, MODES, 3 * LANES):
        for lane in range(LANES):
            put_three(w, k + lane, applied(nine(w, ROTATION + lane), three(w, k + lane)))


@njit(**LANE_OPTIONS)
def move_place(w, place, b):
    """Compute midpoint and change of the positions of sixteen elements over a step, and store the new positions.

    Args:
        w: Flat workspace of ``ALL_SLOTS`` entries; reads the 336 transformed positions after the step from ``X`` (21
            entries of sixteen elements) [m], writes their midpoint from ``MIDDLE + X`` and their change from ``CHANGE +
            X`` [m].
        place: Positions of each block before the step, in the same order, shape (nb, 336) [m]; one row is replaced by
            the positions after the step.
        b: Row of ``place``, number of the block, integer.
    """
    for k in range(CORNERS):
        new, old = w[X + k], place[b, k]
        w[CHANGE + X + k] = new - old
        w[MIDDLE + X + k] = 0.5 * (new + old)
        place[b, k] = new


@njit(**LANE_OPTIONS)
def move_points(w, points, reciprocal, state, elastic):
    """Advance the stress of all Gauss points of sixteen elements by an elastic step.

    Args:
        w: Flat workspace; reads the strains of the three modes at ``SUMS``, six entries of sixteen elements each.
        points: Six strains, added to, and their trace, replaced by the squared von Mises stress, shape (8, 112) [Pa^2].
        reciprocal: Reciprocal volumes of the Gauss points, shape (8, 16) [1/m^3].
        state: Six stresses [Pa], updated, and the plastic strain, entry k of element e at ``16 * k + e``, (8, 112).
        elastic: Nine scalars [Pa]: C_xx, C_yy, C_zz, C_xy, C_yz, C_xz (normal), G_xy, G_yz, G_xz.
    """
    for g in range(8):
        x, y, z = GAUSS[g, 0], GAUSS[g, 1], GAUSS[g, 2]
        for lane in range(LANES):
            r = reciprocal[g, lane]
            u, v, t = x * r, y * r, z * r
            d = six_of(points, g, lane)
            m, n, o = six(w, SUMS + lane), six(w, SUMS + 6 * LANES + lane), six(w, SUMS + 12 * LANES + lane)
            d = (
                d[0] + u * m[0] + v * n[0] + t * o[0],
                d[1] + u * m[1] + v * n[1] + t * o[1],
                d[2] + u * m[2] + v * n[2] + t * o[2],
                d[3] + u * m[3] + v * n[3] + t * o[3],
                d[4] + u * m[4] + v * n[4] + t * o[4],
                d[5] + u * m[5] + v * n[5] + t * o[5],
            )
            put_six_of(points, g, lane, d)
            s = add_elastic(six_of(state, g, lane), d, elastic)
            put_six_of(state, g, lane, s)
            a, b, c = s[0] - s[1], s[1] - s[2], s[2] - s[0]
            shear = s[3] * s[3] + s[4] * s[4] + s[5] * s[5]
            points[g, TRACE + lane] = 0.5 * (a * a + b * b + c * c) + 3.0 * shear


@njit(**LANE_OPTIONS)
def count_yielding(points, limit):
    """Return at how many Gauss points of 16 elements the von Mises stress exceeds a limit, as a float.

    Args:
        points: Squared von Mises stresses in the last 16 columns, shape (8, 112) [Pa^2].
        limit: Limit of the von Mises stress, positive scalar [Pa].
    """
    count, square = 0.0, limit * limit
    for g in range(8):
        for lane in range(LANES):
            count += 1.0 if points[g, TRACE + lane] > square else 0.0
    return count


@njit(cache=True)
def flow(blocks, b, points, step, w):
    """Return the stresses of a block of sixteen elements to the yield surface, and add the plastic work.

    Args:
        blocks: ``HexahedronBlocks``: all elements in blocks of sixteen; stresses, plastic strains and plastic work of
            the block are updated.
        b: Number of the block, integer.
        points: One row per Gauss point, shape (8, 112): six strain increments and the squared von Mises stress [Pa^2],
            entry k of element e in column ``16 * k + e``.
        step: Time step of rate-dependent laws, scalar [s].
        w: Workspace of shape (544,), overwritten.
    """
    state, weight, work = blocks.state[b], blocks.weight[blocks.pattern[b]], blocks.plastic_work[b]
    law = law_of(blocks.plastic, blocks.material[b], step)
    for g in range(8):
        for k in range(TRACE):
            w[INCREMENT + k] = points[g, k]
        for lane in range(LANES):
            w[MISES + lane] = np.sqrt(points[g, TRACE + lane])
        if plastic_flow(w, state, g, law):
            add_work(w, weight, g, work)


@njit(**LANE_OPTIONS)
def copy_corners(source, b, w, at):
    """Copy the transformed positions of sixteen elements into the workspace.

    Args:
        source: Transformed positions of several blocks or shapes, 21 entries of sixteen elements each, shape (nb, 336)
            [m].
        b: Row of ``source`` that is copied, integer.
        w: Flat workspace of ``ALL_SLOTS`` entries; the 336 entries from ``at + X`` are overwritten.
        at: Start of the positions in ``w``, such as ``MIDDLE`` (positions in the middle of the step), integer.
    """
    for k in range(CORNERS):
        w[at + X + k] = source[b, k]


@njit(**LANE_OPTIONS)
def constants_of(elastic, m):
    """Return the elastic constants of a material as nine scalars [Pa].

    They are C_xx, C_yy, C_zz, C_xy, C_yz, C_xz (normal strains) and the shear moduli G_xy, G_yz, G_xz.

    Args:
        elastic: The same constants of each material in its rows, shape (nm, 9) [Pa].
        m: Index of the material, integer.
    """
    return (
        elastic[m, 0],
        elastic[m, 1],
        elastic[m, 2],
        elastic[m, 3],
        elastic[m, 4],
        elastic[m, 5],
        elastic[m, 6],
        elastic[m, 7],
        elastic[m, 8],
    )


@njit(cache=True)
def add_hexahedron_force(blocks, path, displacement, force):
    """Subtract the internal force of hexahedra with incompatible modes, and advance their state by a step.

    Args:
        blocks: ``HexahedronBlocks``: the elements in blocks of sixteen; stresses, plastic strains, positions, plastic
            work and hourglass energy are updated.
        path: ``Path``: small or finite kinematics, and the time step of rate-dependent laws [s].
        displacement: Nodal displacement after the step, shape (n, 3) [m].
        force: Nodal force, shape (n, 3) [N], subtracted from.

    Returns:
        ``FINE`` (-1), or the number of the first block with an element turned inside out; then the force is not
        complete.
    """
    w, edges, point = np.zeros(ALL_SLOTS), np.empty(2 * EDGES), np.empty(WORK_SLOTS)
    points, forces, fitted = np.empty((8, POINT)), np.empty((8, 9 * LANES)), np.empty(8 * LANES)
    corners, place, finite = blocks.corners, blocks.place, path.finite
    for b in range(len(blocks.cells)):
        pattern, material = blocks.pattern[b], blocks.material[b]
        weight, basis, state = blocks.weight[pattern], blocks.basis[pattern], blocks.state[b]
        elastic = constants_of(blocks.elastic, material)
        gather_lanes(blocks.cells[b], displacement, w)
        transform_corners(w)
        if finite:
            write_centre(blocks.inverse[pattern], w)
            if not rotate(w[DEFORMATION:]):
                return b
        add_corners(corners, pattern, w)
        if finite:
            turn_back(w)
        move_place(w, place, b)
        if not finite:
            copy_corners(corners, pattern, w, MIDDLE)
        write_edges(w, MIDDLE, edges, 0)
        write_edges(w, CHANGE, edges, EDGES)
        write_strains(edges, points)
        write_fit(points, TRACE, weight, basis, fitted)
        fit_dilatation(points, fitted)
        write_normals(w)
        write_sums(state, w, BEFORE)
        write_sums(points, w, SUMS)
        write_trial(w, elastic)
        write_operator(w, blocks.coupling[pattern], elastic)
        solve_modes(w)
        move_points(w, points, blocks.reciprocal[pattern], state, elastic)
        if count_yielding(points, blocks.plastic[material, FIRST_YIELD]) > 0.0:
            flow(blocks, b, points, path.step, point)
        write_sums(state, w, AFTER)
        add_remainder(w, blocks.hourglass_energy[b])
        write_pressures(state, points)
        write_fit(points, TRACE, weight, basis, fitted)
        if finite:
            copy_corners(place, b, w, MIDDLE)
            write_edges(w, MIDDLE, edges, 0)
        if write_forces(edges, (state, points, fitted, weight), forces) > 0.0:
            return b
        write_modes(forces, w)
        if finite:
            turn(w)
        transform_corners(w)
        scatter_lanes(blocks.cells[b], blocks.filled[b], w, force)
    return FINE
