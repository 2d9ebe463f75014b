"""Integrals over facets: how a pressure on them becomes nodal forces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GAUSS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) / np.sqrt(3.0)
CYCLIC = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
BARYCENTRIC = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])  # derivatives of the barycentric coordinates


@dataclass(frozen=True, slots=True, eq=False)
class FacetRule:
    """Shape functions ``values (q, m)`` and ``derivatives (q, m, 2)`` at points with ``weights (q,)``."""

    values: NDArray[np.float64]
    derivatives: NDArray[np.float64]
    weights: NDArray[np.float64]


def quadrilateral() -> FacetRule:
    """Return 2 x 2 Gauss points."""
    factors = 1.0 + GAUSS[:, None, :] * CYCLIC
    return FacetRule(0.25 * factors.prod(axis=2), 0.25 * CYCLIC * factors[:, :, ::-1], np.ones(4))


def triangle() -> FacetRule:
    """Return the centroid."""
    return FacetRule(np.full((1, 3), 1.0 / 3.0), BARYCENTRIC[None], np.full(1, 0.5))


def quadratic_triangle() -> FacetRule:
    """Return the middles of the edges: exact for quadratic integrands, and the vertices carry nothing there."""
    at = 0.5 * (np.eye(3) + np.roll(np.eye(3), 1, axis=1))  # on ab, bc, ca
    vertices = (4.0 * at - 1.0)[:, :, None] * BARYCENTRIC
    turned = np.roll(BARYCENTRIC, -1, axis=0)
    edges = 4.0 * (at[:, :, None] * turned + np.roll(at, -1, axis=1)[:, :, None] * BARYCENTRIC)
    values = np.hstack([np.zeros((3, 3)), np.eye(3)])
    return FacetRule(values, np.concatenate([vertices, edges], axis=1), np.full(3, 1.0 / 6.0))


def middles_of_edges() -> FacetRule:
    """Return the middles of a triangle's edges: exact for products of its shape functions."""
    at = 0.5 * (np.eye(3) + np.roll(np.eye(3), 1, axis=1))
    return FacetRule(at, np.tile(BARYCENTRIC, (3, 1, 1)), np.full(3, 1.0 / 6.0))


RULES = {4: quadrilateral(), 3: triangle(), 6: quadratic_triangle()}
PRODUCTS = RULES | {3: middles_of_edges()}


def area_vectors(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the integral of shape function times normal: ``(nf, m, 3)`` [m^2].

    A pressure p on facets gives the nodal forces p times these; their sum over nodes is the area vector.

    Args:
        corners: ``(nf, m, 3)`` [m], nodes in the order of ``MeshData.facets``; the normal follows from the right-hand
            rule.
    """
    rule = RULES[corners.shape[1]]
    return np.einsum("q,qa,fqi->fai", rule.weights, rule.values, normals(corners, rule))


def bedding_matrices(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the integral of products of two shape functions: ``(nf, m, m)`` [m^2], that of springs of one N/m^3."""
    rule = PRODUCTS[corners.shape[1]]
    area = np.linalg.norm(normals(corners, rule), axis=2)
    return np.einsum("q,qa,qb,fq->fab", rule.weights, rule.values, rule.values, area)


def spring_rates(
    cells: NDArray[np.integer],
    facets: NDArray[np.integer],
    mass: NDArray[np.float64],
    corners: NDArray[np.float64],
    stiffness: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return by how much springs raise the largest omega^2 of their elements at most: ``(nf,)`` [1/s^2].

    A facet's springs count in its element alone, as stiff as their row sums: no mode is then faster than the fastest
    element, whose omega^2 = 4 / dt^2 grows by at most the largest ratio of spring and mass at its nodes.

    Args:
        cells: ``(nf, k)`` nodes of the element of each facet.
        facets: ``(nf, m)`` nodes of the facets.
        mass: ``(nf, k)`` [kg] of the element at each of its nodes.
        corners: ``(nf, m, 3)`` [m] of the facets.
        stiffness: ``(3,)`` [N/m^3].
    """
    at_facet = (cells[:, None, :] == facets[:, :, None]).argmax(axis=2)
    largest = bedding_matrices(corners).sum(axis=2)
    return np.asarray(stiffness.max() * (largest / np.take_along_axis(mass, at_facet, axis=1)).max(axis=1))


def normals(corners: NDArray[np.float64], rule: FacetRule) -> NDArray[np.float64]:
    """Return the normals ``(nf, q, 3)`` [m^2] at the points of a rule, as long as the area of its reference facet."""
    tangent = np.einsum("fai,qad->fqid", corners, rule.derivatives)
    return np.cross(tangent[..., 0], tangent[..., 1])
