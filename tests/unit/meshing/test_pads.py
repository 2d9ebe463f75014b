import pytest
from scipy.spatial.transform import Rotation

from reflowshock.cases.hard.trials.packages import MM, board, package
from reflowshock.meshing.board.pads import has_rim, joint_name, pad_table, read_pads, row_name, write_pads
from reflowshock.meshing.board.parameters import Warpage


@pytest.mark.parametrize(
    ("row", "letters"), [(0, "A"), (7, "H"), (8, "J"), (13, "P"), (14, "R"), (19, "Y"), (20, "AA"), (40, "BA")]
)
def test_row_letters_are_jedec(row, letters):
    assert row_name(row) == letters


def test_no_row_has_an_ambiguous_letter():
    assert not set("".join(row_name(row) for row in range(100))) & set("IOQSXZ")


def test_quarter_of_ten_by_ten_has_corner_a10():
    sites = {site.name: site for site in pad_table(package(rows=10, columns=10), board(), Warpage(corner=0.03 * MM))}
    assert len(sites) == 25
    assert {name[0] for name in sites} == set("ABCDE")
    corner = sites["A10"]
    assert (corner.x, corner.y) == pytest.approx((4.5 * MM, 4.5 * MM))
    assert corner.gap == pytest.approx(0.34 * MM)
    assert sites["E6"].gap == pytest.approx((0.31 + 0.03 / 81.0) * MM)


def test_full_array_leaves_out_depopulated():
    sites = pad_table(package(rows=3, columns=5, depopulated=("B3",)), board(symmetry="full"), Warpage())
    assert len(sites) == 14
    assert "B3" not in {site.name for site in sites}
    first = sites[0]
    assert (first.name, first.x, first.y) == ("A1", pytest.approx(-2.0 * MM), pytest.approx(1.0 * MM))


def test_radii_follow_the_definitions():
    site = pad_table(package(), board(), Warpage())[0]
    assert site.wetted_radius_board == pytest.approx(0.24 * MM)
    assert site.wetted_radius_package == pytest.approx(0.24 * MM)
    assert site.pad_radius_package == pytest.approx(0.29 * MM)
    assert site.z_board == pytest.approx(0.02 * MM)
    assert has_rim(site.pad_radius_package, site.wetted_radius_package)
    assert not has_rim(site.pad_radius_board, site.wetted_radius_board)


def test_single_joint_has_no_warpage():
    (site,) = pad_table(package(rows=1, columns=1), board(symmetry="full"), Warpage(corner=0.1 * MM))
    assert site.gap == 0.31 * MM
    assert site.name == joint_name(0, 0) == "A1"


def test_table_survives_its_file(tmp_path):
    sites = pad_table(package(), board(), Warpage(corner=0.03 * MM))
    write_pads(tmp_path / "pads.json", sites)
    assert read_pads(tmp_path / "pads.json") == sites


def test_pads_lie_in_the_tangent_plane_of_the_lift():
    """The normal of a tilted pad equals the normal of the lifted surface, (-w_x, -w_y, 1)."""
    sites = pad_table(package(rows=10, columns=10), board(), Warpage(corner=0.5 * MM))
    for site in sites:
        normal = Rotation.from_rotvec([*site.tilt, 0.0]).apply([0.0, 0.0, 1.0])
        slope = 2.0 * 0.5 * MM / (2.0 * (4.5 * MM) ** 2)
        assert normal / normal[2] == pytest.approx([-slope * site.x, -slope * site.y, 1.0], rel=1e-12)
        assert site.offset == (0.0, 0.0)
    assert not any(any(site.tilt) for site in pad_table(package(), board(), Warpage()))
