"""Numba kernels of one-point hexahedra that yield: sixteen side by side, a path at the centre and of hourglass slip.

Modes, mean deformation F = R U and hourglass amplitudes g^ = R^T g are those of ``kernels.turned_hexahedron``, the
stress s at the centre that of ``kernels.nonlinear``. Hourglass forces are H (g^ - slip), H the stiffness that the
incompatible-modes element has (``elements.one_point``), with the potential (g^ - slip) . H (g^ - slip) / 2. They change
also when R turns against g, which adds to the nominal stress P = V R s U^-1 what ``kernels.box_rotation`` has as
-R [w]x. It keeps energy and angular momentum.

A yielding section carries axial force and moment up to M / M_p + (N / N_p)^2 = 1. The hourglass stress, the root mean
square sqrt(2 E W / V) of the energy W, is therefore limited to sqrt(3)/2 Y (1 - (q / Y)^2), with Y the yield stress and
q the von Mises stress of the centre; the excess becomes plastic slip. Without this limit a plastic hinge of four layers
is 29 % too strong, with it 3 %. Where the centre yields, some strength remains to resist hourglassing.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.fem.kernels.box_rotation import DEFORMATION, ROTATION, add_cross, spin, transform_corners
from reflowshock.fem.kernels.hourglass_lanes import (
    SHIFT,
    SLOTS,
    A,
    B,
    C,
    D,
    replace_by_turned_forces,
    write_amplitudes,
    write_mean_deformation,
    write_resistance,
)
from reflowshock.fem.kernels.lanes import (
    LANE_OPTIONS,
    LANES,
    cofactor_symmetric,
    full,
    gather_lanes,
    nine,
    put_nine,
    scatter_lanes,
    six,
    three,
    times,
)
from reflowshock.fem.kernels.nonlinear import (
    MISES,
    PLASTIC,
    STRESS,
    STRETCH,
    elastic_stress,
    rotate,
    small_increment,
    stretch_increment,
)
from reflowshock.fem.kernels.nonlinear_gradient import FINE
from reflowshock.fem.kernels.plastic_lanes import add_work, law_of, plastic_flow
from reflowshock.fem.kernels.plasticity import yield_stress
from reflowshock.materials.plasticity import FIRST_YIELD

AMPLITUDES = 12 * LANES
BENDING_STRENGTH = np.sqrt(0.75)  # 3/2 of the yield stress at the faces of a section, as a root mean square
LEAST_STRENGTH = 0.05  # share of the bending strength that remains where the centre yields
IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


class OnePointBlocks(NamedTuple):
    """One-point hexahedra in blocks of sixteen lanes; blocks of equal shapes share a pattern.

    Attributes:
        cells, filled, pattern, material, elastic, plastic: As in ``kernels.nonlinear_gradient.Blocks``.
        constants: ``(np, 16 * 120)``, of each lane those of ``kernels.turned_hexahedron``.
        weight: ``(np, 1, 16)`` [m^3] volume.
        state: ``(nb, 1, 16 * 13)``, see ``kernels.nonlinear``.
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
    constants: NDArray[np.float64]
    weight: NDArray[np.float64]
    state: NDArray[np.float64]
    plastic_work: NDArray[np.float64]
    hourglass_energy: NDArray[np.float64]
    slip: NDArray[np.float64]
    modulus: NDArray[np.float64]


@njit(**LANE_OPTIONS)
def do_not_turn(w):
    """Write the identity as rotation R of sixteen elements.

    Args:
        w: Flat workspace, shape (1312,); 144 entries are written at ``ROTATION``, entry k of element e at
            ``16 * k + e``.
    """
    for lane in range(LANES):
        put_nine(w, ROTATION + lane, IDENTITY)


@njit(**LANE_OPTIONS)
def subtract_slip(w, slip):
    """Subtract the plastic slip from the hourglass amplitudes of sixteen elements.

    Args:
        w: Flat workspace; the twelve amplitudes g^ [m] at ``A`` (three components of the modes xy, xz, yz, xyz) become
            their elastic part g^ - slip.
        slip: Slip in the same order, entry k of element e at ``16 * k + e``, shape (192,) [m].
    """
    for k in range(AMPLITUDES):
        w[A + k] -= slip[k]


@njit(**LANE_OPTIONS)
def write_hourglass_energy(w, slip, energy):
    """Compute the hourglass energy (g^ - slip) . H (g^ - slip) / 2 of sixteen elements, and restore g^.

    Args:
        w: Flat workspace with the twelve elastic amplitudes [m] at ``A``, to which the slip is added back, and the
            twelve hourglass forces [N] at ``A + SHIFT``, entry k of element e at ``16 * k + e``.
        slip: Plastic slip of the amplitudes in the same order, shape (192,) [m].
        energy: Written, shape (16,) [J].
    """
    for lane in range(LANES):
        total = 0.0
        for k in range(0, AMPLITUDES, LANES):
            elastic = w[A + k + lane]
            total += elastic * w[A + SHIFT + k + lane]
            w[A + k + lane] = elastic + slip[k + lane]
        energy[lane] = 0.5 * total


