import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM, PLATE, aside, board, package
from reflowshock.meshing.board.assembly import write_assembly
from reflowshock.meshing.board.estimate import count_elements
from reflowshock.meshing.board.parameters import Warpage
from reflowshock.meshing.core.hexahedra import scaled_jacobian
from tests.support.mesh_file import MeshFile


class Assembly(MeshFile):
    """An assembly as a reader of the file sees it."""

    def __init__(self, folder, *parameters):
        path = folder / "assembly.msh"
        self.counts = write_assembly(*parameters, path)
        super().__init__(path)


@pytest.fixture(scope="module")
def quarter(tmp_path_factory):
    """Return the assembly of a quarter board."""
    return Assembly(tmp_path_factory.mktemp("quarter"), package(), board())


def test_every_hexahedron_is_in_one_part(quarter):
    hexahedra = [block for block in quarter.mesh.cells if block.dim == 3]
    assert {block.type for block in hexahedra} == {"hexahedron"}
    assert sum(len(block.data) for block in hexahedra) == sum(quarter.counts.values())
    assert set(quarter.counts) == {"board", "board_patch", "substrate", "die"}
    assert {name: len(quarter.cells(name)) for name in quarter.counts} == quarter.counts


def test_hexahedra_are_upright(quarter):
    assert min(scaled_jacobian(quarter.points, quarter.cells(part)).min() for part in quarter.counts) > 0.3


@pytest.mark.parametrize("parts", [("board", "board_patch"), ("substrate", "die")])
def test_no_node_twice_in_a_body(quarter, parts):
    used = np.unique(np.concatenate([quarter.cells(part).ravel() for part in parts]))
    rounded = np.round(quarter.points[used] / 1e-9).astype(np.int64)
    assert len(np.unique(rounded, axis=0)) == len(used)


def test_patch_shares_with_the_board_all_nodes_inside_it(quarter):
    shared = np.intersect1d(quarter.cells("board"), quarter.cells("board_patch"))
    patch = quarter.points[np.unique(quarter.cells("board_patch"))]
    inside = (patch[:, 2] < -0.5 * MM + 1e-9) | (patch[:, :2].max(axis=1) > 3.5 * MM - 1e-9)
    assert len(shared) == inside.sum()


def test_volumes_are_those_of_the_drawing(quarter):
    assert quarter.volume("substrate") == pytest.approx((2.5 * MM) ** 2 * 0.4 * MM)
    assert quarter.volume("die") == pytest.approx((1.5 * MM) ** 2 * 0.4 * MM)
    assert quarter.volume("board_patch") == pytest.approx((3.5 * MM) ** 2 * 0.5 * MM)
    sides = 4 * 2  # the hole's circle is a polygon of two cells on each of its four blocks
    hole = 0.5 * sides * MM**2 * np.sin(2.0 * np.pi / sides)
    assert quarter.volume("board") + quarter.volume("board_patch") == pytest.approx((20 * 15 * MM**2 - hole) * MM)


@pytest.mark.parametrize(("name", "axis", "value"), [("symmetry_x", 0, 0.0), ("symmetry_y", 1, 0.0)])
def test_symmetry_planes(quarter, name, axis, value):
    assert quarter.points[quarter.cells(name, "quad")][:, :, axis] == pytest.approx(value, abs=1e-12)
    length = (15.0, 20.0)[axis]
    assert quarter.area(name) / MM**2 == pytest.approx(length * 1.0 + 2.5 * 0.4 + 1.5 * 0.4)


@pytest.mark.parametrize(
    ("name", "height", "area"),
    [("board_side", 0.0, 2.5**2), ("package_side", 0.35, 2.5**2), ("board_bottom", -1.0, 20 * 15 - 2 * np.sqrt(2))],
)
def test_level_facet_sets(quarter, name, height, area):
    assert quarter.points[quarter.cells(name, "quad")][:, :, 2] == pytest.approx(height * MM, abs=1e-12)
    assert quarter.area(name) / MM**2 == pytest.approx(area)


def test_holes_are_round(quarter):
    walls = quarter.points[quarter.cells("mounting_holes", "quad")]
    assert np.linalg.norm(walls[:, :, :2] - np.array([17.0, 12.0]) * MM, axis=2) == pytest.approx(1.0 * MM)
    assert np.ptp(walls[:, :, 2]) == pytest.approx(1.0 * MM)


