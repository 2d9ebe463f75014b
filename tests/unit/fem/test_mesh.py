"""Reading, selecting, merging meshes; finding the interface."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.coupled import surveyed
from reflowshock.cases.hard.trials.grids import grid, mesh_of
from reflowshock.fem.division.checks import check_division
from reflowshock.fem.division.divide import divide
from reflowshock.fem.division.tables import prepare
from reflowshock.fem.errors import CouplingError, MeshError
from reflowshock.fem.mesh.coupling_interface import find_interface
from reflowshock.fem.mesh.mesh import MeshData, append, boundary_facets, cells_of_facets, merge_nodes, select
from reflowshock.fem.mesh.mesh_file import read_mesh
from tests.support.fem_models import board_mesh, small_assembly, write_msh


def test_file_comes_back_as_it_was_written(tmp_path):
    mesh = append(small_assembly(1))
    write_msh(mesh, tmp_path / "mesh.msh")
    read = read_mesh(tmp_path / "mesh.msh")
    assert len(read.points) == len(mesh.points)
    assert set(read.part_names) == set(mesh.part_names)
    for name in mesh.part_names:
        ours = mesh.points[mesh.cells[mesh.in_parts(name.__eq__)]]
        theirs = read.points[read.cells[read.in_parts(name.__eq__)]]
        assert np.allclose(ours, theirs, atol=1e-15)
    for name, quads in mesh.facets.items():
        assert np.allclose(mesh.points[quads], read.points[read.facets[name]], atol=1e-15), name


def test_file_without_hexahedra_is_an_error(tmp_path):
    path = tmp_path / "points.msh"
    header = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
    path.write_text(header + "$Nodes\n0 0 0 0\n$EndNodes\n$Elements\n0 0 0 0\n$EndElements\n")
    with pytest.raises((MeshError, ValueError)):
        read_mesh(path)


def test_selection_keeps_facets_whose_nodes_are_all_left():
    board, number = select(board_mesh(), "board".__eq__)
    assert set(board.facets["mounting_holes"].ravel()) <= set(range(len(board.points)))
    assert not len(board.facets["board_side"])
    assert (number >= 0).sum() == len(board.points)


def test_empty_selection_is_an_error_that_lists_the_parts():
    with pytest.raises(MeshError, match="the mesh has board, board_patch"):
        select(board_mesh(), "die".__eq__)


def test_boundary_and_owners_of_a_block():
    _, cells = grid(*[np.arange(4.0)] * 3)
    faces = boundary_facets(cells)
    assert len(faces) == 6 * 9
    owners = cells_of_facets(cells, faces)
    assert all(set(face) <= set(cells[owner]) for face, owner in zip(faces, owners, strict=True))
    assert cells_of_facets(cells, np.array([[0, 1, 2, 3]], np.int32)).tolist() == [-1]


def apart(mesh: MeshData) -> MeshData:
    """Return the board with separate nodes for patch and remainder."""
    return append([select(mesh, name.__eq__)[0] for name in ("board", "board_patch")])


def test_cut_is_found_whether_nodes_are_shared_or_not():
    shared, twice = find_interface(board_mesh()), find_interface(apart(board_mesh()))
    assert np.array_equal(*shared)
    assert len(shared[0]) == len(twice[0]) > 0
    assert not np.array_equal(*twice)


def test_dns_joins_what_the_files_keep_apart():
    together, parted = board_mesh(), apart(board_mesh())
    assert len(prepare(parted, "dns")["dns"].mesh.points) == len(together.points)


def test_merging_removes_the_duplicates():
    points, cells = grid([0, 1], [0, 1], [0, 1])
    pair = append([mesh_of(points, cells, "a", {}), mesh_of(points + [1, 0, 0], cells, "b", {})])
    merged, number = merge_nodes(pair, np.array([8, 10, 12, 14]), np.array([1, 3, 5, 7]))
    assert len(merged.points) == 12
    assert number[8] == number[1]


def test_patch_that_does_not_match_is_an_error_with_a_place():
    mesh = apart(board_mesh())
    patch = np.unique(mesh.cells[mesh.in_parts("board_patch".__eq__)])
    inner = patch[np.argmin(mesh.points[patch, 2])]
    mesh.points[inner, 2] -= 1e-6
    with pytest.raises(CouplingError, match=r"1 of \d+ nodes of board_patch on the interface have no partner"):
        find_interface(mesh)


def test_two_scale_of_what_has_nothing_fine_is_an_error():
    points, cells = grid([0, 1], [0, 1], [0, 1])
    scene = surveyed(mesh_of(points, cells, "board", {}))
    with pytest.raises(CouplingError, match="finer than the board; the mesh has the parts board and 0 tied nodes"):
        check_division(*scene[:2], divide(*scene), scene[2])
