"""Coarse joints: few hexahedra of solder that fill the place of a joint and of its copper."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM, PLATE, board, package, side_of
from reflowshock.cases.hard.trials.surfaces import barrel
from reflowshock.meshing.board.pads import pad_table
from reflowshock.meshing.board.parameters import Warpage
from reflowshock.meshing.core.hexahedra import quad_areas, volumes
from reflowshock.meshing.joint.solder_mesh import JointMeshError, joint_quality, mesh_coarse_joint, mesh_joint
from reflowshock.meshing.surface.closed_surface import enclosed_volume

WARPAGE = Warpage(corner=0.03 * MM)


def coarse_corner(bulge=0.04 * MM, warpage=WARPAGE, **changes):
    """The corner joint A4 of the small package by few hexahedra, its surface, and where it is."""
    the_package = package(**changes)
    site = {site.name: site for site in pad_table(the_package, board(), warpage)}["A4"]
    surface = barrel(site.gap, bulge)
    return mesh_coarse_joint(surface, site, the_package, side_of(warpage, the_package)), surface, (site, the_package)


def test_it_is_eight_hexahedra_of_solder_with_named_faces():
    mesh, *_ = coarse_corner()
    assert {part: len(cells) for part, cells in mesh.cells.items()} == {"solder@A4": 8}
    assert set(mesh.facets) == {"foot@A4", "head@A4", "pad_board@A4", "pad_package@A4"}
    assert np.array_equal(mesh.facets["pad_board@A4"], mesh.facets["foot@A4"])


@pytest.mark.parametrize("bulge", [-0.04, 0.0, 0.04, 0.08])
def test_it_has_the_volume_of_the_solder_and_of_the_copper_on_its_discs(bulge):
    mesh, surface, _ = coarse_corner(bulge * MM, Warpage())
    discs = sum(quad_areas(mesh.points, mesh.facets[name]).sum() for name in ("foot@A4", "head@A4"))
    expected = enclosed_volume(surface) + 0.02 * MM * discs
    assert volumes(mesh.points, mesh.cells["solder@A4"]).sum() == pytest.approx(expected, rel=1e-9)
    assert joint_quality(mesh)["volume_error"] < 1e-12


def test_its_faces_have_the_area_of_the_wetted_discs():
    mesh, *_ = coarse_corner(warpage=Warpage())
    for name in ("foot@A4", "head@A4"):
        assert quad_areas(mesh.points, mesh.facets[name]).sum() == pytest.approx(np.pi * (0.24 * MM) ** 2, rel=0.005)


def test_it_spans_from_the_board_to_the_warped_package():
    mesh, _, (_, the_package) = coarse_corner()
    foot, head = (mesh.points[np.unique(mesh.facets[name])] for name in ("foot@A4", "head@A4"))
    assert foot[:, 2] == pytest.approx(0.0, abs=1e-15)
    assert head[:, 2] == pytest.approx(side_of(WARPAGE, the_package).height(head[:, 0], head[:, 1]), rel=1e-12)


def test_on_copper_plates_it_spans_the_gap_alone():
    mesh, surface, _ = coarse_corner(warpage=Warpage(), copper=PLATE)
    z = mesh.points[:, 2]
    assert (z.min(), z.max()) == pytest.approx((0.02 * MM, 0.33 * MM))
    assert volumes(mesh.points, mesh.cells["solder@A4"]).sum() == pytest.approx(enclosed_volume(surface), rel=1e-9)


def test_it_stands_where_the_fine_joint_stands():
    coarse, surface, (site, the_package) = coarse_corner(warpage=Warpage())
    fine = mesh_joint(surface, site, the_package, side_of(Warpage(), the_package))
    for name in ("foot@A4", "head@A4"):
        ends = [mesh.points[np.unique(mesh.facets[name])].mean(axis=0) for mesh in (coarse, fine)]
        assert ends[0] == pytest.approx(ends[1], abs=1e-3 * site.gap)


def test_its_resolution_can_be_chosen():
    mesh, *_ = coarse_corner(coarse_joint_numerics={"core": 2, "rings": 1, "layers": 3})
    assert len(mesh.cells["solder@A4"]) == 36


def test_a_ball_that_two_layers_cannot_hold_is_refused():
    with pytest.raises(JointMeshError, match=r"A4: its layers enclose 0\.\d+ of its volume.*use more layers"):
        coarse_corner(bulge=0.25 * MM)
