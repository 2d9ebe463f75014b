"""Numba kernels of the fully integrated hexahedron with incompatible modes, material and geometric nonlinearity.

The element is that of ``kernels.hexahedron.stiffness``. With F_c the compatible deformation at a Gauss point, a_k the
incompatible modes in the frame R_0 of the element's centre, and Pr the least-squares fit by 1, xi, eta, zeta with the
weights w:

    F = F_c + sum_k R_0 a_k x g_k, g_k = xi_k N_k / w;  J' = det F + Pr(det F_c) - det F_c;  F' = (J' / det F)^(1/3) F

and F' goes to the material (small kinematics: the same, linearised). Forces are the derivative of the stress work, with
s = dev s + p 1 the Kirchhoff stress and c = (J' / det F)^(1/3): on the modes, which are in equilibrium, and on F_c,

    P = c R (dev s + p / c^3 1) U'^-1,  P_c = P + (Pr(p / J') - p / J') cof F_c.

Modes follow each step by one Newton correction with the elastic operator: exact while elastic; what plastic flow leaves
over is corrected in the next step, its work on the modes counts as hourglass energy. Elastic strains must stay small,
as those of metals do: in compression above 7 to 20 %, by their shape, the modes grow without load at any step, known of
all enhanced strains (Wriggers & Reese, CMAME 135, 1996); take the one-point element there.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.fem.kernels.hexahedron import GAUSS
from reflowshock.fem.kernels.lanes import (
    LANE_OPTIONS,
    LANES,
    gather_lanes,
    nine,
    put_nine,
    put_six,
    scatter_lanes,
    turn,
    turn_back,
)
from reflowshock.fem.kernels.nonlinear import (
    DEFORMATION,
    NOMINAL,
    ROTATION,
    STATE_SLOTS,
    WORK_SLOTS,
    add_identity,
    elastic_stress,
    plastic_flow,
    rotate,
    small_increment,
    stretch,
    stretch_increment,
)
from reflowshock.fem.kernels.nonlinear_dilatation import (
    change_dilatation_finite,
    change_dilatation_small,
    finish_nominal,
    nominal_finite,
    nominal_small,
    write_dilatation,
)
from reflowshock.fem.kernels.nonlinear_gradient import FINE
from reflowshock.fem.kernels.nonlinear_modes import (
    add_modes,
    add_remainder,
    add_residual,
    correct_modes,
    push_normals,
    write_inverse,
    write_operator,
)
from reflowshock.fem.kernels.nonlinear_parent import (
    add_point_monomials,
    fit,
    gather_monomials,
    point_gradient,
    scatter_monomials,
)


class HexahedronBlocks(NamedTuple):
    """Hexahedra in blocks of sixteen lanes; blocks of equal shapes share a pattern.

    Attributes:
        cells, filled, pattern, material, elastic, plastic: As in ``kernels.nonlinear_gradient.Blocks``.
        inverse: ``(np, 8, 16 * 9)`` [1/m] inverse Jacobian at the Gauss points.
        weight: ``(np, 16 * 8)`` [m^3].
        basis: ``(np, 16 * 32)`` linear functions at the Gauss points, orthonormal under the weights.
        normal: ``(np, 16 * 9)`` [m^2] N_k: -2 det J_0 times the inverse of the Jacobian at the centre, J_0.
        coupling: ``(np, 16 * 6)`` [1/m^3] sums of xi_k xi_l / w, order of a symmetric matrix.
        state: ``(nb, 8, 16 * 13)``, see ``kernels.nonlinear``.
        modes: ``(nb, 16 * 9)`` [1/m^2] a_k.
        plastic_work: ``(nb, 16)`` [J].
        residual: ``(nb, 16 * 9)`` [N m] forces on the modes.
        hourglass_energy: ``(nb, 16)`` [J] their work.
    """

    cells: NDArray[np.int32]
    filled: NDArray[np.int32]
    pattern: NDArray[np.int32]
    material: NDArray[np.int32]
    elastic: NDArray[np.float64]
    plastic: NDArray[np.float64]
    inverse: NDArray[np.float64]
    weight: NDArray[np.float64]
    basis: NDArray[np.float64]
    normal: NDArray[np.float64]
    coupling: NDArray[np.float64]
    state: NDArray[np.float64]
    modes: NDArray[np.float64]
    plastic_work: NDArray[np.float64]
    residual: NDArray[np.float64]
    hourglass_energy: NDArray[np.float64]


class Bench(NamedTuple):
    """Kinematics, and the arrays of the block at work."""

    finite: bool
    nodal: NDArray[np.float64]
    monomials: NDArray[np.float64]
    compatible: NDArray[np.float64]
    nominal: NDArray[np.float64]
    dilatation: NDArray[np.float64]
    fitted: NDArray[np.float64]
    point: NDArray[np.float64]
    trial: NDArray[np.float64]
    factor: NDArray[np.float64]
    frame: NDArray[np.float64]
    turned: NDArray[np.float64]
    residual: NDArray[np.float64]
    operator: NDArray[np.float64]
    pressure: NDArray[np.float64]
    change: NDArray[np.float64]


@njit(cache=True)
def new_bench(finite):
    """Return the arrays of a block."""
    return Bench(
        finite,
        np.empty(24 * LANES),
        np.empty(24 * LANES),
        np.empty((8, 9 * LANES)),
        np.empty((8, 9 * LANES)),
        np.empty(8 * LANES),
        np.empty(8 * LANES),
        np.empty(WORK_SLOTS),
        np.empty(STATE_SLOTS),
        np.empty(LANES),
        np.empty(15 * LANES),
        np.empty(9 * LANES),
        np.empty(9 * LANES),
        np.empty(54 * LANES),
        np.empty(8 * LANES),
        np.empty(9 * LANES),
    )


@njit(cache=True)
def strain_at(blocks, b, g, bench, state):
    """Move the strain of a Gauss point on, and its stress by the elastic law; return whether it is upright."""
    w, pattern, at = bench.point, blocks.pattern[b], slice(LANES * g, LANES * (g + 1))
    w[DEFORMATION : DEFORMATION + 9 * LANES] = bench.compatible[g]
    xi = (GAUSS[g, 0], GAUSS[g, 1], GAUSS[g, 2])
    add_modes(w, bench.turned, blocks.normal[pattern], xi, blocks.weight[pattern, at])
    if bench.finite:
        wrong = change_dilatation_finite(w, bench.dilatation[at], bench.fitted[at], bench.factor)
        if wrong > 0.0 or not rotate(w):
            return False
        stretch_increment(w, state)
    else:
        change_dilatation_small(w, bench.dilatation[at], bench.fitted[at])
        small_increment(w, state)
    elastic_stress(w, state, blocks.elastic[blocks.material[b]])
    return True


@njit(cache=True)
def write_nominal(bench, state, pressure):
    """Write P of a Gauss point and its p / J'."""
    if bench.finite:
        nominal_finite(bench.point, state, bench.factor, pressure)
    else:
        nominal_small(bench.point, state, pressure)


