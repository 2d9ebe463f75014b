"""Numba kernels of the 8-node hexahedron: stiffness with incompatible modes, lumped mass, mean gradients.

Nodes are in tensor order: bit d of the local index is the side in direction d. Voigt order as in ``materials``.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

SIDES = np.array([[1.0 if (a >> d) & 1 else -1.0 for d in range(3)] for a in range(8)])
GAUSS = SIDES / np.sqrt(3.0)
FINITE = {"reassoc", "contract", "arcp", "nsz"}


def shape_derivatives(xi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return dN_a/dxi_d of the eight trilinear shape functions, shape (m, 8, 3).

    Args:
        xi: Points in the reference cube [-1, 1]^3, shape (m, 3).
    """
    factors = 1.0 + xi[:, None, :] * SIDES
    derivatives = np.empty((len(xi), 8, 3))
    for d in range(3):
        e, f = (d + 1) % 3, (d + 2) % 3
        derivatives[:, :, d] = 0.125 * SIDES[:, d] * factors[:, :, e] * factors[:, :, f]
    return derivatives


GAUSS_DERIVATIVES = shape_derivatives(GAUSS)
CENTRE_DERIVATIVES = shape_derivatives(np.zeros((1, 3)))[0]
GAUSS_VALUES = 0.125 * np.prod(1.0 + GAUSS[:, None, :] * SIDES, axis=2)


@njit(cache=True, fastmath=FINITE)
def add_product(left, right, scale, result):
    """Add ``scale * left @ right`` to ``result``, in place, for matrices of shapes (m, k), (k, n) and (m, n).

    Args:
        left: First factor, shape (m, k).
        right: Second factor, shape (k, n).
        scale: Scalar factor.
        result: Matrix, shape (m, n), added to.
    """
    for i in range(left.shape[0]):
        for k in range(left.shape[1]):
            factor = scale * left[i, k]
            for j in range(right.shape[1]):
                result[i, j] += factor * right[k, j]


@njit(cache=True)
def invert_jacobian(points, derivatives, jacobian, inverse):
    """Compute the Jacobian J_ij = dx_i/dxi_j of a hexahedron at one point, and its inverse.

    Args:
        points: Node positions, shape (8, 3) [m].
        derivatives: Derivatives of the shape functions at the point, shape (8, 3).
        jacobian: Written, shape (3, 3) [m].
        inverse: Written: dxi_j/dx_i at row j, column i, shape (3, 3) [1/m].

    Returns:
        Determinant of J [m^3]; not positive if the element is inverted there.
    """
    jacobian[:] = 0.0
    add_product(points.T, derivatives, 1.0, jacobian)
    for i in range(3):
        for j in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            p, q = (j + 1) % 3, (j + 2) % 3
            inverse[j, i] = jacobian[k, p] * jacobian[m, q] - jacobian[k, q] * jacobian[m, p]
    determinant = jacobian[0, 0] * inverse[0, 0] + jacobian[0, 1] * inverse[1, 0] + jacobian[0, 2] * inverse[2, 0]
    inverse /= determinant
    return determinant


@njit(cache=True)
def write_strain_columns(strain, column, gx, gy, gz):
    """Write three columns of a strain matrix, for the three displacement components of one shape function.

    Args:
        strain: Strain matrix, rows xx, yy, zz, xy, yz, xz (engineering shear), shape (6, k) [1/m]; three columns are
            written.
        column: Number of the first of these columns, for the component along x, integer.
        gx: Derivative of the function along x, scalar [1/m].
        gy: Derivative along y, scalar [1/m].
        gz: Derivative along z, scalar [1/m].
    """
    strain[:, column : column + 3] = 0.0
    strain[0, column] = gx
    strain[1, column + 1] = gy
    strain[2, column + 2] = gz
    strain[3, column] = gy
    strain[3, column + 1] = gx
    strain[4, column + 1] = gz
    strain[4, column + 2] = gy
    strain[5, column] = gz
    strain[5, column + 2] = gx


