import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM, PLATE, board, package, side_of
from reflowshock.cases.hard.trials.surfaces import barrel
from reflowshock.meshing.board.checks import problems
from reflowshock.meshing.board.estimate import count_elements
from reflowshock.meshing.board.pads import pad_table
from reflowshock.meshing.board.parameters import Imprint, JointNumerics, Warpage
from reflowshock.meshing.board.plan import board_plan, column_levels, package_plan
from reflowshock.meshing.core.hexahedra import FACES, scaled_jacobian, volumes
from reflowshock.meshing.joint.column import columns_of
from reflowshock.meshing.joint.solder_mesh import mesh_joint
from reflowshock.meshing.joint.swept import layer_levels

UM = 1.0e-6
NUMERICS = {"core": 4, "rings": 2, "layers": 10, "pad_layer": 25 * UM, "copper_layers": 2}
NSMD = {"diameter": 0.48 * MM, "mask_opening": 0.58 * MM, "definition": "NSMD"}
BOWED = Warpage(corner=0.05 * MM)


def standing(name="A4", warpage=BOWED, bulge=0.04 * MM, **changes):
    """A joint of the small package, in its columns."""
    whole = package(**({"joint_numerics": NUMERICS, "imprint": {}, "standoff": 0.30 * MM} | changes))
    plate, side = board(symmetry="full"), side_of(warpage, whole)
    site = {site.name: site for site in pad_table(whole, plate, warpage)}[name]
    return mesh_joint(barrel(site.gap, bulge), site, whole, side, columns_of(site, whole, plate, side)), side


def test_the_mesh_of_a_joint_on_equal_pads_has_the_elements_that_it_needs():
    mesh, _ = standing(warpage=Warpage(), package_pad=NSMD)
    counts = {name.split("@")[0]: len(cells) for name, cells in mesh.cells.items()}
    of_columns = {"board_column": 7 * 128, "substrate_column": 5 * 128}
    assert counts == {"solder": 480, "copper_board": 96, "copper_package": 96, **of_columns}


@pytest.mark.parametrize(("pad", "size"), [({}, None), ({"package_pad": NSMD}, None), ({}, 0.8 * MM)])
def test_columns_are_good_elements_on_pads_of_either_kind(pad, size):
    mesh, _ = standing(**pad, imprint={"size": size})
    assert min(scaled_jacobian(mesh.points, cells).min() for cells in mesh.cells.values()) > 0.6
    assert mesh.volume_error < 3e-3
    assert mesh.record["contact_area_error"] < 3e-3


def test_joint_and_columns_are_one_mesh_without_gaps():
    """Each face has two cells, or is one of the named outer faces, or free: of solder and copper, or around a pad."""
    mesh, _ = standing()
    cells = np.vstack(list(mesh.cells.values()))
    faces = np.sort(cells[:, FACES].reshape(-1, 4), axis=1)
    once, count = np.unique(faces, axis=0, return_counts=True)
    assert count.max() == 2
    outer = {tuple(face) for face in once[count == 1].tolist()}
    for name in ("column_board@A4", "column_package@A4", "board_bottom@A4"):
        assert {tuple(sorted(face)) for face in mesh.facets[name].tolist()} <= outer
    assert "foot@A4" not in mesh.facets
    assert "head@A4" not in mesh.facets
    shared = np.intersect1d(mesh.cells["board_column@A4"], mesh.cells["copper_board@A4"])
    assert len(shared) == 57  # nodes of the butterfly


def test_outer_faces_are_those_of_the_displaced_boxes():
    mesh, side = standing()
    high = mesh.points[np.unique(mesh.cells["substrate_column@A4"])]
    corner = np.array([[1.0, 1.0, 0.34], [2.0, 2.0, 0.74]]) * MM
    for drawn in corner[[0, 1]]:
        there = side.displaced(drawn[None])
        assert np.linalg.norm(high - there, axis=1).min() < 1e-12
    square = mesh.points[np.unique(mesh.facets["column_board@A4"])]
    assert [square.min(axis=0), square.max(axis=0)] == [
        pytest.approx(np.array([1.0, 1.0, -1.0]) * MM), pytest.approx(np.array([2.0, 2.0, 0.0]) * MM, abs=1e-15)
    ]  # fmt: skip
    assert volumes(mesh.points, mesh.cells["board_column@A4"]).sum() == pytest.approx(MM**3, rel=1e-12)


def test_neighbours_have_the_nodes_of_their_common_faces_alike():
    first, second = standing("A4")[0], standing("A3")[0]
    for name, count in (("column_board", 5 * 8), ("column_package", 5 * 6)):
        sides = [mesh.points[np.unique(mesh.facets[f"{name}@{mesh.name}"])] for mesh in (first, second)]
        distance = np.linalg.norm(sides[0][:, None] - sides[1][None], axis=2).min(axis=1)
        assert np.sum(distance < 1e-12) == count