@njit(cache=True, error_model="numpy")
def carried(strength, mises):
    """Return the largest hourglass stress that a section carries next to its axial stress, a scalar [Pa].

    Args:
        strength: Yield stress, positive scalar [Pa].
        mises: Von Mises stress at the centre, scalar [Pa].
    """
    return BENDING_STRENGTH * strength * max(LEAST_STRENGTH, 1.0 - (mises / strength) ** 2)


@njit(**LANE_OPTIONS)
def may_slip(w, energy, weight, first, young):
    """Return how many of sixteen elements exceed the hourglass limit at the first yield stress, as a float.

    Args:
        w: Flat workspace; reads the von Mises stresses [Pa] of the sixteen centres at ``DEFORMATION + MISES``.
        energy: Hourglass energy, shape (16,) [J].
        weight: Volume, shape (16,) [m^3].
        first: First yield stress, scalar [Pa].
        young: Young's modulus, scalar [Pa].
    """
    count = 0.0
    for lane in range(LANES):
        ratio = w[DEFORMATION + MISES + lane] / first
        left = 1.0 - ratio * ratio
        limit = BENDING_STRENGTH * first * (left if left > LEAST_STRENGTH else LEAST_STRENGTH)
        count += 1.0 if 2.0 * young * energy[lane] > limit * limit * weight[lane] else 0.0
    return count


@njit(cache=True, error_model="numpy")
def hourglass_flow(blocks, b, before, w):
    """Reduce the hourglass forces of a block of sixteen elements to the limit of a section; the excess becomes slip.

    Plastic work is the slip times the mean force of the step, without the rotation of the force within it.

    Args:
        blocks: ``OnePointBlocks``; hourglass energy, slip and plastic work of the block are updated.
        b: Number of the block, integer.
        before: Hourglass energy before the step, shape (16,) [J].
        w: Flat workspace with twelve amplitudes at ``A`` [m], the von Mises stress of the centre at ``DEFORMATION +
            MISES`` [Pa], and twelve hourglass forces at ``A + SHIFT`` [N], which are reduced.
    """
    law, young = blocks.plastic[blocks.material[b]], blocks.modulus[blocks.material[b]]
    state, weight, slip = blocks.state[b, 0], blocks.weight[blocks.pattern[b], 0], blocks.slip[b]
    energy = blocks.hourglass_energy[b]
    for lane in range(LANES):
        trial = energy[lane]
        stress, mises = np.sqrt(2.0 * young * max(trial, 0.0) / weight[lane]), w[DEFORMATION + MISES + lane]
        if stress <= carried(law[FIRST_YIELD], mises):  # the yield stress is at least this
            continue
        factor = carried(max(yield_stress(state[PLASTIC + lane], 0.0, law), mises), mises) / stress
        if factor < 1.0:
            energy[lane] = factor * factor * trial
            blocks.plastic_work[b, lane] += (1.0 - factor) * (np.sqrt(before[lane] * trial) + factor * trial)
            for k in range(0, AMPLITUDES, LANES):
                slip[k + lane] += (1.0 - factor) * (w[A + k + lane] - slip[k + lane])
                w[A + SHIFT + k + lane] *= factor


@njit(**LANE_OPTIONS)
def write_nominal_small(w, state, weight):
    """Replace F of sixteen elements by the stress times the volume, for small kinematics.

    Args:
        w: Flat workspace, written at ``DEFORMATION`` [J], entry k (row by row) of element e at ``16 * k + e``.
        state: Flat state of the centres in the same order, shape (208,); reads the six stresses [Pa] at ``STRESS``.
        weight: Volume, shape (16,) [m^3].
    """
    for lane in range(LANES):
        s, v = six(state, STRESS + lane), weight[lane]
        put_nine(w, DEFORMATION + lane, full((v * s[0], v * s[1], v * s[2], v * s[3], v * s[4], v * s[5])))


@njit(**LANE_OPTIONS)
def write_nominal_finite(w, state, weight):
    """Replace F of sixteen elements by P, the nominal stress times volume (derivative of the energy by F).

    Args:
        w: Flat workspace, entry k of element e at ``16 * k + e``; reads R at ``ROTATION``, twelve amplitudes g^ at
            ``A`` [m] and hourglass forces at ``A + SHIFT`` [N]; P is written at ``DEFORMATION`` [J], row by row.
        state: Flat state of the centres in the same order, shape (208,); reads six stresses [Pa] at ``STRESS`` and six
            entries of the stretch U at ``STRETCH``.
        weight: Initial volume, shape (16,) [m^3].
    """
    for lane in range(LANES):
        s, u = six(state, STRESS + lane), six(state, STRETCH + lane)
        c = cofactor_symmetric(u)
        v = weight[lane] / (u[0] * c[0] + u[3] * c[3] + u[5] * c[5])
        t = times(full((v * s[0], v * s[1], v * s[2], v * s[3], v * s[4], v * s[5])), full(c))
        moment = add_cross((0.0, 0.0, 0.0), three(w, A + lane), three(w, A + SHIFT + lane))
        moment = add_cross(moment, three(w, B + lane), three(w, B + SHIFT + lane))
        moment = add_cross(moment, three(w, C + lane), three(w, C + SHIFT + lane))
        x, y, z = spin(u, add_cross(moment, three(w, D + lane), three(w, D + SHIFT + lane)))
        turned = (t[0], t[1] + z, t[2] - y, t[3] - z, t[4], t[5] + x, t[6] + y, t[7] - x, t[8])
        put_nine(w, DEFORMATION + lane, times(nine(w, ROTATION + lane), turned))


