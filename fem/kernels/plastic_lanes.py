"""Numba kernels of the radial return at one point of sixteen elements, ``vectors.plastic`` vector by vector."""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.lanes import LANE_OPTIONS, LANES
from reflowshock.fem.kernels.nonlinear import INCREMENT, MISES, NOMINAL, PLASTIC
from reflowshock.fem.kernels.vectors.memory import all_below, broadcast, load, place, store
from reflowshock.fem.kernels.vectors.plastic import TINY, law_at, plastic_strains, returned
from reflowshock.fem.kernels.vectors.vector import VECTOR_OPTIONS, WIDTH

FLOW = NOMINAL  # slot of the workspace where ``kernels.nonlinear`` has the nominal stress, which is written afterwards


@njit(**VECTOR_OPTIONS)
def six_apart(values, at):
    """Return six SIMD vectors of ``WIDTH`` lanes, each from one of six successive slots of sixteen doubles.

    Args:
        values: Pointer to an array of doubles.
        at: Position of the first lane in the first slot, integer; the same lanes of the next slot are 16 doubles later.
    """
    return (
        load(values, at), load(values, at + LANES), load(values, at + 2 * LANES),
        load(values, at + 3 * LANES), load(values, at + 4 * LANES), load(values, at + 5 * LANES),
    )  # fmt: skip


@njit(**VECTOR_OPTIONS)
def put_six_apart(values, at, vectors):
    """Write six SIMD vectors of ``WIDTH`` lanes, each to one of six successive slots of sixteen doubles.

    Args:
        values: Pointer to an array of doubles, overwritten there.
        at: Position of the first lane in the first slot, integer; the same lanes of the next slot are 16 doubles later.
        vectors: Tuple of six SIMD vectors.
    """
    store(values, at, vectors[0])
    store(values, at + LANES, vectors[1])
    store(values, at + 2 * LANES, vectors[2])
    store(values, at + 3 * LANES, vectors[3])
    store(values, at + 4 * LANES, vectors[4])
    store(values, at + 5 * LANES, vectors[5])


@njit(**LANE_OPTIONS)
def law_of(plastic, material, step):
    """Return the constants of the plastic law of a material for steps of a length, six scalars.

    Args:
        plastic: 3 G, A, B [Pa], n, C and reference rate [1/s] of each material (Johnson and Cook), shape (nm, 6).
        material: Index of the material, integer.
        step: Time step dt, scalar [s]; infinity means quasi-static.

    Returns:
        3 G [Pa], first yield stress [Pa], hardening modulus [Pa], exponent, rate sensitivity (0 where the rate does not
        count), and the increment of the plastic strain at the reference rate (then 1).
    """
    return law_at(place(plastic), material, step)


@njit(**LANE_OPTIONS)
def plastic_flow(w, state, g, law):
    """Return the stress of sixteen elements at one point to the yield surface where the trial state lies outside.

    Args:
        w: Flat workspace, shape (544,), with six strain increments (engineering shear) from ``INCREMENT`` on and the
            trial von Mises stress at ``MISES`` [Pa], which becomes the one after the step; plastic work densities
            [J/m^3] are written at ``FLOW``. Each is a slot of sixteen elements.
        state: State of all points, entry k of element e in column ``16 * k + e``, shape (points, >= 112): six elastic
            trial stresses [Pa] and the plastic strain; both are updated at the point (radial return).
        g: Number of the point, row of ``state``, integer.
        law: Constants of ``law_of``, six scalars: 3 G, first yield stress, B [Pa], n, C, reference increment.

    Returns:
        Whether any of the elements yields; then ``add_work`` can follow.
    """
    work, values, row, any_yields = place(w), place(state), np.int64(g) * state.shape[1], False
    for lane in range(0, LANES, WIDTH):
        at, trial, density = row + lane, load(work, MISES + lane), broadcast(0.0)
        if not all_below(trial, law[1]):
            strain = load(values, at + PLASTIC)
            flow = plastic_strains(trial, strain, law)
            s, density = returned(six_apart(values, at), six_apart(work, INCREMENT + lane), trial, flow, law[0])
            put_six_apart(values, at, s)
            store(values, at + PLASTIC, strain + flow)
            store(work, MISES + lane, trial - law[0] * flow)
            any_yields = any_yields or not all_below(flow, TINY)
        store(work, FLOW + lane, density)
    return any_yields


@njit(**LANE_OPTIONS)
def add_work(w, weight, g, work):
    """Add the plastic work of sixteen elements at a point that yields.

    It is the mean of the stress before and after the step times the plastic strain increment, as the elastic energy s :
    C^-1 : s / 2 is integrated by the mean stress exactly: the sum of both is the work of the internal force.

    Args:
        w: Flat workspace; reads the sixteen plastic work densities at ``FLOW`` [J/m^3], which ``plastic_flow`` writes.
        weight: Volumes of the points, shape (points, 16) [m^3].
        g: Number of the point, row of ``weight``, integer.
        work: Plastic work of each element, shape (16,) [J], added to.
    """
    for lane in range(LANES):
        work[lane] += weight[g, lane] * w[FLOW + lane]