@njit(cache=True)
def condense(full, kept):
    """Eliminate all but the first unknowns of a symmetric matrix in place (Schur complement).

    Args:
        full: Matrix, shape (n, n); on return its upper left block of shape (kept, kept) is the result, the other
            entries are undefined.
        kept: Number of unknowns that remain, scalar.
    """
    for pivot in range(full.shape[0] - 1, kept - 1, -1):
        for i in range(pivot):
            factor = full[i, pivot] / full[pivot, pivot]
            for j in range(pivot):
                full[i, j] -= factor * full[pivot, j]


@njit(cache=True)
def orthonormal_linear(weights, basis):
    """Orthonormalise the functions 1, xi, eta, zeta at the eight Gauss points by Gram-Schmidt.

    Args:
        weights: Weights of the Gauss points in the scalar product, shape (8,) [m^3].
        basis: Written: values of the four functions at the Gauss points, shape (4, 8).
    """
    for k in range(4):
        for g in range(8):
            basis[k, g] = 1.0 if k == 0 else GAUSS[g, k - 1]
        for m in range(k):
            product = 0.0
            for g in range(8):
                product += weights[g] * basis[k, g] * basis[m, g]
            for g in range(8):
                basis[k, g] -= product * basis[m, g]
        square = 0.0
        for g in range(8):
            square += weights[g] * basis[k, g] ** 2
        for g in range(8):
            basis[k, g] /= np.sqrt(square)


@njit(cache=True)
def linear_divergence(weights, gradient, basis, result):
    """Compute the least-squares linear part of the shape-function gradients of a hexahedron (B-bar dilatation).

    Each gradient component is a function of the position in the element; it is fitted by 1, xi, eta, zeta.

    Args:
        weights: Weights of the Gauss points in the order of ``GAUSS``, shape (8,) [m^3].
        gradient: Gradient of each shape function, Gauss point by node by direction, shape (8, 8, 3) [1/m].
        basis: Workspace of shape (4, 8), overwritten by the orthonormal linear functions at the Gauss points.
        result: Written: linear part of the gradients in the order of ``gradient``, shape (8, 8, 3) [1/m].
    """
    orthonormal_linear(weights, basis)
    result[:] = 0.0
    for a in range(8):
        for i in range(3):
            for k in range(4):
                coefficient = 0.0
                for g in range(8):
                    coefficient += weights[g] * basis[k, g] * gradient[g, a, i]
                for g in range(8):
                    result[g, a, i] += coefficient * basis[k, g]


class StrainBench(NamedTuple):
    """Work space of ``write_strains``: three 3 x 3 matrices, gradients and divergence (8, 8, 3), basis (4, 8)."""

    jacobian: NDArray[np.float64]
    inverse: NDArray[np.float64]
    centre: NDArray[np.float64]
    gradient: NDArray[np.float64]
    divergence: NDArray[np.float64]
    basis: NDArray[np.float64]


@njit(cache=True)
def new_strain_bench():
    """Return a ``StrainBench``, the workspace of ``write_strains`` for one element; its arrays are uninitialised."""
    square, nodal = (3, 3), (8, 8, 3)
    return StrainBench(
        np.empty(square), np.empty(square), np.empty(square), np.empty(nodal), np.empty(nodal), np.empty((4, 8))
    )