@njit(**LANE_OPTIONS)
def write_frame(w, frame):
    """Write rotation and stretch of the centre."""
    for lane in range(LANES):
        r = nine(w, ROTATION + lane)
        put_nine(frame, lane, r)
        put_six(frame, 9 * LANES + lane, stretch(r, nine(w, DEFORMATION + lane)))


@njit(cache=True)
def write_centre(blocks, b, bench):
    """Write the frame of the element's centre; return whether it is upright."""
    write_inverse(blocks.normal[blocks.pattern[b]], bench.frame)
    point_gradient(bench.monomials, (0.0, 0.0, 0.0), bench.frame, bench.point)
    add_identity(bench.point)
    upright = rotate(bench.point)
    write_frame(bench.point, bench.frame)
    return upright


@njit(cache=True)
def write_compatible(blocks, b, bench):
    """Write the compatible deformation of all Gauss points and the fit of its dilatation."""
    pattern = blocks.pattern[b]
    for g in range(8):
        xi = (GAUSS[g, 0], GAUSS[g, 1], GAUSS[g, 2])
        point_gradient(bench.monomials, xi, blocks.inverse[pattern, g], bench.point)
        if bench.finite:
            add_identity(bench.point)
        bench.compatible[g] = bench.point[DEFORMATION : DEFORMATION + 9 * LANES]
        write_dilatation(bench.point, bench.finite, bench.dilatation[LANES * g : LANES * (g + 1)])
    fit(blocks.basis[pattern], blocks.weight[pattern], bench.dilatation, bench.fitted)


