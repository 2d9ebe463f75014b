"""Columns of board and substrate in which fine joints stand: boxes make room for them, and hold their sides.

The joints' file has the columns (``board_column@..``, ``substrate_column@..``) and those of their faces that may touch
a box (``column_board@..``, ``column_package@..``). The boxes in their place go. Columns side by side share nodes; what
is left of their faces is tied to the boxes that are left. Where lines and planes of the boxes are among those of the
column, whose face is the finer one, constant stress passes exactly. Joints with another mesh than their column's are
tied to it (``slave@foot@..``, ``slave@head@..``).
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

COLUMN, COPY = "_column@", "_coarse@"  # ends of the names of parts: what is fine, what a driving model has in its place
FACES = ("column_board@", "column_package@")
SYMMETRY = ("symmetry_x", "symmetry_y")
SLAVES, MASTERS = "slave@columns", "master@columns"
CYCLIC = [0, 1, 3, 2]
FITS = 1e-2  # of its volume: by what the boxes in a column's place may differ from it, whose faces are as flat as they
SAME = 1e-6  # of a column's size: distance of nodes that neighbouring columns share


def with_columns(mesh: MeshData) -> MeshData:
    """Give the columns of fine joints their place among the boxes, and name what is to be tied as ``tie_joints`` asks.

    Raises:
        MeshError: The boxes do not make exactly the room that a column needs, or columns side by side do not fit.
    """
    columns = [mesh.part_names[part] for part in np.unique(mesh.part) if COLUMN in mesh.part_names[part]]
    if not columns:
        return mesh
    places = {name: boxes_in_place(mesh, name) for name in columns}
    walls = shared_facets(mesh.cells, np.any(list(places.values()), axis=0))
    mesh, gone = copies_named(mesh, places)
    mesh, number = selected_cells(mesh, ~gone)
    mesh, merged = neighbours_joined(without_stale_facets(mesh))
    return faces_named(mesh, merged[number[walls]])


def boxes_in_place(mesh: MeshData, column: str) -> NDArray[np.bool_]:
    """Return the cells ``(ne,)`` of board or substrate that a column stands for; errors as ``with_columns``."""
    role, own = role_of_part(column), mesh.in_parts(column.__eq__)
    box = mesh.in_parts(lambda name: "@" not in name and role_of_part(name) == role)
    points = mesh.points[np.unique(mesh.cells[own])]
    centre = mesh.points[mesh.cells].mean(axis=1)
    inside = box & ((centre > points.min(axis=0)) & (centre < points.max(axis=0))).all(axis=1)
    volume, room = (float(element_geometry(mesh.points, mesh.cells[some]).volume.sum()) for some in (own, inside))
    if abs(room / volume - 1.0) > FITS:
        raise MeshError(
            f"{column} fills {volume:.4g} m^3, the boxes in its place {room:.4g} m^3: the lines of board and package do"
            " not lie on its edges; mesh them again with the same package.imprint"
        )
    return inside


def copies_named(mesh: MeshData, places: Mapping[str, NDArray[np.bool_]]) -> tuple[MeshData, NDArray[np.bool_]]:
    """Name the boxes of a driving model, which has a joint's coarse copy; return also the boxes ``(ne,)`` of no model.

    Args:
        mesh: The mesh.
        places: Part name of a column -> cells ``(ne,)`` in its place.
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


