"""Numba kernels of one-point hexahedra that yield: side by side in vectors, a path at the centre and of hourglass slip.

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

from reflowshock.fem.kernels.box_rotation import spin
from reflowshock.fem.kernels.lanes import LANE_OPTIONS, add_elastic, cofactor_symmetric, full, times
from reflowshock.fem.kernels.nonlinear_gradient import FINE
from reflowshock.fem.kernels.turned_hexahedron import (
    ENTRIES,
    amplitudes,
    deformation_gradient,
    displacement_gradient,
    forces_on_modes,
    moment_of,
    resistance,
)
from reflowshock.fem.kernels.vectors.functions import choose, larger, root, smaller
from reflowshock.fem.kernels.vectors.memory import (
    all_below,
    broadcast,
    load,
    place,
    prefetch_range,
    put_six,
    put_three,
    six,
    store,
    three,
)
from reflowshock.fem.kernels.vectors.modes import dot, minus, plus, read_modes, scaled, subtract_modes
from reflowshock.fem.kernels.vectors.plastic import hardened_by, law_at, plastic_strains, returned
from reflowshock.fem.kernels.vectors.polar import polar
from reflowshock.fem.kernels.vectors.vector import VECTOR_OPTIONS, WIDTH

BENDING_STRENGTH = np.sqrt(0.75)  # 3/2 of the yield stress at the faces of a section, as a root mean square
LEAST_STRENGTH = 0.05  # share of the bending strength that remains where the centre yields
PLASTIC, STRETCH, STATE_SLOTS = 6 * WIDTH, 7 * WIDTH, 13 * WIDTH  # of the state, after the stress


class OnePointBlocks(NamedTuple):
    """One-point hexahedra in nb blocks of ``WIDTH`` lanes; blocks of equal shapes share one of np patterns.

    Attributes:
        cells: Nodes of each block in tensor order, ``(nb, 8, WIDTH)`` int32; lanes past the last element repeat it.
        filled: ``(nb,)`` int32 elements of each block.
        pattern: ``(nb,)`` int32 index into ``constants`` and ``weight``.
        material: ``(nb,)`` int32, one material a block.
        elastic: ``(nm, 9)`` [Pa] C_xx, C_yy, C_zz, C_xy, C_yz, C_xz, G_xy, G_yz, G_xz.
        plastic: ``(nm, 6)``: 3 G, A, B [Pa], n, C and reference rate [1/s] (Johnson and Cook).
        constants: ``(np, WIDTH * 120)``, of each lane those of ``kernels.turned_hexahedron``.
        weight: ``(np, 1, WIDTH)`` [m^3] volume.
        state: ``(nb, 1, WIDTH * 13)``: stress [Pa], plastic strain, stretch; entry i of element e at ``WIDTH i + e``.
        plastic_work: ``(nb, WIDTH)`` [J].
        hourglass_energy: ``(nb, WIDTH)`` [J].
        slip: ``(nb, WIDTH * 12)`` [m] plastic part of the amplitudes.
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


@njit(cache=True, error_model="numpy")
def carried(strength, mises):
    """Return the largest hourglass stress that a section carries next to its axial stress, a scalar [Pa].

    Args:
        strength: Yield stress, positive scalar [Pa].
        mises: Von Mises stress at the centre, scalar [Pa].
    """
    return BENDING_STRENGTH * strength * max(LEAST_STRENGTH, 1.0 - (mises / strength) ** 2)


@njit(**VECTOR_OPTIONS)
def section_limit(strength, mises):
    """Return the largest hourglass stress that a section carries next to its axial stress, a SIMD vector [Pa].

    Args:
        strength: Yield stress, positive SIMD vector of ``WIDTH`` lanes [Pa].
        mises: Von Mises stress at the centre, SIMD vector [Pa].
    """
    ratio = mises / strength
    return BENDING_STRENGTH * strength * larger(1.0 - ratio * ratio, broadcast(LEAST_STRENGTH))


@njit(**VECTOR_OPTIONS)
def small_strain(h):
    """Return the strain of a displacement gradient, six SIMD vectors xx, yy, zz, xy, yz, xz with engineering shear.

    Args:
        h: Displacement gradient F - 1, nine SIMD vectors of ``WIDTH`` lanes, row by row.
    """
    return h[0], h[4], h[8], h[1] + h[3], h[5] + h[7], h[2] + h[6]


