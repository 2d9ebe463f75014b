"""Quadrature over facets: nodal area vectors for pressures, matrices for elastic beddings."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GAUSS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) / np.sqrt(3.0)
CYCLIC = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
BARYCENTRIC = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])  # derivatives of the barycentric coordinates


@dataclass(frozen=True, slots=True, eq=False)
class FacetRule:
    """Quadrature rule of a facet.

    Attributes:
        values: Shape functions at the points, shape (q, m).
        derivatives: Their derivatives in reference coordinates, shape (q, m, 2).
        weights: Weights of the points, shape (q,).
    """

    values: NDArray[np.float64]
    derivatives: NDArray[np.float64]
    weights: NDArray[np.float64]


def _quadrilateral() -> FacetRule:
    """Return the 2 x 2 Gauss rule of a bilinear quadrilateral."""
    factors = 1.0 + GAUSS[:, None, :] * CYCLIC
    return FacetRule(0.25 * factors.prod(axis=2), 0.25 * CYCLIC * factors[:, :, ::-1], np.ones(4))


def triangle() -> FacetRule:
    """Return the one-point (centroid) quadrature rule of a linear triangle, for shape functions of its three nodes.

    Returns:
        Shape functions at the point, shape (1, 3), their derivatives, shape (1, 3, 2), and the weight of the point,
        shape (1,).
    """
    return FacetRule(np.full((1, 3), 1.0 / 3.0), BARYCENTRIC[None], np.full(1, 0.5))


def _quadratic_triangle() -> FacetRule:
    """Return the midpoint-of-edges rule of a quadratic triangle, exact for quadratic integrands."""
    at = 0.5 * (np.eye(3) + np.roll(np.eye(3), 1, axis=1))  # on ab, bc, ca
    vertices = (4.0 * at - 1.0)[:, :, None] * BARYCENTRIC
    turned = np.roll(BARYCENTRIC, -1, axis=0)
    edges = 4.0 * (at[:, :, None] * turned + np.roll(at, -1, axis=1)[:, :, None] * BARYCENTRIC)
    values = np.hstack([np.zeros((3, 3)), np.eye(3)])
    return FacetRule(values, np.concatenate([vertices, edges], axis=1), np.full(3, 1.0 / 6.0))


def _middles_of_edges() -> FacetRule:
    """Return the midpoint-of-edges rule of a linear triangle, exact for products of its shape functions."""
    at = 0.5 * (np.eye(3) + np.roll(np.eye(3), 1, axis=1))
    return FacetRule(at, np.tile(BARYCENTRIC, (3, 1, 1)), np.full(3, 1.0 / 6.0))


RULES = {4: _quadrilateral(), 3: triangle(), 6: _quadratic_triangle()}
PRODUCTS = RULES | {3: _middles_of_edges()}


def area_vectors(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the integrals of shape function times normal over facets, shape (nf, m, 3) [m^2].

    A pressure p gives the nodal forces p times these vectors; their sum over the nodes is the area vector of the facet.

    Args:
        corners: Node coordinates in the order of ``MeshData.facets``, shape (nf, m, 3) [m]; the normal follows from
            the right-hand rule.
    """
    rule = RULES[corners.shape[1]]
    return np.einsum("q,qa,fqi->fai", rule.weights, rule.values, _normals(corners, rule))


def bedding_matrices(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the integrals of products of two shape functions over facets, shape (nf, m, m) [m^2].

    They are the stiffness matrices of an elastic bedding of 1 N/m^3.

    Args:
        corners: Node coordinates of the facets, shape (nf, m, 3) [m].
    """
    rule = PRODUCTS[corners.shape[1]]
    area = np.linalg.norm(_normals(corners, rule), axis=2)
    return np.einsum("q,qa,qb,fq->fab", rule.weights, rule.values, rule.values, area)


def spring_rates(
    cells: NDArray[np.integer],
    facets: NDArray[np.integer],
    mass: NDArray[np.float64],
    corners: NDArray[np.float64],
    stiffness: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return upper bounds for the increase of the largest omega^2 of elements by a bedding, shape (nf,) [1/s^2].

    The bedding of a facet is assigned to its element, with its row sums as stiffness. The frequency of the fastest
    element, omega^2 = 4 / dt^2, bounds the frequency of the mesh and grows by at most the largest ratio of bedding
    stiffness and mass at its nodes.

    Args:
        cells: Nodes of the element of each facet, shape (nf, k).
        facets: Nodes of the facets, shape (nf, m).
        mass: Nodal masses of these elements, shape (nf, k) [kg].
        corners: Node coordinates of the facets, shape (nf, m, 3) [m].
        stiffness: Bedding stiffness along each axis, shape (3,) [N/m^3].
    """
    at_facet = (cells[:, None, :] == facets[:, :, None]).argmax(axis=2)
    largest = bedding_matrices(corners).sum(axis=2)
    return np.asarray(stiffness.max() * (largest / np.take_along_axis(mass, at_facet, axis=1)).max(axis=1))


def _normals(corners: NDArray[np.float64], rule: FacetRule) -> NDArray[np.float64]:
    """Return the normals of facets at the points of a rule, scaled by the Jacobian, shape (nf, q, 3) [m^2]."""
    tangent = np.einsum("fai,qad->fqid", corners, rule.derivatives)
    return np.cross(tangent[..., 0], tangent[..., 1])
