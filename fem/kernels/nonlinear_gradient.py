"""Numba kernels of elements with stored gradients: one-point hexahedra with hourglass stiffness, tetrahedra.

The hourglass part of the motion is q = gamma^T u, in the turned frame q^ = R^T q; it is resisted by the elastic
stiffness H that the incompatible-modes element has on it (``elements.one_point``), with the potential q^ . H q^ / 2.
It changes also when R turns against q: with Q^ = H q^ and m = sum_k q^_k x Q^_k, that part is the nominal stress
-R [(tr(U) 1 - U)^-1 m]x of the mean deformation. It keeps energy and angular momentum.

A section that yields carries a limited moment beside its axial force: M / M_p + (N / N_p)^2 <= 1. So the hourglass
stress, the root mean square sqrt(2 E W / V) of the energy W, is at most sqrt(3)/2 Y (1 - (q / Y)^2), Y the yield stress
and q the von Mises stress of the centre; what is beyond slips. Without it a plastic hinge of four layers is 29 % too
strong, with it 3 %. Where the centre flows a little strength is left, or nothing would resist hourglassing.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.fem.kernels.lanes import (
    LANE_OPTIONS,
    LANES,
    applied,
    cofactor_symmetric,
    full,
    gather_lanes,
    nine,
    put_nine,
    scatter_lanes,
    six,
    times,
    turn,
    turn_back,
)
from reflowshock.fem.kernels.nonlinear import (
    MISES,
    NOMINAL,
    PLASTIC,
    ROTATION,
    STRETCH,
    WORK_SLOTS,
    add_identity,
    elastic_stress,
    nominal_stress_finite,
    nominal_stress_small,
    plastic_flow,
    rotate,
    small_increment,
    stretch_increment,
)
from reflowshock.fem.kernels.plasticity import FIRST_YIELD, yield_stress

HOURGLASS, RESISTANCE, TRIAL, GRADIENT_SLOTS = (WORK_SLOTS + LANES * k for k in (0, 12, 24, 25))
BENDING_STRENGTH = np.sqrt(0.75)  # 3/2 of the yield stress at the faces of a section, as a root mean square
LEAST_STRENGTH = 0.05  # of it is left where the centre flows
GAMMA_ENTRIES = 32 * LANES
FINE = -1  # no element is turned inside out


class Blocks(NamedTuple):
    """Elements in blocks of sixteen lanes, m points each; blocks of equal shapes share a pattern.

    Attributes:
        cells: ``(nb, k, 16)`` int32 nodes; lanes past the last element repeat it.
        filled: ``(nb,)`` int32 elements of each block.
        pattern: ``(nb,)`` int32 index into the arrays that depend on the shape.
        material: ``(nb,)`` int32, one material a block.
        elastic: ``(nm, 9)`` [Pa], see ``kernels.nonlinear.elastic_stress``.
        plastic: ``(nm, 6)``, see ``kernels.plasticity.plastic_constants``.
        gradient: ``(np, m, 48 k)`` [1/m] gradients of the shape functions.
        weight: ``(np, m, 16)`` [m^3] volume of each point.
        hourglass: ``(np, 16 (32 + 144))``: gamma and H of hexahedra; no columns for others.
        state: ``(nb, m, 16 * 13)``, see ``kernels.nonlinear``.
        plastic_work: ``(nb, 16)`` [J].
        hourglass_energy: ``(nb, 16)`` [J].
        slip: ``(nb, 16 * 12)`` [m] plastic part of the amplitudes.
        modulus: ``(nm,)`` [Pa] Young's modulus.
    """

    cells: NDArray[np.int32]
    filled: NDArray[np.int32]
    pattern: NDArray[np.int32]
    material: NDArray[np.int32]
    elastic: NDArray[np.float64]
    plastic: NDArray[np.float64]
    gradient: NDArray[np.float64]
    weight: NDArray[np.float64]
    hourglass: NDArray[np.float64]
    state: NDArray[np.float64]
    plastic_work: NDArray[np.float64]
    hourglass_energy: NDArray[np.float64]
    slip: NDArray[np.float64]
    modulus: NDArray[np.float64]


@njit(**LANE_OPTIONS)
def write_gradient(nodes, values, gradient, w):
    """Write the gradient of nodal values ``(48 k,)``; ``nodes`` is any tuple of k entries."""
    for i in range(3):
        row, source = w[3 * LANES * i :], values[LANES * i :]
        for lane in range(LANES):
            x = y = z = 0.0
            for a in range(len(nodes)):
                value = source[3 * LANES * a + lane]
                x += value * gradient[3 * LANES * a + lane]
                y += value * gradient[(3 * a + 1) * LANES + lane]
                z += value * gradient[(3 * a + 2) * LANES + lane]
            row[lane], row[LANES + lane], row[2 * LANES + lane] = x, y, z


@njit(**LANE_OPTIONS)
def add_point_force(gradient, w, force):
    """Add P b_a to the force of each node ``(48 k,)``."""
    for start in range(0, len(force), 3 * LANES):
        b, f = gradient[start : start + 3 * LANES], force[start : start + 3 * LANES]
        for lane in range(LANES):
            x, y, z = b[lane], b[LANES + lane], b[2 * LANES + lane]
            p = nine(w, NOMINAL + lane)
            f[lane] += p[0] * x + p[1] * y + p[2] * z
            f[LANES + lane] += p[3] * x + p[4] * y + p[5] * z
            f[2 * LANES + lane] += p[6] * x + p[7] * y + p[8] * z


@njit(**LANE_OPTIONS)
def hourglass_amplitudes(nodes, values, gamma, w):
    """Write q of the four modes."""
    for k in range(4):
        mode, q = gamma[8 * LANES * k :], w[HOURGLASS + 3 * LANES * k :]
        for i in range(3):
            source, target = values[LANES * i :], q[LANES * i :]
            for lane in range(LANES):
                total = 0.0
                for a in range(len(nodes)):
                    total += mode[LANES * a + lane] * source[3 * LANES * a + lane]
                target[lane] = total


@njit(**LANE_OPTIONS)
def resist_hourglass(q, slip, resistance, result):
    """Write Q = H (q - slip)."""
    for i in range(12):
        row, target = resistance[12 * LANES * i :], result[LANES * i :]
        for lane in range(LANES):
            total = 0.0
            for j in range(12):
                total += row[LANES * j + lane] * (q[LANES * j + lane] - slip[LANES * j + lane])
            target[lane] = total


@njit(**LANE_OPTIONS)
def write_hourglass_energy(w, slip):
    """Write (q - slip) . Q / 2."""
    for lane in range(LANES):
        total = 0.0
        for k in range(0, 12 * LANES, LANES):
            total += (w[HOURGLASS + k + lane] - slip[k + lane]) * w[RESISTANCE + k + lane]
        w[TRIAL + lane] = 0.5 * total


@njit(cache=True, error_model="numpy")
def carried(strength, mises):
    """Return the hourglass stress that a section of some yield stress carries beside the stress of its centre."""
    return BENDING_STRENGTH * strength * max(LEAST_STRENGTH, 1.0 - (mises / strength) ** 2)


@njit(cache=True, error_model="numpy")
def hourglass_flow(blocks, b, w):
    """Reduce hourglass forces to what a section can carry.

    Plastic work is the slip times the mean force of the step, taken as if the force did not turn in it.
    """
    law, young = blocks.plastic[blocks.material[b]], blocks.modulus[blocks.material[b]]
    state, weight, slip = blocks.state[b, 0], blocks.weight[blocks.pattern[b], 0], blocks.slip[b]
    energy = blocks.hourglass_energy[b]
    for lane in range(LANES):
        before, trial = energy[lane], w[TRIAL + lane]
        energy[lane] = trial
        stress, mises = np.sqrt(2.0 * young * max(trial, 0.0) / weight[lane]), w[MISES + lane]
        if stress <= carried(law[FIRST_YIELD], mises):  # the yield stress is at least this
            continue
        factor = carried(max(yield_stress(state[PLASTIC + lane], 0.0, law), mises), mises) / stress
        if factor < 1.0:
            energy[lane] = factor * factor * trial
            blocks.plastic_work[b, lane] += (1.0 - factor) * (np.sqrt(before * trial) + factor * trial)
            for k in range(0, 12 * LANES, LANES):
                slip[k + lane] += (1.0 - factor) * (w[HOURGLASS + k + lane] - slip[k + lane])
                w[RESISTANCE + k + lane] *= factor


@njit(**LANE_OPTIONS)
def add_hourglass_moment(w, state):
    """Add the nominal stress that balances the moment of the hourglass forces."""
    for lane in range(LANES):
        x = y = z = 0.0
        for k in range(4):
            at = 3 * LANES * k + lane
            a, b, c = w[HOURGLASS + at], w[HOURGLASS + LANES + at], w[HOURGLASS + 2 * LANES + at]
            d, e, f = w[RESISTANCE + at], w[RESISTANCE + LANES + at], w[RESISTANCE + 2 * LANES + at]
            x += b * f - c * e
            y += c * d - a * f
            z += a * e - b * d
        u = six(state, STRETCH + lane)
        t = u[1] + u[2], u[0] + u[2], u[0] + u[1], -u[3], -u[4], -u[5]
        c = cofactor_symmetric(t)
        scale = 1.0 / (t[0] * c[0] + t[3] * c[3] + t[5] * c[5])
        m = full(c)
        x, y, z = applied(m, (scale * x, scale * y, scale * z))
        p = times(nine(w, ROTATION + lane), (0.0, -z, y, z, 0.0, -x, -y, x, 0.0))
        old = nine(w, NOMINAL + lane)
        new = (
            old[0] - p[0], old[1] - p[1], old[2] - p[2], old[3] - p[3], old[4] - p[4],
            old[5] - p[5], old[6] - p[6], old[7] - p[7], old[8] - p[8],
        )  # fmt: skip
        put_nine(w, NOMINAL + lane, new)


@njit(**LANE_OPTIONS)
def add_hourglass_force(gamma, w, force):
    """Add the sum over modes of Q_k gamma_ka to the force of each node."""
    for a in range(8):
        mode, f = gamma[LANES * a :], force[3 * LANES * a : 3 * LANES * (a + 1)]
        for lane in range(LANES):
            x = y = z = 0.0
            for k in range(4):
                g = mode[8 * LANES * k + lane]
                x += g * w[RESISTANCE + 3 * LANES * k + lane]
                y += g * w[RESISTANCE + 3 * LANES * k + LANES + lane]
                z += g * w[RESISTANCE + 3 * LANES * k + 2 * LANES + lane]
            f[lane] += x
            f[LANES + lane] += y
            f[2 * LANES + lane] += z


@njit(cache=True)
def strain_increment(w, state, finite):
    """Write the strain increment of a point; return whether no lane is turned inside out."""
    if not finite:
        small_increment(w, state)
        return True
    add_identity(w)
    upright = rotate(w)
    if upright:
        stretch_increment(w, state)
    return upright


@njit(cache=True)
def add_point(blocks, b, point, path, w):
    """Write the weighted nominal stress of a point of a block from its displacement gradient."""
    state, material, pattern = blocks.state[b, point], blocks.material[b], blocks.pattern[b]
    upright = strain_increment(w, state, path.finite)
    if upright:
        elastic_stress(w, state, blocks.elastic[material])
        weight = blocks.weight[pattern, point]
        plastic_flow(w, state, (blocks.plastic[material], path.step), weight, blocks.plastic_work[b])
        if path.finite:
            nominal_stress_finite(w, state, weight)
        else:
            nominal_stress_small(w, state, weight)
    return upright


@njit(cache=True)
def add_hourglass(blocks, b, finite, values, w):
    """Write the hourglass forces of a block of hexahedra, and add their moment to its nominal stress."""
    control, state = blocks.hourglass[blocks.pattern[b]], blocks.state[b, 0]
    rotation = w[ROTATION : ROTATION + 9 * LANES]
    hourglass_amplitudes((0, 1, 2, 3, 4, 5, 6, 7), values, control, w)
    if finite:
        turn_back(rotation, w[HOURGLASS:RESISTANCE])
    slip = blocks.slip[b]
    resist_hourglass(w[HOURGLASS:RESISTANCE], slip, control[GAMMA_ENTRIES:], w[RESISTANCE:TRIAL])
    write_hourglass_energy(w, slip)
    hourglass_flow(blocks, b, w)
    if finite:
        add_hourglass_moment(w, state)
        turn(rotation, w[RESISTANCE:TRIAL])


@njit(cache=True)
def add_gradient_force(blocks, nodes, path, displacement, force):
    """Subtract the internal force of elements with stored gradients; move their state on by a step.

    Args:
        blocks: The elements.
        nodes: Tuple of k entries, k nodes an element.
        path: Kinematics and step.
        displacement: ``(n, 3)`` [m].
        force: ``(n, 3)`` [N], added to.

    Returns:
        ``FINE``, or the first block with an element that is turned inside out; then the force is not complete.
    """
    w = np.empty(GRADIENT_SLOTS)
    values, result = np.empty(3 * LANES * len(nodes)), np.empty(3 * LANES * len(nodes))
    for b in range(len(blocks.cells)):
        pattern = blocks.pattern[b]
        gather_lanes(blocks.cells[b], displacement, values)
        result[:] = 0.0
        for point in range(blocks.gradient.shape[1]):
            write_gradient(nodes, values, blocks.gradient[pattern, point], w)
            if not add_point(blocks, b, point, path, w):
                return b
            if blocks.hourglass.shape[1]:
                add_hourglass(blocks, b, path.finite, values, w)
                add_hourglass_force(blocks.hourglass[pattern], w, result)
            add_point_force(blocks.gradient[pattern, point], w, result)
        scatter_lanes(blocks.cells[b], blocks.filled[b], result, force)
    return FINE