@pytest.mark.long
def test_full_model_is_four_quarters(tmp_path, quarter):
    full = Assembly(tmp_path, package(), board(symmetry="full"))
    assert full.counts == {name: 4 * count for name, count in quarter.counts.items()}
    assert not {"symmetry_x", "symmetry_y"} & set(full.mesh.field_data)
    assert len(full.cells("mounting_holes", "quad")) == 4 * len(quarter.cells("mounting_holes", "quad"))
    assert full.points.mean(axis=0)[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    for part in full.counts:
        assert full.volume(part) == pytest.approx(4.0 * quarter.volume(part))


def test_a_board_aside_has_its_holes_where_they_are(tmp_path):
    the_board = aside()
    mesh = Assembly(tmp_path, package(), the_board)
    assert mesh.counts == {name: count_elements(package(), the_board)[name].elements for name in mesh.counts}
    corners = mesh.points[:, :2] / MM
    assert corners.min(axis=0) == pytest.approx([-12.0, -10.5])
    assert corners.max(axis=0) == pytest.approx([18.0, 13.5])
    walls = mesh.points[mesh.cells("mounting_holes", "quad")][:, :, :2].mean(axis=1)
    distances = np.linalg.norm(walls[:, None] - np.array(the_board.hole_places), axis=2)
    assert distances.min(axis=1) == pytest.approx(1.0 * MM, rel=0.1)
    assert set(distances.argmin(axis=1)) == set(range(5))
    volume = sum(mesh.volume(part) for part in ("board", "board_patch")) / MM**3
    assert volume == pytest.approx(30.0 * 24.0 - 5 * np.pi, rel=3e-3)


def test_four_places_are_four_insets(tmp_path):
    holes = {"diameter": 2.0 * MM, "at": [(x * MM, y * MM) for x in (17.0, -17.0) for y in (12.0, -12.0)]}
    both = [tmp_path / f"{name}.msh" for name in ("places", "insets")]
    for path, the_board in zip(both, (board(holes=holes), board()), strict=True):
        write_assembly(package(), the_board, path)
    assert both[0].read_bytes() == both[1].read_bytes()


def test_copper_plates_lie_under_and_above_the_joints(tmp_path):
    plates = Assembly(tmp_path, package(copper=PLATE), board())
    for part, low in (("copper_board", 0.0), ("copper_package", 0.33)):
        heights = plates.points[np.unique(plates.cells(part))][:, 2] / MM
        assert (heights.min(), heights.max()) == pytest.approx((low, low + 0.02), abs=1e-9)
    assert plates.points[plates.cells("board_side", "quad")][:, :, 2] == pytest.approx(0.02 * MM)
    assert plates.points[plates.cells("package_side", "quad")][:, :, 2] == pytest.approx(0.33 * MM)


@pytest.mark.parametrize("symmetry", ["quarter", pytest.param("full", marks=pytest.mark.long)])
@pytest.mark.parametrize("copper", [PLATE, {"layout": "pads"}])
def test_estimate_counts_what_is_meshed(tmp_path, symmetry, copper):
    odd = {"length": 3.3 * MM, "width": 5.0 * MM, "thickness": 0.4 * MM, "elements": 1}
    the_package, the_board = package(copper=copper, die=odd), board(symmetry=symmetry)
    estimate = count_elements(the_package, the_board)
    counts = write_assembly(the_package, the_board, tmp_path / "assembly.msh")
    assert {name: estimate[name].elements for name in counts} == counts


def test_estimate_knows_the_elements_around_holes(quarter):
    estimate = count_elements(package(), board())["board"]
    corners = quarter.points[quarter.cells("board")]
    sides = np.sort(np.linalg.norm(np.roll(corners[:, :4], -1, axis=1) - corners[:, :4], axis=2), axis=1)
    box = np.isclose(sides[:, 0], sides[:, 1], rtol=1e-6) & np.isclose(sides[:, 2], sides[:, 3], rtol=1e-6)
    assert estimate.around_holes == np.sum(~box)
    determinants = np.abs(np.linalg.det(np.array(estimate.shapes)))
    meshed = [scaled_volume(vertices) for vertices in corners[~box]]
    assert np.unique(np.round(determinants / MM**3, 6)) == pytest.approx(
        np.unique(np.round(np.array(meshed) / MM**3, 6))
    )


def scaled_volume(corners: np.ndarray) -> float:
    """Return the volume of the three edges in the middle of an upright hexahedron ``(8, 3)``."""
    first, second = (corners[a] + corners[b] - corners[c] - corners[d] for a, b, c, d in ((1, 2, 0, 3), (3, 2, 0, 1)))
    return abs(np.cross(0.5 * first, 0.5 * second)[2]) * np.ptp(corners[:, 2])


def test_estimate_of_solder_follows_the_smallest_gap():
    flat, bent = (count_elements(package(), board(), Warpage(corner=corner))["solder"] for corner in (0.0, -0.06 * MM))
    assert flat.smallest[2] == pytest.approx(0.31 * MM / 6)
    assert bent.smallest[2] == pytest.approx(0.25 * MM / 6)
    assert bent.elements == flat.elements