@njit(cache=True)
def write_turned(blocks, b, bench):
    """Write the modes in the frame of the body."""
    bench.turned[:] = blocks.modes[b]
    if bench.finite:
        turn(bench.frame, bench.turned)


@njit(cache=True)
def relax_modes(blocks, b, bench):
    """Correct the modes from an elastic trial step; return whether all Gauss points are upright."""
    pattern = blocks.pattern[b]
    write_turned(blocks, b, bench)
    bench.residual[:] = 0.0
    for g in range(8):
        bench.trial[:] = blocks.state[b, g]
        if not strain_at(blocks, b, g, bench, bench.trial):
            return False
        write_nominal(bench, bench.trial, bench.pressure)
        xi = (GAUSS[g, 0], GAUSS[g, 1], GAUSS[g, 2])
        add_residual(bench.point, blocks.normal[pattern], xi, bench.residual)
    if bench.finite:
        turn_back(bench.frame, bench.residual)
    elastic = blocks.elastic[blocks.material[b]]
    bench.turned[:] = blocks.normal[pattern]
    if bench.finite:
        push_normals(bench.frame, bench.turned)
    write_operator(bench.turned, blocks.coupling[pattern], elastic, bench.operator)
    correct_modes(bench.operator, bench.residual, blocks.modes[b], bench.change)
    write_turned(blocks, b, bench)
    return True


@njit(cache=True)
def move_points(blocks, b, bench, step):
    """Move all Gauss points on by a step, write P and the forces on the modes; return whether they are upright."""
    pattern = blocks.pattern[b]
    weight, law = blocks.weight[pattern], (blocks.plastic[blocks.material[b]], step)
    for g in range(8):
        state, at = blocks.state[b, g], slice(LANES * g, LANES * (g + 1))
        if not strain_at(blocks, b, g, bench, state):
            return False
        plastic_flow(bench.point, state, law, weight[at], blocks.plastic_work[b])
        write_nominal(bench, state, bench.pressure[at])
        bench.nominal[g] = bench.point[NOMINAL : NOMINAL + 9 * LANES]
        xi = (GAUSS[g, 0], GAUSS[g, 1], GAUSS[g, 2])
        add_residual(bench.point, blocks.normal[pattern], xi, bench.residual)
    return True


@njit(cache=True)
def add_hexahedron_force(blocks, path, displacement, force):
    """Subtract the internal force of hexahedra with incompatible modes; move their state on by a step.

    Args:
        blocks: The elements.
        path: Kinematics and step.
        displacement: ``(n, 3)`` [m].
        force: ``(n, 3)`` [N], added to.

    Returns:
        ``FINE``, or the first block with an element that is turned inside out; then the force is not complete.
    """
    bench = new_bench(path.finite)
    for b in range(len(blocks.cells)):
        pattern = blocks.pattern[b]
        gather_lanes(blocks.cells[b], displacement, bench.nodal)
        gather_monomials(bench.nodal, bench.monomials)
        if path.finite and not write_centre(blocks, b, bench):
            return b
        write_compatible(blocks, b, bench)
        if not relax_modes(blocks, b, bench):
            return b
        bench.residual[:] = 0.0
        if not move_points(blocks, b, bench, path.step):
            return b
        if path.finite:
            turn_back(bench.frame, bench.residual)
        add_remainder(bench.residual, bench.change, blocks.residual[b], blocks.hourglass_energy[b])
        fit(blocks.basis[pattern], blocks.weight[pattern], bench.pressure, bench.fitted)
        bench.fitted[:] -= bench.pressure
        bench.monomials[:] = 0.0
        for g in range(8):
            at = slice(LANES * g, LANES * (g + 1))
            finish_nominal(
                bench.nominal[g], bench.compatible[g], blocks.weight[pattern, at], bench.fitted[at], path.finite
            )
            xi = (GAUSS[g, 0], GAUSS[g, 1], GAUSS[g, 2])
            add_point_monomials(bench.nominal[g], xi, blocks.inverse[pattern, g], bench.monomials)
        scatter_monomials(bench.monomials, bench.nodal)
        scatter_lanes(blocks.cells[b], blocks.filled[b], bench.nodal, force)
    return FINE