@njit(cache=True)
def write_strains(points, bench, strain, weights):
    """Compute the strain matrices of a hexahedron with Taylor-modified Wilson modes at 2 x 2 x 2 Gauss points.

    The gradients of the modes 1 - xi_k^2 use the Jacobian at the centre, scaled by det J_0 / det J, so that the patch
    test holds on distorted shapes (Taylor, Beresford & Wilson, IJNME 10, 1976). No mode balances the bilinear part of
    the compatible dilatation, which locks nearly incompressible beams under shear; only its linear part is kept (B-bar;
    least squares with the weights det J keeps the patch test).

    Args:
        points: Node positions in tensor order, shape (8, 3) [m].
        bench: Workspace of ``new_strain_bench``, overwritten.
        strain: Written: matrix of each Gauss point, rows xx, yy, zz, xy, yz, xz; columns are 24 nodal components (node
            by node), then three components of each of the three modes, shape (8, 6, 33) [1/m].
        weights: Written: volume of each Gauss point, det J, shape (8,) [m^3].
    """
    inverse, centre, gradient, divergence = bench.inverse, bench.centre, bench.gradient, bench.divergence
    gradient[:] = 0.0
    centre_determinant = invert_jacobian(points, CENTRE_DERIVATIVES, bench.jacobian, centre)
    for g in range(8):
        weights[g] = invert_jacobian(points, GAUSS_DERIVATIVES[g], bench.jacobian, inverse)
        add_product(GAUSS_DERIVATIVES[g], inverse, 1.0, gradient[g])
    linear_divergence(weights, gradient, bench.basis, divergence)
    for g in range(8):
        for a in range(8):
            write_strain_columns(strain[g], 3 * a, gradient[g, a, 0], gradient[g, a, 1], gradient[g, a, 2])
            for i in range(3):
                for row in range(3):
                    strain[g, row, 3 * a + i] += (divergence[g, a, i] - gradient[g, a, i]) / 3.0
        for k in range(3):
            scale = -2.0 * GAUSS[g, k] * centre_determinant / weights[g]
            write_strain_columns(
                strain[g], 24 + 3 * k, scale * centre[k, 0], scale * centre[k, 1], scale * centre[k, 2]
            )


@njit(cache=True)
def stiffness(points, elasticity, material, result):
    """Compute the stiffness of hexahedra with incompatible modes; the nine internal unknowns are condensed.

    Args:
        points: Node positions in tensor order, shape (ne, 8, 3) [m].
        elasticity: Elasticity of each material, shape (nm, 6, 6) [Pa].
        material: Index of each element into ``elasticity``, shape (ne,).
        result: Written, node by node, shape (ne, 24, 24) [N/m].
    """
    bench, strain, weights = new_strain_bench(), np.empty((8, 6, 33)), np.empty(8)
    stress, full = np.empty((6, 33)), np.empty((33, 33))
    for e in range(len(points)):
        full[:] = 0.0
        write_strains(points[e], bench, strain, weights)
        for g in range(8):
            stress[:] = 0.0
            add_product(elasticity[material[e]], strain[g], 1.0, stress)
            add_product(strain[g].T, stress, weights[g], full)
        condense(full, 24)
        copy_square(full, result[e])


@njit(cache=True)
def copy_square(source, result):
    """Copy the upper left n x n part of ``source``, shape (>= n, >= n), into ``result``, shape (n, n).

    As a slice assignment, Numba would need seconds to compile the message of the error for wrong shapes.
    """
    for i in range(result.shape[0]):
        for j in range(result.shape[1]):
            result[i, j] = source[i, j]


@njit(cache=True)
def geometry(points, nodal_volume, gradient):
    """Compute nodal volumes and mean gradients of hexahedra.

    Args:
        points: Node positions in tensor order, shape (ne, 8, 3) [m].
        nodal_volume: Written: integral of each shape function, shape (ne, 8) [m^3].
        gradient: Written: volume average of each shape function's gradient, shape (ne, 8, 3) [1/m]; incompatible modes
            add nothing to the average strain, so this recovers the element's average strain exactly.

    Returns:
        Lowest Jacobian determinant at the Gauss points of each element, shape (ne,) [m^3]; not positive if inverted.
    """
    jacobian, inverse = np.empty((3, 3)), np.empty((3, 3))
    lowest = np.full(len(points), np.inf)
    for e in range(len(points)):
        nodal_volume[e] = 0.0
        gradient[e] = 0.0
        volume = 0.0
        for g in range(8):
            determinant = invert_jacobian(points[e], GAUSS_DERIVATIVES[g], jacobian, inverse)
            add_product(GAUSS_DERIVATIVES[g], inverse, determinant, gradient[e])
            for a in range(8):
                nodal_volume[e, a] += determinant * GAUSS_VALUES[g, a]
            volume += determinant
            lowest[e] = min(lowest[e], determinant)
        for a in range(8):
            for i in range(3):
                gradient[e, a, i] /= volume
    return lowest
