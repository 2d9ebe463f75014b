"""The assembly: names, counts, volumes, coincident and warped nodes, read back from the file."""

import meshio
import numpy as np
import pytest

from meshing.assembly import write_assembly
from meshing.estimate import count_elements
from meshing.hexahedra import scaled_jacobian, volumes
from meshing.parameters import Copper


def parts_of(path):
    """Points [m] and cells of every named set of a Gmsh file."""
    mesh = meshio.read(path)
    sets = {name: [] for name in mesh.field_data}
    for block, tags in zip(mesh.cells, mesh.cell_data["gmsh:physical"], strict=True):
        for name, (tag, dimension) in mesh.field_data.items():
            if dimension == block.dim:
                sets[name].append(block.data[tags == tag].reshape(-1, block.data.shape[1]))
    return mesh.points, {name: np.vstack([a for a in arrays if len(a)]) for name, arrays in sets.items()}


@pytest.mark.parametrize("layout", ["pads", "plate"])
@pytest.mark.parametrize("symmetry", ["quarter", "full"])
def test_counts_equal_the_estimate(package, board, warpage, tmp_path, layout, symmetry):
    package = package.model_copy(update={"copper": Copper(layout=layout)})
    board = board.model_copy(update={"symmetry": symmetry})
    counts = write_assembly(package, board, warpage, tmp_path / "assembly.msh")
    estimate = {name: part.elements for name, part in count_elements(package, board).items()}
    assert counts == {name: estimate[name] for name in counts}
    _, sets = parts_of(tmp_path / "assembly.msh")
    assert {name: len(sets[name]) for name in counts} == counts


def test_volume_is_that_of_the_drawing(package, board, warpage, tmp_path):
    write_assembly(package, board, warpage, tmp_path / "assembly.msh")
    points, sets = parts_of(tmp_path / "assembly.msh")
    measured = {name: volumes(points, sets[name]).sum() for name in ("board", "board_patch", "substrate", "die")}
    sides = 4 * 2  # the hole's circle is a polygon of two cells on each of its four blocks
    hole = 0.5 * sides * (1e-3) ** 2 * np.sin(2 * np.pi / sides)
    assert measured["board"] + measured["board_patch"] == pytest.approx((20e-3 * 15e-3 - hole) * 1e-3, rel=1e-9)
    assert measured["substrate"] == pytest.approx(2.5e-3**2 * 0.4e-3, rel=1e-9)
    assert measured["die"] == pytest.approx(1.5e-3**2 * 0.4e-3, rel=1e-9)
    assert min(scaled_jacobian(points, sets[name]).min() for name in measured) > 0.2


def test_patch_and_board_share_their_nodes_and_reach_the_right_depth(package, board, warpage, tmp_path):
    write_assembly(package, board, warpage, tmp_path / "assembly.msh")
    points, sets = parts_of(tmp_path / "assembly.msh")
    shared = np.intersect1d(sets["board"], sets["board_patch"])
    assert points[sets["board_patch"].ravel(), 2].min() == pytest.approx(-0.5e-3)
    assert len(shared) > 0
    reach = 2.5e-3 + 2 * 0.5e-3
    on_cut = points[shared]
    distance = np.min([abs(on_cut[:, 2] + 0.5e-3), abs(on_cut[:, 0] - reach), abs(on_cut[:, 1] - reach)], axis=0)
    assert distance.max() < 1e-12


def test_underside_follows_the_warpage(package, board, warpage, tmp_path):
    write_assembly(package, board, warpage, tmp_path / "assembly.msh")
    points, sets = parts_of(tmp_path / "assembly.msh")
    nodes = points[np.unique(sets["package_side"])]
    expected = 2 * 0.02e-3 + 0.3e-3 + warpage.height(nodes[:, 0], nodes[:, 1], 1.5e-3, 1.5e-3)
    assert np.abs(nodes[:, 2] - expected).max() < 1e-12


def test_symmetry_planes_and_holes_are_where_they_should_be(package, board, warpage, tmp_path):
    write_assembly(package, board, warpage, tmp_path / "assembly.msh")
    points, sets = parts_of(tmp_path / "assembly.msh")
    assert np.abs(points[np.unique(sets["symmetry_x"]), 0]).max() < 1e-12
    assert np.abs(points[np.unique(sets["symmetry_y"]), 1]).max() < 1e-12
    rim = points[np.unique(sets["mounting_holes"])]
    assert np.hypot(rim[:, 0] - 16e-3, rim[:, 1] - 11e-3) == pytest.approx(1e-3, rel=1e-9)
    assert np.ptp(rim[:, 2]) == pytest.approx(1e-3)