@njit(cache=True)
def move_centre(blocks, b, path, w):
    """Advance the stress at the centres of a block of sixteen elements by a step.

    Args:
        blocks: ``OnePointBlocks``; state and plastic work of the block are updated.
        b: Number of the block, integer.
        path: ``Path``: small or finite kinematics, and the time step of rate-dependent laws [s].
        w: Flat workspace; reads F (finite) or the displacement gradient (small) at ``DEFORMATION``, nine entries;
            writes R at ``ROTATION`` (finite) and the von Mises stress at ``DEFORMATION + MISES`` [Pa].

    Returns:
        Whether no element is turned inside out; otherwise the state is unchanged.
    """
    state, material, point = blocks.state[b, 0], blocks.material[b], w[DEFORMATION:]
    if path.finite:
        if not rotate(point):
            return False
        stretch_increment(point, state)
    else:
        small_increment(point, state)
    elastic_stress(point, state, blocks.elastic[material])
    weight, law = blocks.weight[blocks.pattern[b]], law_of(blocks.plastic, material, path.step)
    g = np.int64(0)  # of this type: Numba would compile the return to the yield surface once more for a literal
    if plastic_flow(point, blocks.state[b], g, law):
        add_work(point, weight, g, blocks.plastic_work[b])
    return True


@njit(cache=True)
def move_hourglass(blocks, b, unit, before, w):
    """Write hourglass amplitudes and forces of a block of sixteen elements, and update energy and slip.

    Args:
        blocks: ``OnePointBlocks``; hourglass energy, slip and plastic work of the block are updated.
        b: Number of the block, integer.
        unit: 1.0 for finite kinematics (the workspace has F), 0.0 for small ones (it has F - 1), a scalar.
        before: Workspace of shape (16,), overwritten by the hourglass energies before the step [J].
        w: Flat workspace; reads transformed displacements [m], F or F - 1 at ``DEFORMATION`` and R at ``ROTATION``;
            twelve amplitudes [m] are written at ``A``, twelve forces [N] at ``A + SHIFT``.
    """
    k, energy, slip = blocks.constants[blocks.pattern[b]], blocks.hourglass_energy[b], blocks.slip[b]
    weight, material = blocks.weight[blocks.pattern[b], 0], blocks.material[b]
    write_amplitudes(k, w, unit)
    subtract_slip(w, slip)
    write_resistance(k, w)
    for lane in range(LANES):
        before[lane] = energy[lane]
    write_hourglass_energy(w, slip, energy)
    if may_slip(w, energy, weight, blocks.plastic[material, FIRST_YIELD], blocks.modulus[material]) > 0.0:
        hourglass_flow(blocks, b, before, w)


@njit(cache=True)
def add_one_point_force(blocks, path, displacement, force):
    """Subtract the internal force of one-point hexahedra, and advance their state by a step.

    Args:
        blocks: ``OnePointBlocks``: the elements in blocks of sixteen; state, slip, energies and work are updated.
        path: ``Path``: small or finite kinematics, and the time step of rate-dependent laws [s].
        displacement: Nodal displacement after the step, shape (n, 3) [m].
        force: Nodal force, shape (n, 3) [N], subtracted from.

    Returns:
        ``FINE`` (-1), or the first block with an element that is turned inside out; then the force is not complete.
    """
    w, before, unit = np.empty(SLOTS), np.empty(LANES), 1.0 if path.finite else 0.0
    do_not_turn(w)
    for b in range(len(blocks.cells)):
        k, weight = blocks.constants[blocks.pattern[b]], blocks.weight[blocks.pattern[b], 0]
        gather_lanes(blocks.cells[b], displacement, w)
        transform_corners(w)
        write_mean_deformation(k, w, unit)
        if not move_centre(blocks, b, path, w):
            return b
        move_hourglass(blocks, b, unit, before, w)
        if path.finite:
            write_nominal_finite(w, blocks.state[b, 0], weight)
        else:
            write_nominal_small(w, blocks.state[b, 0], weight)
        replace_by_turned_forces(k, w)
        transform_corners(w)
        scatter_lanes(blocks.cells[b], blocks.filled[b], w, force)
    return FINE
