"""Numba kernels of deformation plasticity (Hencky): stress as a function of the strain, elements at a displacement.

Under proportional loading J2 flow theory gives the same stress as a single radial return from rest. With the deviator e
of the strain, q_e = 3 G sqrt(2/3 e : e), and p from q_e - 3 G p = Y(p),

    s = 2 G (1 - 3 G p / q_e) e,     pressure elastic:

a secant shear modulus. The stress has a convex potential of the strain, so that equilibrium is a least energy, and its
tangent, 2 G (1 - 3 G p / q_e) across e and 2 G Y' / (3 G + Y') along it, is symmetric and positive.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.fem.kernels.hexahedron import add_product, condense, copy_square, new_strain_bench, write_strains
from reflowshock.fem.kernels.nonlinear_one_point import carried
from reflowshock.fem.kernels.plasticity import plastic_increment, yield_stress
from reflowshock.materials.plasticity import FIRST_YIELD

NODAL, ALL = 24, 33  # components of a hexahedron at its nodes, and with its incompatible modes
MODE_ITERATIONS = 60
MODE_CONVERGED = 1e-12  # force on the modes over the forces that it is the sum of
OVERSHOOT = 0.9  # of the slope at its start is where a step along a direction ends at most
LINE_SEARCHES = 12


class PointLaw(NamedTuple):
    """Material of an element: elasticity ``(6, 6)`` [Pa], isotropic where it yields, and its plastic constants."""

    elasticity: NDArray[np.float64]
    plastic: NDArray[np.float64]


class Shape(NamedTuple):
    """Strain matrices ``(m, 6, k)`` [1/m] of the points of an element and their weights ``(m,)`` [m^3]; k unknowns."""

    strain: NDArray[np.float64]
    weight: NDArray[np.float64]


class ElementState(NamedTuple):
    """Stress, internal force and tangent of an element at a displacement; arrays over many elements add a first axis.

    Attributes:
        points: Stress [Pa] and equivalent plastic strain of the integration points, shape (m, 7).
        force: Internal force, shape (k,) [N].
        tangent: Tangent stiffness, shape (k, k) [N/m].
    """

    points: NDArray[np.float64]
    force: NDArray[np.float64]
    tangent: NDArray[np.float64]


@njit(cache=True)
def hencky(strain, law, stress, tangent):
    """Compute stress and tangent of deformation plasticity at one point.

    Args:
        strain: Strain xx, yy, zz, xy, yz, xz with engineering shear, shape (6,).
        law: ``PointLaw``: elasticity (6, 6) [Pa] and plastic constants (6,): 3 G [Pa], A and B [Pa] and n of the yield
            stress A + B p^n, rate constant C, reference rate [1/s]; A is infinite for an elastic material.
        stress: Written: xx, yy, zz, xy, yz, xz, shape (6,) [Pa].
        tangent: Written: derivative of the stress by the strain, shape (6, 6) [Pa].

    Returns:
        Equivalent plastic strain, 0 where the material is elastic.
    """
    copy_square(law.elasticity, tangent)
    stress[:] = 0.0
    for i in range(6):
        for j in range(6):
            stress[i] += law.elasticity[i, j] * strain[j]
    constants = law.plastic
    if constants[FIRST_YIELD] == np.inf:
        return 0.0
    mean = (stress[0] + stress[1] + stress[2]) / 3.0
    square = 0.0
    for i in range(3):
        stress[i] -= mean
        square += stress[i] ** 2 + 2.0 * stress[3 + i] ** 2
    trial = np.sqrt(1.5 * square)
    flow = plastic_increment(trial, 0.0, constants, np.inf)
    if flow > 0.0:
        lost = constants[0] * flow / trial
        hardening = constants[2] * constants[3] * flow ** (constants[3] - 1.0)
        along = 1.0 - lost - hardening / (constants[0] + hardening)
        soften(stress, 2.0 / 3.0 * constants[0] * lost, 2.0 / 3.0 * constants[0] * along / square, tangent)
        for i in range(6):
            stress[i] *= 1.0 - lost
    for i in range(3):
        stress[i] += mean
    return flow


@njit(cache=True)
def soften(deviator, across, along, tangent):
    """Subtract the softening by plastic flow from the tangent, for all deviators and along the current deviator.

    Args:
        deviator: Elastic stress deviator, xx, yy, zz, xy, yz, xz, shape (6,) [Pa].
        across: Reduction of 2 G for all deviators, scalar [Pa].
        along: Additional reduction along the deviator, over its square, scalar [1/Pa].
        tangent: Elastic tangent on entry, elastoplastic tangent on return, shape (6, 6) [Pa].
    """
    for i in range(6):
        for j in range(6):
            tangent[i, j] -= along * deviator[i] * deviator[j]
    for i in range(3):
        for j in range(3):
            tangent[i, j] += across / 3.0
    for i in range(6):
        tangent[i, i] -= across * (1.0 if i < 3 else 0.5)


@njit(cache=True)
def add_points(shape, unknowns, law, state):
    """Compute stresses, internal force and tangent of one element from its displacements.

    Args:
        shape: ``Shape``: strain matrices (m, 6, k) [1/m] and weights (m,) [m^3] of the integration points.
        unknowns: Displacements of 24 nodal components, then of incompatible modes if any, shape (k,) [m].
        law: ``PointLaw`` of the element: elasticity (6, 6) [Pa] and plastic constants (6,).
        state: ``ElementState`` of the element, overwritten: stress [Pa] and equivalent plastic strain of the points
            (m, 7), force (k,) [N], tangent (k, k) [N/m].

    Returns:
        Largest sum of magnitudes of the force contributions to an incompatible mode [N], the scale of its residual.
    """
    tangent, product, local = np.empty((6, 6)), np.empty((6, len(unknowns))), np.empty(6)
    scale = np.zeros(len(unknowns))
    state.force[:] = 0.0
    state.tangent[:] = 0.0
    for g in range(len(shape.weight)):
        strain, weight = shape.strain[g], shape.weight[g]
        local[:] = 0.0
        for i in range(6):
            for k in range(len(unknowns)):
                local[i] += strain[i, k] * unknowns[k]
        stress = state.points[g, :6]
        state.points[g, 6] = hencky(local, law, stress, tangent)
        for k in range(len(unknowns)):
            force = 0.0
            for i in range(6):
                force += strain[i, k] * stress[i]
            state.force[k] += weight * force
            scale[k] += weight * abs(force)
        product[:] = 0.0
        add_product(tangent, strain, 1.0, product)
        add_product(strain.T, product, weight, state.tangent)
    return largest_of(scale[NODAL:])


@njit(cache=True)
def relax_modes(shape, unknowns, law, state):
    """Bring the nine incompatible modes of a hexahedron into equilibrium by Newton's method.

    The energy is convex, so a step beyond the minimum along its direction is shortened to where the slope changes sign.

    Args:
        shape: ``Shape`` of the element: strain matrices (8, 6, 33) [1/m], weights (8,) [m^3].
        unknowns: Nodal displacements (24 entries, fixed), then the modes (9 entries, start values replaced by the
            solution), shape (33,) [m].
        law: ``PointLaw`` of the element: elasticity (6, 6) [Pa] and plastic constants (6,).
        state: ``ElementState`` of the element, overwritten: stress [Pa] and equivalent plastic strain of the points
            (8, 7), force (33,) [N], tangent (33, 33) [N/m].

    Returns:
        Whether the force on the modes fell below 1e-12 of its contributions within 60 iterations.
    """
    scale, step, start = add_points(shape, unknowns, law, state), np.empty(ALL - NODAL), np.empty(ALL - NODAL)
    rest, modes = state.force[NODAL:], unknowns[NODAL:]
    for _ in range(MODE_ITERATIONS):
        if largest_of(rest) <= MODE_CONVERGED * scale:
            return True
        for k in range(len(rest)):
            step[k], start[k] = -rest[k], modes[k]
        solve(state.tangent[NODAL:, NODAL:], step)
        slope, length = product(step, rest), 1.0
        for _ in range(LINE_SEARCHES):
            for k in range(len(modes)):
                modes[k] = start[k] + length * step[k]
            scale = add_points(shape, unknowns, law, state)
            after = product(step, rest)
            if after <= -OVERSHOOT * slope:
                break
            length *= slope / (slope - after)
    return False


@njit(cache=True)
def largest_of(values):
    """Return the largest magnitude in an array of shape (k,), 0 if it is empty, and NaN if a value is NaN."""
    largest = 0.0
    for value in values:
        if abs(value) > largest or np.isnan(value):
            largest = abs(value)
    return largest


@njit(cache=True)
def product(left, right):
    """Return the scalar product of two vectors, both arrays of shape (k,), as a scalar."""
    total = 0.0
    for k in range(len(left)):
        total += left[k] * right[k]
    return total


@njit(cache=True)
def solve(matrix, right):
    """Solve a symmetric positive definite linear system A x = b in place by Gaussian elimination.

    Args:
        matrix: Matrix A, shape (k, k), overwritten by its upper triangular factor.
        right: Right-hand side b on entry, solution x on return, shape (k,).
    """
    size = len(right)
    for pivot in range(size):
        for i in range(pivot + 1, size):
            factor = matrix[i, pivot] / matrix[pivot, pivot]
            right[i] -= factor * right[pivot]
            for j in range(pivot + 1, size):
                matrix[i, j] -= factor * matrix[pivot, j]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            right[i] -= matrix[i, j] * right[j]
        right[i] /= matrix[i, i]


@njit(cache=True)
def hexahedra(corners, displacement, materials, states):
    """Compute stresses, forces and tangents of fully integrated hexahedra with incompatible modes from displacements.

    Args:
        corners: Node positions in tensor order, shape (ne, 8, 3) [m].
        displacement: Displacement node by node, less free expansion, shape (ne, 24) [m].
        materials: Tuple: elasticities (nm, 6, 6) [Pa], plastic constants (nm, 6), material index of each element (ne,).
        states: ``ElementState``, written: stress [Pa] and plastic strain at the Gauss points (ne, 8, 7), internal force
            (ne, 24) [N], tangent (ne, 24, 24) [N/m] with the modes condensed.

    Returns:
        Index of the first element whose modes do not converge; then the rest is not computed. Otherwise ``ne``.
    """
    elasticity, plastic, material = materials
    bench, shape, unknowns = new_strain_bench(), Shape(np.empty((8, 6, ALL)), np.empty(8)), np.empty(ALL)
    force, tangent = np.empty(ALL), np.empty((ALL, ALL))
    for e in range(len(corners)):
        write_strains(corners[e], bench, shape.strain, shape.weight)
        for k in range(ALL):
            unknowns[k] = displacement[e, k] if k < NODAL else 0.0
        law = PointLaw(elasticity[material[e]], plastic[material[e]])
        if not relax_modes(shape, unknowns, law, ElementState(states.points[e], force, tangent)):
            return e
        for k in range(NODAL):
            states.force[e, k] = force[k]
        condense(tangent, NODAL)
        copy_square(tangent, states.tangent[e])
    return len(corners)


@njit(cache=True)
def one_point(shape, displacement, materials, states):
    """Compute stresses, forces and tangents of one-point hexahedra from displacements, without hourglass forces.

    Args:
        shape: ``Shape`` of all elements: mean strain matrices (ne, 1, 6, 24) [1/m], volumes (ne, 1) [m^3].
        displacement: Displacement node by node, less free expansion, shape (ne, 24) [m].
        materials: Tuple: elasticities (nm, 6, 6) [Pa], plastic constants (nm, 6) as ``hencky`` names them, material
            index of each element (ne,).
        states: ``ElementState``, written, its old content is not read: six stresses [Pa] and the equivalent plastic
            strain (ne, 1, 7), internal force (ne, 24) [N], tangent (ne, 24, 24) [N/m].
    """
    elasticity, plastic, material = materials
    for e in range(len(displacement)):
        law = PointLaw(elasticity[material[e]], plastic[material[e]])
        own = ElementState(states.points[e], states.force[e], states.tangent[e])
        add_points(Shape(shape.strain[e], shape.weight[e]), displacement[e], law, own)


@njit(cache=True, error_model="numpy")
def hourglass_share(points, stress, laws, share):
    """Compute the fraction of the elastic hourglass forces that one-point hexahedra carry when their sections yield.

    Args:
        points: Stress xx, yy, zz, xy, yz, xz [Pa] and equivalent plastic strain at the centres, shape (ne, 1, 7).
        stress: Magnitude of the elastic hourglass stress, shape (ne,) [Pa].
        laws: Plastic constants 3 G, A, B [Pa], n, C, reference rate [1/s] of each element, shape (ne, 6).
        share: Written: fraction between 0 and 1, shape (ne,); 1 where the section is elastic.
    """
    for e in range(len(stress)):
        s = points[e, 0]
        square = 0.5 * ((s[0] - s[1]) ** 2 + (s[1] - s[2]) ** 2 + (s[2] - s[0]) ** 2)
        mises = np.sqrt(square + 3.0 * (s[3] ** 2 + s[4] ** 2 + s[5] ** 2))
        share[e] = 1.0
        if stress[e] > carried(laws[e, FIRST_YIELD], mises):
            strength = max(yield_stress(s[6], 0.0, laws[e]), mises)
            share[e] = min(1.0, carried(strength, mises) / stress[e])