@njit(**VECTOR_OPTIONS)
def change_of(new, old):
    """Return new - old, six SIMD vectors; both arguments are tuples of six SIMD vectors of ``WIDTH`` lanes."""
    return new[0] - old[0], new[1] - old[1], new[2] - old[2], new[3] - old[3], new[4] - old[4], new[5] - old[5]


@njit(**VECTOR_OPTIONS)
def stretch_increment(new, old):
    """Return the strain increment sym((U_1 - U_0) ((U_0 + U_1) / 2)^-1), six SIMD vectors with engineering shear.

    Args:
        new: Stretch U_1 after the step, six SIMD vectors xx, yy, zz, xy, yz, xz.
        old: Stretch U_0 before it, six SIMD vectors in this order.
    """
    d = change_of(new, old)
    m = (
        0.5 * (new[0] + old[0]), 0.5 * (new[1] + old[1]), 0.5 * (new[2] + old[2]),
        0.5 * (new[3] + old[3]), 0.5 * (new[4] + old[4]), 0.5 * (new[5] + old[5]),
    )  # fmt: skip
    c = cofactor_symmetric(m)
    s, a = 1.0 / (m[0] * c[0] + m[3] * c[3] + m[5] * c[5]), times(full(d), full(c))
    return s * a[0], s * a[4], s * a[8], s * (a[1] + a[3]), s * (a[5] + a[7]), s * (a[2] + a[6])


@njit(**VECTOR_OPTIONS)
def elasticity_at(elastic, material):
    """Return C_xx, C_yy, C_zz, C_xy, C_yz, C_xz, G_xy, G_yz, G_xz of a material, nine scalars [Pa].

    Args:
        elastic: Pointer to the constants of all materials, nine each [Pa].
        material: Index of the material, integer.
    """
    k = 9 * material
    return (
        elastic[k], elastic[k + 1], elastic[k + 2], elastic[k + 3], elastic[k + 4],
        elastic[k + 5], elastic[k + 6], elastic[k + 7], elastic[k + 8],
    )  # fmt: skip


@njit(**VECTOR_OPTIONS)
def mises_of(s):
    """Return the von Mises stress, a SIMD vector of ``WIDTH`` lanes [Pa].

    Args:
        s: Stress, six SIMD vectors xx, yy, zz, xy, yz, xz [Pa].
    """
    x, y, z = s[0] - s[1], s[1] - s[2], s[2] - s[0]
    return root(0.5 * (x * x + y * y + z * z) + 3.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]))


@njit(**VECTOR_OPTIONS)
def move_centre(state, d, elastic, law):
    """Advance stress and plastic strain at the centres by a step, and store them in the state.

    Args:
        state: Pointer to the state, updated (stress [Pa] and plastic strain), and position of the block in it.
        d: Strain increment, six SIMD vectors xx, yy, zz, xy, yz, xz with engineering shear.
        elastic: Orthotropic elasticity, nine scalars [Pa].
        law: Constants of ``law_at``, six scalars: 3 G, first yield stress, B [Pa], n, C, reference increment.

    Returns:
        Stress, six SIMD vectors [Pa]; von Mises stress [Pa], plastic strain and plastic work density [J/m^3], SIMD
        vectors.
    """
    values, at = state
    s, strain, density = add_elastic(six(values, at), d, elastic), load(values, at + PLASTIC), broadcast(0.0)
    mises = mises_of(s)
    if not all_below(mises, law[1]):
        flow = plastic_strains(mises, strain, law)
        s, density = returned(s, d, mises, flow, law[0])
        strain = strain + flow
        mises = mises - law[0] * flow
        store(values, at + PLASTIC, strain)
    put_six(values, at, s)
    return s, mises, strain, density


@njit(**VECTOR_OPTIONS)
def slip_factor(trial, centre, law):
    """Return the factor that reduces hourglass forces to the limit of a section, a SIMD vector, 1 below the limit.

    Args:
        trial: Hourglass stress before the reduction, SIMD vector [Pa].
        centre: Von Mises stress [Pa] and plastic strain of the centre, a tuple of two SIMD vectors.
        law: Constants of ``law_at``, six scalars: 3 G, first yield stress, B [Pa], n, C, reference increment.
    """
    mises, strain = centre
    one, first = broadcast(1.0), section_limit(broadcast(law[1]), mises)  # the yield stress is at least the first one
    limit = section_limit(larger(law[1] + hardened_by(strain, law), mises), mises)
    return choose(first, trial, smaller(limit / larger(trial, first), one), one)