def shared_facets(cells: NDArray[np.int32], gone: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return the facets ``(nf, 4)``, cyclic, that cells which stay share with cells ``(ne,)`` that go."""
    facets = boundary_facets(cells[gone])
    return facets[cells_of_facets(cells[~gone], facets) >= 0][:, CYCLIC]


def without_stale_facets(mesh: MeshData) -> MeshData:
    """Drop the facets that no cell has any more."""
    found = cells_of_facets(mesh.cells, np.concatenate(list(mesh.facets.values()))) >= 0  # one search: it sorts all
    ends = np.cumsum([len(some) for some in mesh.facets.values()])[:-1]
    kept = zip(mesh.facets.items(), np.split(found, ends), strict=True)
    return replace(mesh, facets={name: some[here] for (name, some), here in kept})


def neighbours_joined(mesh: MeshData) -> tuple[MeshData, NDArray[np.int32]]:
    """Let columns side by side share the nodes of their common faces; returns as ``merge_nodes``."""
    faces = [np.unique(some) for name, some in mesh.facets.items() if name.startswith(FACES) and len(some)]
    nodes = np.unique(np.concatenate(faces))
    size = max(float(np.ptp(mesh.points[some], axis=0).max()) for some in faces)
    pairs = cKDTree(mesh.points[nodes]).query_pairs(SAME * size, output_type="ndarray")
    first = np.arange(len(nodes))
    np.minimum.at(first, pairs.max(axis=1), pairs.min(axis=1))
    twice = first < np.arange(len(nodes))
    return merge_nodes(mesh, nodes[twice], nodes[first[twice]])


def faces_named(mesh: MeshData, walls: NDArray[np.int32]) -> MeshData:
    """Make columns' faces slaves of the walls ``(nf, 4)`` that they touch, or parts of planes of symmetry, or free."""
    facets = {name: some for name, some in mesh.facets.items() if not name.startswith((*FACES, "board_bottom@"))}
    bottom = [some for name, some in mesh.facets.items() if name.startswith("board_bottom@")]
    facets["board_bottom"] = np.concatenate([mesh.facets_of("board_bottom"), *bottom])
    outer = np.sort(boundary_facets(mesh.cells), axis=1)
    own = {name: some for name, some in mesh.facets.items() if name.startswith(FACES)}
    faces, column = np.concatenate(list(own.values())), np.repeat(list(own), [len(some) for some in own.values()])
    outside = in_rows(np.sort(faces, axis=1), outer)
    faces, column = faces[outside], column[outside]
    corners = mesh.points[faces]
    for axis, plane in enumerate(SYMMETRY):
        if len(mesh.facets_of(plane)):
            flat = (np.abs(corners[:, :, axis]) < SAME * np.ptp(corners)).all(axis=1)
            facets[plane] = np.concatenate([facets[plane], faces[flat]])
    held = touch(corners, mesh.points[walls])
    check_neighbours(corners[~held], column[~held])
    return replace(mesh, facets=facets | {SLAVES: faces[held], MASTERS: walls})


def check_neighbours(corners: NDArray[np.float64], column: NDArray[np.str_]) -> None:
    """Check that no free facets ``(nf, 4, 3)`` of columns ``(nf,)`` lie on each other, where nothing would hold them.

    Raises:
        MeshError: Columns side by side do not share the nodes of their common face.
    """
    centre = corners.mean(axis=1)
    for name in np.unique(column):
        own = column == name
        low, high = corners[own].min(axis=(0, 1)), corners[own].max(axis=(0, 1))
        slack = TOLERANCE * (high - low).max()
        near = ~own & ((centre > low - slack) & (centre < high + slack)).all(axis=1)
        if not near.any() or not (met := touch(corners[own], corners[near])).any():
            continue
        middle = centre[own][met][:1]
        other = column[near][closest_facets(middle, corners[near])[0][0]]
        first, second = (some.partition("@")[2] for some in (name, other))
        raise MeshError(
            f"the columns of {first} and {second} touch with {np.sum(met)} faces that do not fit together, near"
            f" ({', '.join(f'{value:.6g}' for value in middle[0])}) m: mesh both joints with the same"
            " package.joint_numerics and package.imprint"
        )


def in_rows(facets: NDArray[np.int32], outer: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return which of some facets ``(nf, 4)`` are among others; the nodes of all are sorted."""
    _, first, place = np.unique(np.concatenate([outer, facets]), axis=0, return_index=True, return_inverse=True)
    return first[place.reshape(-1)[len(outer) :]] < len(outer)


def touch(corners: NDArray[np.float64], walls: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which facets ``(nf, 4, 3)`` lie on walls ``(nw, 4, 3)`` with all their corners."""
    facet, _, distance = closest_facets(corners.reshape(-1, 3), walls)
    size = np.linalg.norm(np.ptp(walls[facet], axis=1), axis=1)
    return (distance <= TOLERANCE * size).reshape(-1, 4).all(axis=1)
