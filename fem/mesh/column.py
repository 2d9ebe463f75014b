"""Columns of board and substrate under and over fine joints: they replace boxes and are tied to the remaining ones.

The file of the joints contains the columns (``board_column@..``, ``substrate_column@..``) and the faces that may touch
a box (``column_board@..``, ``column_package@..``). The boxes inside the columns are removed. Neighbouring columns share
nodes; their other faces are tied to the remaining boxes. Constant stress passes exactly if the lines and planes of the
boxes are a subset of the lines and planes of the column, whose face is the finer one. Joints with a mesh different
from their column are tied to it (``slave@foot@..``, ``slave@head@..``).
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from reflowshock.fem.elements.element import element_geometry
from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.mesh import MeshData, boundary_facets, cells_of_facets, merge_nodes, selected_cells
from reflowshock.fem.mesh.tie import TOLERANCE, closest_facets
from reflowshock.materials.roles import role_of_part

COLUMN, COPY = "_column@", "_coarse@"  # in names of parts: fine columns, and the boxes of a driving model there
FACES = ("column_board@", "column_package@")
SYMMETRY = ("symmetry_x", "symmetry_y")
SLAVES, MASTERS = "slave@columns", "master@columns"
CYCLIC = [0, 1, 3, 2]
FITS = 1e-2  # of the column's volume: largest difference of the volume of the boxes that it replaces
SAME = 1e-6  # of a column's size: distance of nodes that neighbouring columns share


def insert_columns(mesh: MeshData) -> MeshData:
    """Replace boxes of the coarse mesh by the columns of fine joints, and name the facets that ``tie_joints`` ties.

    A column is the part of board and package around a fine joint, with its own mesh.

    Args:
        mesh: Mesh with all boxes and columns, which overlap; returned unchanged if it has no columns.

    Returns:
        Mesh in which boxes and columns no longer overlap, with facet sets at the ends of the fine joints.

    Raises:
        MeshError: The boxes in place of a column do not have its volume, or neighbouring columns do not match.
    """
    columns = [mesh.part_names[part] for part in np.unique(mesh.part) if COLUMN in mesh.part_names[part]]
    if not columns:
        return mesh
    places = {name: _boxes_in_place(mesh, name) for name in columns}
    walls = _shared_facets(mesh.cells, np.any(list(places.values()), axis=0))
    mesh, gone = _name_coarse_copies(mesh, places)
    mesh, number = selected_cells(mesh, ~gone)
    mesh, merged = _merge_neighbours(drop_stale_facets(mesh))
    return _name_faces(mesh, merged[number[walls]])


def _boxes_in_place(mesh: MeshData, column: str) -> NDArray[np.bool_]:
    """Return whether a column replaces each cell of the mesh, shape (ne,); errors as in ``insert_columns``."""
    role, in_column = role_of_part(column), mesh.in_parts(column.__eq__)
    box = mesh.in_parts(lambda name: "@" not in name and role_of_part(name) == role)
    points = mesh.points[np.unique(mesh.cells[in_column])]
    centre = mesh.points[mesh.cells].mean(axis=1)
    inside = box & ((centre > points.min(axis=0)) & (centre < points.max(axis=0))).all(axis=1)
    volume, room = (float(element_geometry(mesh.points, mesh.cells[some]).volume.sum()) for some in (in_column, inside))
    if abs(room / volume - 1.0) > FITS:
        raise MeshError(
            f"{column} fills {volume:.4g} m^3, the boxes in its place {room:.4g} m^3: the lines of board and package do"
            " not lie on its edges; mesh them again with the same package.imprint"
        )
    return inside


def _name_coarse_copies(mesh: MeshData, places: Mapping[str, NDArray[np.bool_]]) -> tuple[MeshData, NDArray[np.bool_]]:
    """Rename the boxes in place of columns that a driving model keeps under coarse copies of joints.

    Args:
        mesh: The mesh.
        places: Part name of a column -> whether it replaces each cell, shape (ne,).

    Returns:
        The mesh with renamed parts, and whether each cell belongs to no model, shape (ne,).
    """
    driving = {name.partition(COPY)[2] for name in mesh.part_names if COPY in name}
    part, names, gone = mesh.part.copy(), list(mesh.part_names), np.zeros(len(mesh.part), dtype=bool)
    for column, inside in places.items():
        if column.partition("@")[2] in driving:
            part[inside] = len(names)
            names.append(column.replace(COLUMN, COPY))
        else:
            gone |= inside
    return replace(mesh, part=part, part_names=tuple(names)), gone


def _shared_facets(cells: NDArray[np.int32], gone: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return the facets between removed cells (mask of shape (ne,)) and the others, in cyclic order, shape (nf, 4)."""
    facets = boundary_facets(cells[gone])
    return facets[cells_of_facets(cells[~gone], facets) >= 0][:, CYCLIC]


