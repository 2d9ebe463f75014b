"""Pads, wrenches, weights, corners and rigid-body modes of a heated package on any mesh."""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.errors import AgreedError, MeshError
from reflowshock.fem.mesh.mesh import append
from reflowshock.fem.statics.pads import disc_rule, pad_matrix
from reflowshock.fem.statics.structure import ThermalStructure
from reflowshock.materials.roles import ELASTIC
from tests.support.fem_models import board_mesh, package_mesh
from tests.support.thermal_models import REFERENCE, Layers, pads_at, small_pads, small_structure, structure_of

MOVED = {"package": "moved", "corner_displacement": -1e-4}
FR4_LAYERS = {"substrate": "FR4", "die": "FR4"}


@pytest.fixture(scope="module")
def floating(tmp_path_factory) -> ThermalStructure:
    """Return the heated package on its board, free to move."""
    return ThermalStructure.build(MPI.COMM_SELF, small_structure(tmp_path_factory.mktemp("floating")))


@pytest.fixture(scope="module")
def moved(tmp_path_factory) -> ThermalStructure:
    """Return the heated package with prescribed motions of its corners."""
    return ThermalStructure.build(MPI.COMM_SELF, small_structure(tmp_path_factory.mktemp("moved"), **MOVED))


@pytest.fixture(scope="module")
def full(tmp_path_factory) -> ThermalStructure:
    """Return a heated plate without planes of symmetry, with four pads."""
    mesh = Layers(8e-3, 6e-3, (0.4e-3, 0.4e-3), (6, 5, 2, 2)).mesh(())
    pads = pads_at([(1e-3, 1e-3), (3e-3, 1e-3), (1e-3, 2e-3), (3e-3, 2e-3)], 0.3e-3)
    return structure_of(mesh, tmp_path_factory.mktemp("full"), pads, FR4_LAYERS)


def wrenches_of(structure: ThermalStructure, seed: int) -> np.ndarray:
    """Return random wrenches on the pads, shape (joints, 2, 6) [N, N m]."""
    shape = structure.rigid_modes.pad_motion.shape[1:]
    return np.random.default_rng(seed).normal(size=shape) * ([1e-3] * 3 + [1e-7] * 3)


def at_reference(structure: ThermalStructure, wrenches: np.ndarray, rigid=None, corner: float = 0.0):
    """Return the solution of wrenches on the pads at the reference temperature."""
    free = np.zeros(len(structure.rigid_modes.names)) if rigid is None else rigid
    return structure.solve(REFERENCE, corner, wrenches, free)


def test_rule_of_a_disc():
    points, shares = disc_rule(4, 12)
    x, y, _ = points.T
    means = {
        (0, 0): 1.0,
        (2, 0): 0.25,
        (1, 1): 0.0,
        (2, 2): 1.0 / 24.0,
        (4, 0): 0.125,
        (6, 2): 5.0 / 640.0,
        (3, 0): 0.0,
    }
    for (i, j), exact in means.items():
        assert shares @ (x**i * y**j) == pytest.approx(exact, abs=1e-15)


def test_motion_of_pads_is_exact_for_rigid_motions_and_a_mean_for_others():
    mesh, pads = append([board_mesh(), package_mesh()]), small_pads()
    matrix, points = pad_matrix(mesh, pads), mesh.points
    assert matrix.shape == (12 * 4, 3 * len(points))
    shift, turn = np.array([1.0, -2.0, 0.5]), np.array([0.3, -0.2, 0.7])
    motion = (matrix @ (shift + np.cross(turn, points)).ravel()).reshape(4, 2, 6)
    assert motion[..., :3] == pytest.approx(shift + np.cross(turn, pads.centres), abs=1e-14)
    assert motion[..., 3:] == pytest.approx(np.broadcast_to(turn, (4, 2, 3)), abs=1e-10)
    swelling = (matrix @ (points * [1.0, 1.0, 0.0]).ravel()).reshape(4, 2, 6)
    assert swelling[..., :2] == pytest.approx(pads.centres[..., :2], abs=1e-15)
    assert np.abs(swelling[..., 3:]).max() < 1e-10


