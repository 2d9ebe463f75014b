"""Numba kernels of tetrahedra: elements with stored gradients and a path at each point."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.fem.kernels.lanes import (
    LANE_OPTIONS,
    LANES,
    gather_lanes,
    nine,
    scatter_lanes,
)
from reflowshock.fem.kernels.nonlinear import (
    NOMINAL,
    WORK_SLOTS,
    add_identity,
    elastic_stress,
    nominal_stress_finite,
    nominal_stress_small,
    rotate,
    small_increment,
    stretch_increment,
)
from reflowshock.fem.kernels.plastic_lanes import add_work, law_of, plastic_flow

FINE = -1  # no element is turned inside out


class Blocks(NamedTuple):
    """Elements in blocks of sixteen lanes, m points each; blocks of equal shapes share a pattern.

    Attributes:
        cells: ``(nb, k, 16)`` int32 nodes; lanes past the last element repeat it.
        filled: ``(nb,)`` int32 elements of each block.
        pattern: ``(nb,)`` int32 index into the arrays that depend on the shape.
        material: ``(nb,)`` int32, one material a block.
        elastic: ``(nm, 9)`` [Pa], see ``kernels.nonlinear.elastic_stress``.
        plastic: ``(nm, 6)``, see ``materials.plasticity.plastic_constants``.
        gradient: ``(np, m, 48 k)`` [1/m] gradients of the shape functions.
        weight: ``(np, m, 16)`` [m^3] volume of each point.
        state: ``(nb, m, 16 * 13)``, see ``kernels.nonlinear``.
        plastic_work: ``(nb, 16)`` [J].
    """

    cells: NDArray[np.int32]
    filled: NDArray[np.int32]
    pattern: NDArray[np.int32]
    material: NDArray[np.int32]
    elastic: NDArray[np.float64]
    plastic: NDArray[np.float64]
    gradient: NDArray[np.float64]
    weight: NDArray[np.float64]
    state: NDArray[np.float64]
    plastic_work: NDArray[np.float64]


@njit(**LANE_OPTIONS)
def write_gradient(nodes, values, gradient, w):
    """Write the gradient of a nodal vector field at one point of sixteen elements with k nodes.

    Args:
        nodes: Any tuple of k entries; only its length counts, which must be known at compilation.
        values: Nodal vectors such as displacements [m], component c at node a of element e at ``16 * (3 a + c) + e``,
            shape (48 k,).
        gradient: Gradients of the shape functions at the point, in the same order, shape (48 k,) [1/m].
        w: Flat workspace; the 3 x 3 gradients are written to its first 144 entries, dv_i / dx_j of element e at
            ``16 * (3 i + j) + e``.
    """
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
    """Add the force P b_a of one point to each node a of sixteen elements.

    Args:
        gradient: Gradients b_a of the shape functions at the point, component c at node a of element e at
            ``16 * (3 a + c) + e``, shape (48 k,) [1/m].
        w: Flat workspace; reads the nominal stress P times volume at ``NOMINAL`` [J], entry k (row by row) of element e
            at ``16 * k + e``.
        force: Nodal forces in the same order, shape (48 k,) [N], added to.
    """
    for start in range(0, len(force), 3 * LANES):
        b, f = gradient[start : start + 3 * LANES], force[start : start + 3 * LANES]
        for lane in range(LANES):
            x, y, z = b[lane], b[LANES + lane], b[2 * LANES + lane]
            p = nine(w, NOMINAL + lane)
            f[lane] += p[0] * x + p[1] * y + p[2] * z
            f[LANES + lane] += p[3] * x + p[4] * y + p[5] * z
            f[2 * LANES + lane] += p[6] * x + p[7] * y + p[8] * z


@njit(cache=True)
def strain_increment(w, state, finite):
    """Write the strain increments of sixteen elements at one point from the displacement gradients.

    Args:
        w: Flat workspace, entry k of element e at ``16 * k + e``; reads the displacement gradient (nine entries) at
            ``DEFORMATION``, which finite kinematics turn into F; writes the six strain increments at ``INCREMENT``.
        state: Flat state of the point, entry k of element e at ``16 * k + e``, shape (208,): six stresses, plastic
            strain, and six strains (small) or stretches of U (finite), which are updated; order xx, yy, zz, xy, yz, xz.
        finite: Whether rotations and strains are finite, a boolean.

    Returns:
        Whether no element is turned inside out; otherwise the increment is not written.
    """
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
    """Update stress and state of sixteen elements at one point, and write the nominal stress times volume.

    Args:
        blocks: ``Blocks``: all elements in blocks of sixteen, with materials and history; state (stress, plastic
            strain, strain or stretch) and plastic work of the point are updated.
        b: Number of the block, integer.
        point: Number of the integration point in the elements, integer.
        path: ``Path``: small or finite kinematics, and the time step of rate-dependent laws [s].
        w: Flat workspace, shape (544,), entry k of element e at ``16 * k + e``; reads the displacement gradients at
            ``DEFORMATION``, writes the nominal stress times volume at ``NOMINAL`` [J], nine entries each.

    Returns:
        Whether no element is turned inside out; otherwise the stress is not written.
    """
    state, material, pattern = blocks.state[b, point], blocks.material[b], blocks.pattern[b]
    upright = strain_increment(w, state, path.finite)
    if upright:
        elastic_stress(w, state, blocks.elastic[material])
        law, weight = law_of(blocks.plastic, material, path.step), blocks.weight[pattern]
        if plastic_flow(w, blocks.state[b], point, law):
            add_work(w, weight, point, blocks.plastic_work[b])
        if path.finite:
            nominal_stress_finite(w, state, weight[point])
        else:
            nominal_stress_small(w, state, weight[point])
    return upright


@njit(cache=True)
def add_gradient_force(blocks, nodes, path, displacement, force):
    """Subtract the internal force of elements with stored gradients (tetrahedra), and advance their state by a step.

    Args:
        blocks: ``Blocks``: the elements in blocks of sixteen; state and plastic work are updated.
        nodes: Tuple with as many entries as an element has nodes; only its length counts.
        path: ``Path``: small or finite kinematics, and the time step of rate-dependent laws [s].
        displacement: Nodal displacement after the step, shape (n, 3) [m].
        force: Nodal force, shape (n, 3) [N], subtracted from.

    Returns:
        ``FINE`` (-1), or the first block with an element that is turned inside out; then the force is not complete.
    """
    w = np.empty(WORK_SLOTS)
    values, result = np.empty(3 * LANES * len(nodes)), np.empty(3 * LANES * len(nodes))
    for b in range(len(blocks.cells)):
        pattern = blocks.pattern[b]
        gather_lanes(blocks.cells[b], displacement, values)
        result[:] = 0.0
        for point in range(blocks.gradient.shape[1]):
            write_gradient(nodes, values, blocks.gradient[pattern, point], w)
            if not add_point(blocks, b, point, path, w):
                return b
            add_point_force(blocks.gradient[pattern, point], w, result)
        scatter_lanes(blocks.cells[b], blocks.filled[b], result, force)
    return FINE
