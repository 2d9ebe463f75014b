"""Nodal area vectors of facet sets: the nodal forces under a unit pressure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.errors import LoadError
from reflowshock.fem.mesh.facet import area_vectors
from reflowshock.fem.mesh.mesh import MeshData, cells_of_facets


def facet_set(mesh: MeshData, name: str) -> NDArray[np.int32]:
    """Return the node numbers of the facets of a set, shape (nf, m), in the order of ``MeshData.facets``.

    Args:
        mesh: Mesh with the facet set.
        name: Name of the facet set.

    Raises:
        LoadError: The mesh has no such set, or it is empty.
    """
    _check_facet_set(mesh.facets, name)
    return mesh.facets[name]


def _check_facet_set(facets: Mapping[str, Sequence] | Mapping[str, NDArray], name: str) -> None:
    """Check that a facet set exists and is not empty.

    Raises:
        LoadError: It does not exist or is empty; the message names the nearest existing one.
    """
    if not len(facets.get(name, ())):
        names = [key for key, members in facets.items() if len(members)]
        near = get_close_matches(name, names, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise LoadError(f"no facet belongs to {name!r}; the mesh has {', '.join(names) or 'no facet sets'}{hint}")


@dataclass(frozen=True, slots=True)
class OutwardFacets:
    """Facet set with its outward direction, in input numbers.

    Attributes:
        facets: Nodes of the facets, shape (nf, m).
        cells: Cell of each facet, shape (nf,).
        sign: +1 if the normal by the right-hand rule points outwards, else -1, shape (nf,).
    """

    facets: NDArray[np.int32]
    cells: NDArray[np.integer]
    sign: NDArray[np.float64]


def outward_facets(mesh: MeshData, name: str) -> OutwardFacets:
    """Return a facet set with the cell of each facet and the sign of its normal (+1 outwards by the right-hand rule).

    Args:
        mesh: Mesh with the facet set.
        name: Name of the facet set.

    Returns:
        Nodes of the facets, shape (nf, m); cell of each facet, shape (nf,); and +1 or -1 for each facet, shape (nf,).

    Raises:
        LoadError: The set does not exist or is empty, or one of its facets belongs to no cell.
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
    """Integrate shape function times outward normal over a facet set.

    Args:
        mesh: Mesh with the facet set.
        name: Name of the facet set.

    Returns:
        Nodes, shape (k,), and their area vectors, shape (k, 3) [m^2]; a pressure p gives the nodal forces -p times
        these vectors.

    Raises:
        LoadError: The set does not exist or is empty, or one of its facets belongs to no cell.
    """
    outward = outward_facets(mesh, name)
    areas = area_vectors(mesh.points[outward.facets]) * outward.sign[:, None, None]
    nodes, index = np.unique(outward.facets, return_inverse=True)
    total = np.zeros((len(nodes), 3))
    np.add.at(total, index.reshape(-1), areas.reshape(-1, 3))
    return nodes.astype(np.int64), total
