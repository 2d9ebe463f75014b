"""Joints whose pads have a different mesh from their columns: free-form joints, and swept joints with a finer mesh."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import board, package, side_of
from reflowshock.cases.hard.trials.surfaces import barrel, with_void
from reflowshock.meshing.board.pads import pad_table
from reflowshock.meshing.core.hexahedra import quad_areas, scaled_jacobian
from reflowshock.meshing.joint.butterfly import butterfly
from reflowshock.meshing.joint.column import column_pad, columns_of
from reflowshock.meshing.joint.joint_mesh import CopperPads, JointPlace, build_joint
from reflowshock.meshing.joint.solder_mesh import mesh_coarse_or_fine, mesh_joint
from reflowshock.meshing.joint.swept import swept_solder
from tests.unit.meshing.test_column import BOWED, MM, NSMD, NUMERICS, standing

LAYERS = NUMERICS | {"layers": 7}


def hollow():
    """Return a joint with a void in its columns, its package, site, underside of the package and closed surface."""
    whole = package(joint_numerics=LAYERS, imprint={}, standoff=0.30 * MM)
    plate, side = board(symmetry="full"), side_of(BOWED, whole)
    site = {site.name: site for site in pad_table(whole, plate, BOWED)}["A4"]
    surface = with_void(barrel(site.gap, 0.04 * MM), (0.03 * MM, 0.0, 0.5 * site.gap), 0.07 * MM)
    columns = columns_of(site, whole, plate, side)
    return mesh_joint(surface, site, whole, side, columns), whole, site, side, surface


@pytest.fixture(scope="module")
def hollow_joint():
    """Return a joint with a void."""
    return hollow()


def test_columns_of_a_joint_with_a_void_are_those_of_a_swept_one(hollow_joint):
    mesh, swept = hollow_joint[0], standing()[0]
    assert mesh.record["method"] == "free-form"
    for part in ("board_column@A4", "substrate_column@A4"):
        assert len(mesh.cells[part]) == len(swept.cells[part])
        assert scaled_jacobian(mesh.points, mesh.cells[part]).min() > 0.6
    for name in ("column_board@A4", "column_package@A4", "board_bottom@A4"):
        square = [np.unique(np.round(some.points[some.facets[name]] / MM, 6).reshape(-1, 3), axis=0)
                  for some in (mesh, swept)]  # fmt: skip
        edge = [points[np.abs(np.abs(points[:, :2] - 1.5) - 0.5).min(axis=1) < 1e-5] for points in square]
        assert edge[0] == pytest.approx(edge[1], abs=2e-6)


@pytest.mark.parametrize(("end", "copper"), [("foot", "board"), ("head", "package")])
def test_copper_lies_on_a_pad_of_the_same_outline(hollow_joint, end, copper):
    """All tied nodes lie on the pad, which excludes the outermost ring; an element line follows its outline."""
    mesh = hollow_joint[0]
    assert f"{end}@A4" not in mesh.facets
    tied, masters = (mesh.facets[f"{name}@{end}@A4"] for name in ("slave", "master"))
    assert np.intersect1d(tied, mesh.cells[f"copper_{copper}@A4"]).size == np.unique(tied).size
    shared_with_sides = np.intersect1d(masters, mesh.facets[f"column_{copper}@A4"])
    assert shared_with_sides.size == 0
    rims = 5 - 1 + {"board": 0, "package": 1}[copper]  # the package's pad is wider than the opening of its mask
    assert len(masters) == 48 + 16 * rims
    pad = quad_areas(mesh.points, masters[: 48 + 16 * (rims - 4)]).sum()
    assert pad == pytest.approx(quad_areas(mesh.points, tied).sum(), rel=2e-3)
    outwards = np.cross(*(mesh.points[masters[:, k]] - mesh.points[masters[:, 0]] for k in (1, 2)))[:, 2]
    assert (outwards * {"board": 1.0, "package": -1.0}[copper] > 0.0).all()


def test_a_swept_joint_with_a_finer_section_is_tied_to_the_columns_of_others():
    whole = package(joint_numerics=NUMERICS, imprint={}, standoff=0.30 * MM, package_pad=NSMD)
    plate, side = board(symmetry="full"), side_of(BOWED, whole)
    site = {site.name: site for site in pad_table(whole, plate, BOWED)}["A4"]
    surface = barrel(site.gap, 0.0)
    joint_place = JointPlace.of(surface, site, side, whole.copper.thickness)
    copper = CopperPads(whole.copper.thickness, columns=columns_of(site, whole, plate, side))
    finer = whole.joint_numerics.model_copy(update={"core": 5, "rings": 3})
    mesh = build_joint(swept_solder(surface, finer, joint_place), [site], copper, joint_place)
    assert len(mesh.facets["slave@foot@A4"]) == 25 + 20 * 3
    assert len(mesh.cells["board_column@A4"]) == 7 * 128


def test_a_pad_whose_outline_is_not_star_shaped_is_refused(hollow_joint):
    _, whole, site, side, _ = hollow_joint
    column = columns_of(site, whole, board(symmetry="full"), side)[0]
    line = np.array([[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]]) * 0.1 * MM
    with pytest.raises(ValueError, match="not star-shaped about its centroid"):
        column_pad(column, np.column_stack([line, np.zeros(len(line))]), 1.0, 0)


def test_a_fine_mesh_in_place_of_a_coarse_joint_has_no_column(hollow_joint):
    mesh, whole, site, side, surface = hollow_joint
    fine = mesh_coarse_or_fine(surface, mesh, site, whole, side)
    assert "fine_instead" in fine.record
    assert set(fine.cells) == {"solder@A4", "copper_board@A4", "copper_package@A4"}
    assert {"foot@A4", "head@A4"} <= set(fine.facets)


def test_a_pad_is_a_butterfly_with_circles_around_the_opening():
    plain, wide = butterfly(4, 2), butterfly(4, 2, opening=0.8, beyond=2)
    assert wide.points[: len(plain.points)] == pytest.approx(0.8 * plain.points)
    radii = np.linalg.norm(wide.points[len(plain.points) :].reshape(2, 16, 2), axis=2)
    assert radii[0] == pytest.approx(0.9) and radii[1] == pytest.approx(1.0)
    assert len(wide.quads) == len(plain.quads) + 32
    assert wide.rim.tolist() == list(range(len(plain.points) + 16, len(wide.points)))