@njit(**VECTOR_OPTIONS)
def read_four(values, at):
    """Return four tuples of three SIMD vectors each, which follow each other in memory.

    Args:
        values: Pointer to an array of doubles.
        at: Position of the first double, integer.
    """
    return (
        three(values, at),
        three(values, at + 3 * WIDTH),
        three(values, at + 6 * WIDTH),
        three(values, at + 9 * WIDTH),
    )


@njit(**VECTOR_OPTIONS)
def four_minus(a, b):
    """Return a - b; both are four tuples (x, y, z) of three SIMD vectors each, and so is the result."""
    return minus(a[0], b[0]), minus(a[1], b[1]), minus(a[2], b[2]), minus(a[3], b[3])


@njit(**VECTOR_OPTIONS)
def four_scaled(factor, a):
    """Return ``factor``, one SIMD vector, times ``a``, four tuples (x, y, z) of three SIMD vectors each."""
    return scaled(factor, a[0]), scaled(factor, a[1]), scaled(factor, a[2]), scaled(factor, a[3])


@njit(**VECTOR_OPTIONS)
def half_product(a, f):
    """Return a . f / 2, one SIMD vector; both arguments are four tuples (x, y, z) of three SIMD vectors each."""
    return 0.5 * (dot(a[0], f[0]) + dot(a[1], f[1]) + dot(a[2], f[2]) + dot(a[3], f[3]))


@njit(**VECTOR_OPTIONS)
def move_hourglass(parts, b, elastic, f, trial):
    """Return hourglass forces within the limit of a section, four tuples of three SIMD vectors [N].

    The excess becomes slip. Plastic work is the slip times the mean force of the step, without the rotation of the
    force within it.

    Args:
        parts: Pointers to slip [m], hourglass energy [J] and plastic work [J] of all blocks, which are updated.
        b: Number of the block, integer.
        elastic: Elastic amplitudes g^ - slip, four tuples (x, y, z) of three SIMD vectors [m].
        f: Hourglass forces H (g^ - slip), four tuples (x, y, z) of three SIMD vectors [N].
        trial: Factor of ``slip_factor`` (0 to 1) and hourglass energy before the reduction [J], two SIMD vectors.
    """
    slips, energies, works = parts
    factor, energy = trial
    lost, at, here = 1.0 - factor, 12 * WIDTH * b, WIDTH * b
    mean = root(larger(load(energies, here) * energy, broadcast(0.0))) + factor * energy
    store(works, here, load(works, here) + lost * mean)
    store(energies, here, factor * factor * energy)
    slip = four_scaled(lost, elastic)
    put_three(slips, at, plus(three(slips, at), slip[0]))
    put_three(slips, at + 3 * WIDTH, plus(three(slips, at + 3 * WIDTH), slip[1]))
    put_three(slips, at + 6 * WIDTH, plus(three(slips, at + 6 * WIDTH), slip[2]))
    put_three(slips, at + 9 * WIDTH, plus(three(slips, at + 9 * WIDTH), slip[3]))
    return four_scaled(factor, f)


@njit(**VECTOR_OPTIONS)
def nominal_stress(r, u, s, volume, moment):
    """Return P, the nominal stress times volume (derivative of the energy by F), nine SIMD vectors row by row [J].

    Args:
        r: Rotation R, nine SIMD vectors of ``WIDTH`` lanes, row by row.
        u: Stretch U, six SIMD vectors xx, yy, zz, xy, yz, xz.
        s: Stress in the rotated frame, six SIMD vectors in this order [Pa].
        volume: Initial volume, SIMD vector [m^3].
        moment: Moment of the hourglass forces, tuple (x, y, z) of three SIMD vectors [J].
    """
    c = cofactor_symmetric(u)
    v = volume / (u[0] * c[0] + u[3] * c[3] + u[5] * c[5])
    t = times(full((v * s[0], v * s[1], v * s[2], v * s[3], v * s[4], v * s[5])), full(c))
    x, y, z = spin(u, moment)
    return times(r, (t[0], t[1] + z, t[2] - y, t[3] - z, t[4], t[5] + x, t[6] + y, t[7] - x, t[8]))


