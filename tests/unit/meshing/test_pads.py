"""Joint names and the pad table."""

import pytest

from meshing.pads import joint_name, pad_table, read_pads, row_name, write_pads


def test_rows_skip_the_letters_that_jedec_skips():
    assert [row_name(row) for row in (0, 7, 8, 13, 19, 20, 40)] == ["A", "H", "J", "P", "Y", "AA", "BA"]
    assert joint_name(0, 9) == "A10"


def test_quarter_keeps_the_upper_right_joints(package, board, warpage):
    names = [site.name for site in pad_table(package, board, warpage)]
    assert names == ["A3", "A4", "B3", "B4"]


def test_full_array_without_depopulated_joints(package, board, warpage):
    package = package.model_copy(update={"depopulated": ("B2", "B3", "C2", "C3")})
    sites = pad_table(package, board.model_copy(update={"symmetry": "full"}), warpage)
    assert len(sites) == 12
    assert sum(site.x for site in sites) == pytest.approx(0.0, abs=1e-15)


def test_gap_follows_the_warpage_and_the_file_keeps_every_digit(package, board, warpage, tmp_path):
    sites = pad_table(package, board, warpage)
    assert {site.name: site.gap for site in sites}["A4"] == pytest.approx(0.33e-3)
    write_pads(tmp_path / "pads.json", sites)
    assert read_pads(tmp_path / "pads.json") == sites