def test_forces_of_a_wrench_have_its_force_and_moment():
    mesh, pads = append([board_mesh(), package_mesh()]), small_pads(0.17e-3)
    matrix, rng = pad_matrix(mesh, pads), np.random.default_rng(1)
    for joint, side in ((0, 0), (3, 1)):
        wrench = np.zeros((4, 2, 6))
        wrench[joint, side] = rng.normal(size=6)
        forces = (matrix.T @ wrench.ravel()).reshape(-1, 3)
        assert forces.sum(axis=0) == pytest.approx(wrench[joint, side, :3], abs=1e-10)
        moment = np.cross(mesh.points - pads.centres[joint, side], forces).sum(axis=0)
        assert moment == pytest.approx(wrench[joint, side, 3:], abs=1e-14 / 1e-4)


def test_a_pad_beyond_its_side_is_named():
    mesh, pads = append([board_mesh(), package_mesh()]), small_pads()
    pads.centres[1, 1, 0] = 2.4e-3
    with pytest.raises(MeshError, match=r"wetted disc of B3, radius 0.2 mm, extends 0\.\d+ mm beyond package_side"):
        pad_matrix(mesh, pads)


@pytest.mark.parametrize("name", ["floating", "moved", "full"])
def test_work_of_wrenches_is_reciprocal_and_positive(name, request):
    structure = request.getfixturevalue(name)
    first, second = wrenches_of(structure, 0), wrenches_of(structure, 1)
    rest = at_reference(structure, 0.0 * first).pad_motion
    moved_first, moved_second = (at_reference(structure, wrench).pad_motion - rest for wrench in (first, second))
    work = np.sum(first * moved_first)
    assert work > 0.0
    assert np.sum(second * moved_first) == pytest.approx(np.sum(first * moved_second), abs=1e-10 * work)