def drop_stale_facets(mesh: MeshData) -> MeshData:
    """Return the mesh without the facets that are no face of any cell; empty facet sets remain.

    Args:
        mesh: Mesh with at least one facet set.
    """
    has_cell = cells_of_facets(mesh.cells, np.concatenate(list(mesh.facets.values()))) >= 0  # one search sorts all
    ends = np.cumsum([len(some) for some in mesh.facets.values()])[:-1]
    sets = zip(mesh.facets.items(), np.split(has_cell, ends), strict=True)
    return replace(mesh, facets={name: facets[valid] for (name, facets), valid in sets})


def _merge_neighbours(mesh: MeshData) -> tuple[MeshData, NDArray[np.int32]]:
    """Merge the nodes on common faces of neighbouring columns; returns as ``merge_nodes``."""
    faces = [np.unique(some) for name, some in mesh.facets.items() if name.startswith(FACES) and len(some)]
    nodes = np.unique(np.concatenate(faces))
    size = max(float(np.ptp(mesh.points[some], axis=0).max()) for some in faces)
    pairs = cKDTree(mesh.points[nodes]).query_pairs(SAME * size, output_type="ndarray")
    first = np.arange(len(nodes))
    np.minimum.at(first, pairs.max(axis=1), pairs.min(axis=1))
    twice = first < np.arange(len(nodes))
    return merge_nodes(mesh, nodes[twice], nodes[first[twice]])


def _name_faces(mesh: MeshData, walls: NDArray[np.int32]) -> MeshData:
    """Assign the faces of columns to ties, planes of symmetry or the free surface.

    Args:
        mesh: Mesh with columns.
        walls: Facets of the remaining boxes towards columns, shape (nf, 4).
    """
    facets = {name: some for name, some in mesh.facets.items() if not name.startswith((*FACES, "board_bottom@"))}
    bottom = [some for name, some in mesh.facets.items() if name.startswith("board_bottom@")]
    facets["board_bottom"] = np.concatenate([mesh.facets_of("board_bottom"), *bottom])
    outer = np.sort(boundary_facets(mesh.cells), axis=1)
    sets = {name: some for name, some in mesh.facets.items() if name.startswith(FACES)}
    faces, column = np.concatenate(list(sets.values())), np.repeat(list(sets), [len(some) for some in sets.values()])
    outside = _are_among(np.sort(faces, axis=1), outer)
    faces, column = faces[outside], column[outside]
    corners = mesh.points[faces]
    for axis, plane in enumerate(SYMMETRY):
        if len(mesh.facets_of(plane)):
            flat = (np.abs(corners[:, :, axis]) < SAME * np.ptp(corners)).all(axis=1)
            facets[plane] = np.concatenate([facets[plane], faces[flat]])
    tied = _lie_on_walls(corners, mesh.points[walls])
    _check_neighbours(corners[~tied], column[~tied])
    return replace(mesh, facets=facets | {SLAVES: faces[tied], MASTERS: walls})


def _check_neighbours(corners: NDArray[np.float64], column: NDArray[np.str_]) -> None:
    """Check that neighbouring columns share the nodes of their common face.

    Args:
        corners: Corners of the free facets of columns, shape (nf, 4, 3) [m].
        column: Name of the column of each facet, shape (nf,).

    Raises:
        MeshError: Free facets of different columns coincide.
    """
    centre = corners.mean(axis=1)
    for name in np.unique(column):
        in_column = column == name
        low, high = corners[in_column].min(axis=(0, 1)), corners[in_column].max(axis=(0, 1))
        slack = TOLERANCE * (high - low).max()
        near = ~in_column & ((centre > low - slack) & (centre < high + slack)).all(axis=1)
        if not near.any() or not (met := _lie_on_walls(corners[in_column], corners[near])).any():
            continue
        middle = centre[in_column][met][:1]
        other = column[near][closest_facets(middle, corners[near])[0][0]]
        first, second = (some.partition("@")[2] for some in (name, other))
        raise MeshError(
            f"the columns of {first} and {second} touch with {np.sum(met)} faces that do not match, near"
            f" ({', '.join(f'{value:.6g}' for value in middle[0])}) m: mesh both joints with the same"
            " package.joint_numerics and package.imprint"
        )


def _are_among(facets: NDArray[np.int32], outer: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return whether each facet (nf, 4) is among other facets, shape (nf,); the nodes of each must be sorted."""
    _, first, index = np.unique(np.concatenate([outer, facets]), axis=0, return_index=True, return_inverse=True)
    return first[index.reshape(-1)[len(outer) :]] < len(outer)


def _lie_on_walls(corners: NDArray[np.float64], walls: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether all corners of each facet (nf, 4, 3) lie on walls (nw, 4, 3), shape (nf,)."""
    facet, _, distance = closest_facets(corners.reshape(-1, 3), walls)
    size = np.linalg.norm(np.ptp(walls[facet], axis=1), axis=1)
    return (distance <= TOLERANCE * size).reshape(-1, 4).all(axis=1)
