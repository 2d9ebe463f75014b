"""Facet sets as areas: what a pressure of one pascal does to their nodes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.errors import LoadError
from reflowshock.fem.mesh.facet import area_vectors
from reflowshock.fem.mesh.mesh import MeshData, cells_of_facets


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


@dataclass(frozen=True, slots=True)
class OutwardFacets:
    """A facet set that knows its outside, in input numbers.

    Attributes:
        facets: ``(nf, m)`` nodes.
        cells: ``(nf,)`` the cell that each belongs to.
        sign: ``(nf,)`` +1 where the normal by the right-hand rule points outwards, else -1.
    """

    facets: NDArray[np.int32]
    cells: NDArray[np.integer]
    sign: NDArray[np.float64]


def outward_facets(mesh: MeshData, name: str) -> OutwardFacets:
    """Return a facet set with its outside.

    Raises:
        LoadError: There is no such set, or one of its facets belongs to no cell.
    """
    facets = facet_set(mesh, name)
    cells = cells_of_facets(mesh.cells, facets)
    if np.any(cells < 0):
        position = ", ".join(f"{value:.6g}" for value in mesh.points[facets[np.argmin(cells)]].mean(axis=0))
        raise LoadError(f"a facet of {name!r} at ({position}) m belongs to no cell")
    corners = mesh.points[facets]
    out = corners.mean(axis=1) - mesh.points[mesh.cells[cells]].mean(axis=1)
    return OutwardFacets(facets, cells, np.sign(np.einsum("fi,fai->f", out, area_vectors(corners))))


def outward_areas(mesh: MeshData, name: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Integrate the outward normal of a facet set with the shape functions of its nodes; errors as ``outward_facets``.

    Returns:
        Nodes ``(k,)`` and vectors ``(k, 3)`` [m^2]; a pressure p pushes node i with -p times its vector.
    """
    found = outward_facets(mesh, name)
    areas = area_vectors(mesh.points[found.facets]) * found.sign[:, None, None]
    nodes, place = np.unique(found.facets, return_inverse=True)
    total = np.zeros((len(nodes), 3))
    np.add.at(total, place.reshape(-1), areas.reshape(-1, 3))
    return nodes.astype(np.int64), total