def test_a_wide_rim_of_copper_has_elements_of_the_size_of_the_others():
    wide = {"diameter": 0.72 * MM, "mask_opening": 0.48 * MM, "definition": "SMD"}
    mesh, _ = standing(package_pad=wide, imprint={"size": 1.0 * MM})
    assert len(mesh.cells["copper_package@A4"]) == 2 * (48 + 2 * 16)


def test_levels_of_solder_divide_the_measuring_layer_and_grow_from_it():
    numerics = JointNumerics(**NUMERICS)
    levels = layer_levels(300 * UM, numerics)
    assert levels[:3] == pytest.approx([0.0, 12.5 * UM, 25 * UM])
    assert levels == pytest.approx(300 * UM - levels[::-1], abs=1e-15)
    growth = np.diff(levels)[2:5] / np.diff(levels)[1:4]
    assert growth == pytest.approx(growth[0], rel=1e-9)
    assert 1.5 < growth[0] < 2.0
    assert layer_levels(300 * UM, JointNumerics(layers=3)) == pytest.approx([0.0, 1e-4, 2e-4, 3e-4])
    odd = layer_levels(300 * UM, JointNumerics(**(NUMERICS | {"layers": 9})))
    assert np.diff(odd)[4] == np.diff(odd).max()


@pytest.mark.parametrize("layers", [4, 5, 6])
def test_layers_that_cannot_grow_smoothly_are_refused(layers):
    with pytest.raises(ValueError, match=f"{layers} layers, 2 of them in 2.5e-05 m at each pad, do not fill 0.0003"):
        layer_levels(300 * UM, JointNumerics(**(NUMERICS | {"layers": layers})))


def test_levels_of_a_column_begin_at_the_pad_and_meet_the_boxes():
    levels = column_levels(1.0 * MM, 4, Imprint())
    assert levels[1] < 20 * UM
    assert len(levels) == 8
    assert np.abs(levels[:, None] - MM * np.array([0.0, 0.25, 0.5, 0.75, 1.0])).min(axis=0) == pytest.approx(0.0)
    assert (np.diff(levels)[1:] / np.diff(levels)[:-1]).max() < 2.0
    halved = column_levels(1.0 * MM, 8, Imprint(first_layer=15 * UM, growth=1.25))
    assert len(halved) >= 16
    assert halved[1] < 20 * UM


@pytest.mark.parametrize("size", [None, 0.8 * MM])
@pytest.mark.parametrize("symmetry", ["full", "quarter"])
def test_edges_of_columns_lie_on_lines_of_board_and_package(size, symmetry):
    whole = package(joint_numerics=NUMERICS, imprint={"size": size})
    plate = board(symmetry=symmetry)
    half = 0.5 * (size or MM)
    for axis in (board_plan(whole, plate).x, package_plan(whole, plate).x):
        edges = {round(edge / MM, 9) for part in axis for edge in (part.start, part.end)}
        expected = {round((centre * MM + sign * half) / MM, 9) for centre in (0.5, 1.5) for sign in (-1.0, 1.0)}
        assert expected <= edges
        assert [part.end for part in axis[:-1]] == [part.start for part in axis[1:]]


def test_counts_of_a_plan_are_those_of_the_meshes():
    whole = package(joint_numerics=NUMERICS, imprint={}, standoff=0.30 * MM)
    plate = board(symmetry="full")
    all_boxes = count_elements(whole.model_copy(update={"imprint": None}), plate, fine=1)
    parts, (mesh, _) = count_elements(whole, plate, fine=1), standing()
    for name in ("board_column", "substrate_column", "solder"):
        assert parts[name].elements == len(mesh.cells[f"{name}@A4"])
    assert parts["copper"].elements == sum(len(mesh.cells[f"copper_{side}@A4"]) for side in ("board", "package"))
    plan = package_plan(whole, plate)
    cells = [sum(part.cells for part in axis) for axis in (plan.x, plan.y)]
    assert parts["substrate"].elements == 2 * (cells[0] * cells[1] - 4)
    assert "board_column" not in all_boxes


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"imprint": {"size": 1.1 * MM}}, "package.imprint.size"),
        ({"imprint": {"size": 0.6 * MM}}, "package.imprint.size"),
        ({"imprint": {}, "substrate": {"length": 3.9 * MM, "width": 5 * MM, "thickness": 0.4 * MM}}, "package.imprint"),
        ({"imprint": {}, "copper": PLATE}, "package.copper.layout"),
    ],
)
def test_columns_without_room_are_refused(changes, key):
    keys = [problem.key for problem in problems(package(**changes), board(), Warpage())]
    assert any(name.startswith(key) for name in keys)


def test_columns_with_room_are_taken():
    assert problems(package(imprint={}), board(), Warpage()) == []