def test_a_quarter_package_floats_up_and_down(floating):
    modes = floating.rigid_modes
    assert modes.names == ("z",)
    assert modes.pad_motion[0, :, 1] == pytest.approx(np.tile([0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (4, 1)), abs=1e-10)
    assert np.abs(modes.pad_motion[0, :, 0]).max() == 0.0
    materials, side = ELASTIC, 2.5e-3
    mass = 0.4e-3 * side**2 * materials.substrate.density + 0.4e-3 * (2e-3) ** 2 * materials.die.density
    assert modes.weight == pytest.approx([-9.81 * mass], rel=1e-10)


def test_a_whole_package_has_six_motions_about_the_centre_of_its_pads(full):
    modes = full.rigid_modes
    assert modes.names == ("x", "y", "z", "turn_x", "turn_y", "turn_z")
    assert modes.pad_motion[5, :, 1, 5] == pytest.approx(np.ones(4))
    assert modes.pad_motion[3:, :, 1, :3].mean(axis=1) == pytest.approx(np.zeros((3, 3)), abs=1e-12)
    rigid = np.array([1e-5, 0.0, 2e-5, 1e-3, -2e-3, 3e-3])
    still, moving = (at_reference(full, np.zeros((4, 2, 6)), amount).displacement for amount in (0.0 * rigid, rigid))
    expected = np.tensordot(rigid, modes.pad_motion, 1)
    assert np.abs((moving - still)[~full.package]).max() == 0.0
    arm = full.points[full.package] - [2e-3, 1.5e-3, 1e-3]
    assert (moving - still)[full.package] == pytest.approx(rigid[:3] + np.cross(rigid[3:], arm), abs=1e-16)
    assert expected[:, 1, 3:] == pytest.approx(np.tile(rigid[3:], (4, 1)), abs=1e-12)


def test_imbalance_is_what_weight_and_wrenches_leave_out_of_balance(floating):
    wrenches = np.zeros((4, 2, 6))
    share = -floating.rigid_modes.weight[0] / 4.0
    wrenches[:, 1, 2] = share
    imbalance = floating.rigid_modes.imbalance
    assert imbalance(wrenches) == pytest.approx([0.0], abs=1e-12 * share)
    assert imbalance(0.0 * wrenches) == pytest.approx(floating.rigid_modes.weight)
    off = wrenches + [0.0, 0.0, 1e-4, 0.0, 0.0, 0.0]
    assert imbalance(off) == pytest.approx([4e-4], rel=1e-9)


def test_moved_corners_are_where_they_should_be_and_bear_the_weight(moved):
    assert moved.rigid_modes.names == ()
    wrenches = wrenches_of(moved, 2)
    state = moved.solve(REFERENCE + 100.0, -1e-4, wrenches, np.zeros(0))
    top = np.flatnonzero(moved.points[:, 2] > moved.points[:, 2].max() - 1e-9)
    corner = top[np.argmax(moved.points[top, :2].sum(axis=1))]
    assert state.displacement[corner, 2] == pytest.approx(-1e-4, rel=1e-12)
    materials = ELASTIC
    mass = 0.4e-3 * (2.5e-3) ** 2 * materials.substrate.density + 0.4e-3 * (2e-3) ** 2 * materials.die.density
    assert state.corner_force == pytest.approx([9.81 * mass - wrenches[:, 1, 2].sum()], rel=1e-9)


def test_heights_count_from_the_boards_pads(floating):
    state = floating.solve(REFERENCE + 100.0, 0.0, np.zeros((4, 2, 6)), np.zeros(1))
    assert state.pad_motion[:, 0, 2].mean() == pytest.approx(0.0, abs=1e-15)
    assert np.ptp(state.pad_motion[:, 0, 2]) > 0.0  # the board sags between its holes


@pytest.mark.parametrize("name", ["floating", "moved"])
def test_a_board_does_not_give_way_as_a_whole(name, request):
    structure = request.getfixturevalue(name)
    push = np.zeros((4, 2, 6))
    push[:, 0, 2] = -1e-3
    rest, pushed = (at_reference(structure, load).pad_motion for load in (0.0 * push, push))
    assert np.abs(pushed - rest).max() < 1e-15
    pull = np.zeros((4, 2, 6))
    pull[0, 0, 2] = 1e-3
    lifted = at_reference(structure, pull).pad_motion - rest
    assert lifted[:, 0, 2].mean() == pytest.approx(0.0, abs=1e-16)
    assert 1e-10 < lifted[0, 0, 2] < 1e-7
    assert np.abs(lifted[:, 1]).max() < 1e-15


def test_force_of_solder_may_be_left_out(tmp_path):
    assembly = small_structure(tmp_path, effects={"solder_force": "off"})
    structure = ThermalStructure.build(MPI.COMM_SELF, assembly)
    wrenches = wrenches_of(structure, 0)
    bent, plain = at_reference(structure, wrenches), at_reference(structure, 0.0 * wrenches)
    assert np.array_equal(bent.pad_motion, plain.pad_motion)


def test_loads_of_another_shape_are_refused(floating):
    with pytest.raises(ValueError, match=r"wrenches has the shape \(3, 2, 6\); required: finite, shape \(4, 2, 6\)"):
        floating.solve(REFERENCE, 0.0, np.zeros((3, 2, 6)), np.zeros(1))
    with pytest.raises(ValueError, match=r"rigid has the shape \(1,\), not all finite"):
        floating.solve(REFERENCE, 0.0, np.zeros((4, 2, 6)), np.array([np.nan]))


def test_meshes_that_do_not_fit_are_refused(tmp_path):
    assembly = small_structure(tmp_path)
    pads = replace(assembly.pads, radii=assembly.pads.radii * 10.0)
    with pytest.raises(AgreedError, match=r"extends .* beyond board_side"):
        ThermalStructure.build(MPI.COMM_SELF, replace(assembly, pads=pads))
    with pytest.raises(AgreedError, match=r"No such file|not found"):
        ThermalStructure.build(MPI.COMM_SELF, replace(assembly, mesh=tmp_path / "none.msh"))
