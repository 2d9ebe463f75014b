"""The tie: exact fields, and an error where no exact tie exists."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.grids import joint_mesh
from reflowshock.fem.errors import TieError
from reflowshock.fem.mesh.mesh import MeshData, append
from reflowshock.fem.mesh.tie import Tie, check_tie, closest_facets, net_load, project, tie_joints
from tests.support.fem_models import package_mesh, small_assembly

SQUARE = np.array([[[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]]])


def test_projection_inverts_the_bilinear_map_of_a_warped_facet():
    corners = np.array([[[0.0, 0, 0], [2, 0.1, 0.2], [1.8, 1.2, 0], [0.1, 0.9, 0.1]]])
    xi = np.array([[0.3, -0.7]])
    values = 0.25 * (1 + xi[0, 0] * np.array([-1, 1, 1, -1])) * (1 + xi[0, 1] * np.array([-1, -1, 1, 1]))
    coordinates, distance = project(values @ corners, corners)
    assert np.allclose(coordinates, xi, atol=1e-12)
    assert distance[0] < 1e-14


def test_point_off_a_facet_has_its_distance():
    facet, xi, distance = closest_facets(np.array([[3.0, 0.5, 0.0], [1.0, 0.5, 0.25]]), SQUARE)
    assert distance == pytest.approx([1.0, 0.25])
    assert np.abs(xi).max() <= 1.0
    assert facet.tolist() == [0, 0]


def test_a_point_where_the_sides_of_a_trapezium_meet_has_its_distance():
    """The bilinear map is singular at this point."""
    trapezium = np.array([[[0.0, -1, 0], [2, -2, 0], [2, 2, 0], [0, 1, 0]]])
    _, xi, distance = closest_facets(np.array([[-2.0, 0.0, 0.0], [-9.0, 0.0, 0.0]]), np.repeat(trapezium, 2, axis=0))
    assert distance == pytest.approx([2.0, 9.0])
    assert xi[:, 0] == pytest.approx(-1.0)


def test_linear_fields_and_net_forces_carry_over_exactly():
    mesh, tie, moved = tie_joints(append(small_assembly()))
    assert moved < 1e-15
    assert len(tie.slave) == 4 * 2 * 16
    assert np.abs(tie.weight.sum(axis=1) - 1).max() < 1e-12
    check_tie(tie, mesh.points)
    force = np.random.default_rng(0).uniform(-1, 1, mesh.points.shape)
    before = net_load(mesh.points, force)
    tie.gather(force)
    assert np.allclose(net_load(mesh.points, force), before, atol=1e-12)
    assert not force[tie.slave].any()


def test_kernels_equal_their_matrix():
    _, tie, _ = tie_joints(append(small_assembly(1)))
    count = int(max(tie.slave.max(), tie.master.max())) + 1
    matrix = np.zeros((len(tie.slave), count))
    np.add.at(matrix, (np.arange(len(tie.slave))[:, None], tie.master), tie.weight)
    values = np.random.default_rng(1).uniform(-1, 1, (count, 3))
    spread, gathered = values.copy(), values.copy()
    tie.spread(spread)
    assert np.allclose(spread[tie.slave], matrix @ values, atol=1e-14)
    tie.gather(gathered)
    expected = values + matrix.T @ values[tie.slave]
    expected[tie.slave] = 0.0
    assert np.allclose(gathered, expected, atol=1e-13)


def test_slaves_move_onto_a_warped_underside():
    package = package_mesh()
    package.points[:, 2] += 2e-6 * (package.points[:, 0] / 2.5e-3) ** 2
    board, _, joint = small_assembly(1)
    mesh, tie, moved = tie_joints(append([board, package, joint]))
    assert 1e-7 < moved < 2e-6
    placed = mesh.points.copy()
    tie.spread(placed)
    assert np.array_equal(placed, mesh.points)


def test_joint_above_its_facets_is_an_error_that_names_it():
    board, package, joint = small_assembly(1)
    joint.points[:, 2] += 5e-5
    with pytest.raises(TieError, match=r"foot@A3: the node at \(.*\) m is 5\.000e-05 m away from board_side"):
        tie_joints(append([board, package, joint]))


def test_joint_without_a_side_is_an_error():
    with pytest.raises(TieError, match="facet set board_side is empty"):
        tie_joints(joint_mesh("A1", 0.0, 0.0))


def test_node_that_is_slave_and_master_is_an_error():
    board, package, joint = small_assembly(1)
    facets = dict(board.facets) | {"foot@Z9": board.facets["board_side"]}
    with pytest.raises(TieError, match="slave and master"):
        tie_joints(append([MeshData(board.points, board.cells, board.part, board.part_names, facets), package, joint]))


def test_wrong_weights_are_seen():
    mesh, tie, _ = tie_joints(append(small_assembly(1)))
    with pytest.raises(TieError, match="partition of unity"):
        check_tie(Tie(tie.slave, tie.master, tie.weight * 1.001), mesh.points)
