"""Facet sets as areas: what a pressure of one pascal does to their nodes."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from fem.errors import LoadError
from fem.mesh import MeshData

# Integral of each shape function over a flat facet, as a part of its area: corners, then middles of sides.
TRIANGLES = {3: np.full(3, 1.0 / 3.0), 6: np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]) / 3.0}
GAUSS = np.array([[x, y] for y in (-1.0, 1.0) for x in (-1.0, 1.0)]) / np.sqrt(3.0)
CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def facet_set(mesh: MeshData, name: str) -> NDArray[np.int32]:
    """Return the facets of a set.

    Raises:
        LoadError: The mesh has no such set, or it is empty.
    """
    check_facet_set(mesh.facets, name)
    return mesh.facets[name]


def check_facet_set(facets: Mapping[str, Sequence] | Mapping[str, NDArray], name: str) -> None:
    """Refuse the name of a facet set that does not exist or is empty; errors as ``facet_set``."""
    if not len(facets.get(name, ())):
        known = [key for key, members in facets.items() if len(members)]
        near = get_close_matches(name, known, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise LoadError(f"no facet belongs to {name!r}; the mesh has {', '.join(known) or 'no facet sets'}{hint}")


def outward_areas(mesh: MeshData, name: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Integrate the outward normal of a facet set with the shape functions of its nodes.

    Returns:
        Nodes ``(k,)`` and vectors ``(k, 3)`` [m^2]; a pressure p pushes node i with -p times its vector.

    Raises:
        LoadError: There is no such set, or one of its facets belongs to no cell.
    """
    facets = facet_set(mesh, name)
    corners = mesh.points[facets]
    areas = triangle_areas(corners) if facets.shape[1] in TRIANGLES else quadrilateral_areas(corners)
    out = corners.mean(axis=1) - mesh.points[mesh.cells[owners(mesh, facets, name)]].mean(axis=1)
    areas *= np.sign(np.einsum("fi,fai->f", out, areas))[:, None, None]
    nodes, place = np.unique(facets, return_inverse=True)
    total = np.zeros((len(nodes), 3))
    np.add.at(total, place.reshape(-1), areas.reshape(-1, 3))
    return nodes.astype(np.int64), total


def triangle_areas(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the integrals of N_a n over flat triangles ``(nf, 3 or 6, 3)`` [m]: ``(nf, 3 or 6, 3)`` [m^2]."""
    normal = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return TRIANGLES[corners.shape[1]][None, :, None] * normal[:, None, :]


def quadrilateral_areas(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the integrals of N_a n over bilinear quadrilaterals in cyclic order ``(nf, 4, 3)``, exactly."""
    result = np.zeros_like(corners)
    for point in GAUSS:
        factors = 1.0 + point * CORNERS
        slopes = 0.25 * CORNERS * factors[:, ::-1]
        tangents = np.einsum("ad,fai->dfi", slopes, corners)
        normal = np.cross(tangents[0], tangents[1])
        result += 0.25 * factors.prod(axis=1)[None, :, None] * normal[:, None, :]
    return result


def owners(mesh: MeshData, facets: NDArray[np.int32], name: str) -> NDArray[np.int64]:
    """Return a cell that has all nodes of each facet: ``(nf,)``; errors as ``outward_areas``."""
    count = len(mesh.points)
    common = incidence(facets, count) @ incidence(mesh.cells, count).T
    inside = common.tocoo()
    whole = inside.data == facets.shape[1]
    owner = np.full(len(facets), -1, np.int64)
    owner[inside.row[whole]] = inside.col[whole]
    if np.any(owner < 0):
        position = ", ".join(f"{value:.6g}" for value in mesh.points[facets[np.argmin(owner)]].mean(axis=0))
        raise LoadError(f"a facet of {name!r} at ({position}) m belongs to no cell")
    return owner


def incidence(connectivity: NDArray[np.int32], count: int) -> scipy.sparse.csr_matrix:
    """Return the matrix ``(rows, count)`` of ones where a row has a node."""
    row = np.repeat(np.arange(len(connectivity)), connectivity.shape[1])
    ones = np.ones(connectivity.size, np.int32)
    return scipy.sparse.csr_matrix((ones, (row, connectivity.ravel())), shape=(len(connectivity), count))