@njit(**VECTOR_OPTIONS)
def small_nominal_stress(s, volume):
    """Return the stress times the volume, nine SIMD vectors row by row [J].

    Args:
        s: Stress, six SIMD vectors xx, yy, zz, xy, yz, xz [Pa].
        volume: Volume, SIMD vector of ``WIDTH`` lanes [m^3].
    """
    return full((volume * s[0], volume * s[1], volume * s[2], volume * s[3], volume * s[4], volume * s[5]))


@njit(**VECTOR_OPTIONS)
def no_rotation():
    """Return the identity matrix, nine SIMD vectors of ``WIDTH`` lanes, row by row."""
    one, none = broadcast(1.0), broadcast(0.0)
    return one, none, none, none, one, none, none, none, one


@njit(**VECTOR_OPTIONS)
def deform(h, old, finite):
    """Return rotation, stretch and strain increment of a step at the centres of elements.

    Args:
        h: Mean displacement gradient F - 1 after the step, nine SIMD vectors of ``WIDTH`` lanes, row by row.
        old: Stretch (``finite``) or small strain before the step, six SIMD vectors xx, yy, zz, xy, yz, xz.
        finite: Whether rotations and strains are finite, boolean.

    Returns:
        Rotation R, nine SIMD vectors; new stretch or small strain, six; strain increment with engineering shear, six;
        and whether det F > 0 in all lanes (always True with small strains).
    """
    if finite:
        r, e, upright = polar(deformation_gradient(h))
        new = e[0] + 1.0, e[1] + 1.0, e[2] + 1.0, e[3], e[4], e[5]
        return r, new, stretch_increment(new, old), upright
    new = small_strain(h)
    return no_rotation(), new, change_of(new, old), True


@njit(**LANE_OPTIONS)
def add_one_point_force(blocks, path, displacement, force):
    """Subtract the internal force of one-point hexahedra, and advance their state by a step.

    Args:
        blocks: ``OnePointBlocks``, the elements in blocks; state, slip, energies and work are updated.
        path: ``Path``: small or finite kinematics, and the time step of rate-dependent laws [s].
        displacement: Nodal displacement after the step, shape (n, 3) [m].
        force: Nodal force, shape (n, 3) [N], subtracted from.

    Returns:
        ``FINE`` (-1), or the first block with an element that is turned inside out; then the force is not complete.
    """
    nodes, k, u, f = place(blocks.cells), place(blocks.constants), place(displacement), place(force)
    state, volumes, works = place(blocks.state), place(blocks.weight), place(blocks.plastic_work)
    slips, energies = place(blocks.slip), place(blocks.hourglass_energy)
    elastic, plastic, finite, count = place(blocks.elastic), place(blocks.plastic), path.finite, len(blocks.filled)
    for b in range(count):
        pattern, material = np.int64(blocks.pattern[b]), np.int64(blocks.material[b])
        at, here = ENTRIES * pattern, STATE_SLOTS * b
        if b + 1 < count:
            prefetch_range(k, ENTRIES * np.int64(blocks.pattern[b + 1]), ENTRIES)
        law, volume = law_at(plastic, material, path.step), load(volumes, WIDTH * pattern)
        q = read_modes(u, nodes, b)
        h = displacement_gradient(k, at, q)
        r, new, d, upright = deform(h, six(state, here + STRETCH), finite)
        if not upright:
            return b
        put_six(state, here + STRETCH, new)
        s, mises, strain, density = move_centre((state, here), d, elasticity_at(elastic, material), law)
        store(works, WIDTH * b, load(works, WIDTH * b) + volume * density)
        g = amplitudes(k, at, q, h, r)
        free = four_minus(g, read_four(slips, 12 * WIDTH * b))
        resisting = resistance(k, at, free)
        energy = half_product(free, resisting)
        trial = root(2.0 * blocks.modulus[material] * larger(energy, broadcast(0.0)) / volume)
        factor = broadcast(1.0)
        if not all_below(trial - section_limit(broadcast(law[1]), mises), 0.0):
            factor = slip_factor(trial, (mises, strain), law)
        resisting = move_hourglass((slips, energies, works), b, free, resisting, (factor, energy))
        p = nominal_stress(r, new, s, volume, moment_of(g, resisting)) if finite else small_nominal_stress(s, volume)
        subtract_modes(f, nodes, b, np.int64(blocks.filled[b]), forces_on_modes(k, at, r, p, resisting))
    return FINE
