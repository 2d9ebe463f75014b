import re
from dataclasses import replace

import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM, PLATE, board, package, side_of
from reflowshock.cases.hard.trials.surfaces import barrel, revolve
from reflowshock.meshing.board.pads import lift, pad_table
from reflowshock.meshing.board.parameters import Warpage
from reflowshock.meshing.core.hexahedra import quad_areas, volumes
from reflowshock.meshing.joint.joint_mesh import JointPlace
from reflowshock.meshing.joint.solder_mesh import JointMeshError, joint_quality, mesh_joint
from reflowshock.meshing.surface.closed_surface import close_surface

WARPAGE = Warpage(corner=0.03 * MM)


def mesh_corner(bulge=0.04 * MM, warpage=WARPAGE, **changes):
    """The corner joint A4 of the small package, and its site."""
    the_package = package(**changes)
    site = {site.name: site for site in pad_table(the_package, board(), warpage)}["A4"]
    return mesh_joint(barrel(site.gap, bulge), site, the_package, side_of(warpage, the_package)), site


def nodes_of(mesh, facets):
    """Return the positions of the nodes of a facet set, shape (n, 3) [m]."""
    return mesh.points[np.unique(mesh.facets[facets])]


@pytest.mark.parametrize("numerics", [(1, 1, 4), (2, 0, 4), (3, 0, 5), (2, 1, 6), (3, 2, 5), (6, 3, 16)])
def test_any_resolution_keeps_the_volume(numerics):
    core, rings, layers = numerics
    mesh, _ = mesh_corner(warpage=Warpage(), joint_numerics={"core": core, "rings": rings, "layers": layers})
    assert len(mesh.cells["solder@A4"]) == (core**2 + 4 * core * rings) * layers
    assert joint_quality(mesh)["volume_error"] < 1e-12


def test_joint_stands_on_the_board_and_reaches_the_warped_package():
    mesh, site = mesh_corner()
    foot, head = nodes_of(mesh, "foot@A4"), nodes_of(mesh, "head@A4")
    assert foot[:, 2] == pytest.approx(0.0, abs=1e-15)
    assert head[:, 2] == pytest.approx(side_of(WARPAGE, package()).height(head[:, 0], head[:, 1]), rel=1e-12)
    axis = np.array([site.x, site.y])
    for end, radius in ((foot, 0.24 * MM), (head, 0.29 * MM)):
        assert end[:, :2].mean(axis=0) == pytest.approx(axis)
        assert np.linalg.norm(end[:, :2] - axis, axis=1).max() == pytest.approx(radius, rel=0.06)  # an octagon


def test_faces_have_the_area_of_pads_and_wetted_discs():
    mesh, _ = mesh_corner(warpage=Warpage())
    areas = {name: quad_areas(mesh.points, quads).sum() / np.pi for name, quads in mesh.facets.items()}
    radii = {"foot@A4": 0.24, "pad_board@A4": 0.24, "pad_package@A4": 0.24, "head@A4": 0.29}
    assert areas == pytest.approx({name: (radius * MM) ** 2 for name, radius in radii.items()}, rel=0.005)


def test_solder_and_copper_share_the_nodes_of_their_pads():
    mesh, _ = mesh_corner()
    for side in ("board", "package"):
        shared = np.intersect1d(mesh.cells["solder@A4"], mesh.cells[f"copper_{side}@A4"])
        assert set(shared) == set(mesh.facets[f"pad_{side}@A4"].ravel())
    assert len(mesh.cells["copper_package@A4"]) == len(mesh.cells["copper_board@A4"]) + 8  # the rim beyond the mask


def test_copper_keeps_its_thickness_on_a_warped_package():
    mesh, _ = mesh_corner()
    for part in ("copper_board@A4", "copper_package@A4"):
        lower, upper = mesh.points[mesh.cells[part][:, :4]], mesh.points[mesh.cells[part][:, 4:]]
        assert upper[..., 2] - lower[..., 2] == pytest.approx(0.02 * MM, rel=1e-6)


def test_plate_layout_has_solder_only():
    mesh, _ = mesh_corner(copper=PLATE)
    assert list(mesh.cells) == ["solder@A4"]
    assert nodes_of(mesh, "foot@A4")[:, 2] == pytest.approx(0.02 * MM)
    head = nodes_of(mesh, "head@A4")
    assert head[:, 2] == pytest.approx(0.33 * MM + lift(package(), WARPAGE, head[:, 0], head[:, 1]), rel=1e-2)
    assert head[:, 2] == pytest.approx(side_of(WARPAGE, package(copper=PLATE)).height(*head[:, :2].T), rel=1e-12)
    assert np.array_equal(mesh.facets["foot@A4"], mesh.facets["pad_board@A4"])


def test_lengths_are_those_of_the_thinnest_elements():
    quality = joint_quality(mesh_corner(bulge=0.0, warpage=Warpage())[0])
    assert quality["smallest_length"]["copper"] == pytest.approx(0.02 * MM)
    assert quality["smallest_length"]["solder"] == pytest.approx(0.31 * MM / 6)
    assert quality["head_mismatch"] < 1e-18


def test_bilinear_package_misses_the_warpage_by_at_most_its_curvature():
    x, y = np.random.default_rng(1).uniform(-2.5 * MM, 2.5 * MM, (2, 2000))
    mismatch = side_of(WARPAGE, package()).height(x, y) - 0.35 * MM - lift(package(), WARPAGE, x, y)
    bound = 2.0 * (2.0 * 0.03 * MM / (2.0 * (1.5 * MM) ** 2)) * (0.5 * MM) ** 2 / 8.0  # w'' h^2 / 8 in both directions
    assert mismatch.min() >= -1e-18
    assert 0.9 * bound < mismatch.max() <= bound * (1.0 + 1e-12)


def test_surface_of_another_gap_is_refused():
    the_package = package()
    site = pad_table(the_package, board(), WARPAGE)[0]
    with pytest.raises(JointMeshError, match=r"A3: its surface spans z = 0 to 0.00025 m"):
        mesh_joint(barrel(0.25 * MM, 0.0), site, the_package, side_of(WARPAGE, the_package))


def test_joint_that_does_not_reach_the_package_is_refused():
    the_package = package()
    site = pad_table(the_package, board(), WARPAGE)[0]
    with pytest.raises(JointMeshError, match=r"A3: the package is .* above its upper face, allowed \+-"):
        mesh_joint(barrel(site.gap, 0.0), site, the_package, side_of(Warpage(corner=0.06 * MM), the_package))


def test_joint_whose_pad_lies_beyond_the_package_is_refused():
    the_package = package()
    site = replace(pad_table(the_package, board(), Warpage())[1], x=2.4 * MM)
    with pytest.raises(JointMeshError, match=r"A4: x = 0.0026\d* m, allowed -0.0025 to 0.0025 m"):
        mesh_joint(barrel(site.gap, 0.0), site, the_package, side_of(Warpage(), the_package))


def test_a_tilted_face_is_laid_on_the_package_without_a_shear():
    """A body whose upper face has the package's slope already is only moved."""
    the_package = package()
    site = {site.name: site for site in pad_table(the_package, board(), WARPAGE)}["A4"]
    side = side_of(WARPAGE, the_package)
    body = barrel(site.gap, 0.04 * MM)
    slopes = np.tan(np.array([-site.tilt[1], site.tilt[0]]))
    sheared = body.points + np.outer(body.points[:, :2] @ slopes * body.points[:, 2] / site.gap, [0.0, 0.0, 1.0])
    tilted = replace(body, points=sheared)
    flat, laid = (JointPlace.of(surface, site, side, 0.02 * MM) for surface in (body, tilted))
    rim = sheared[sheared[:, 2] > 0.9 * site.gap]
    curvature = 2.0 * 0.03 * MM / (2.0 * (1.5 * MM) ** 2)
    assert np.abs(laid.rise(rim)).max() < 0.5 * curvature * ((0.24 * MM) ** 2 + 2.0 * (0.25 * MM) ** 2)
    assert np.abs(flat.rise(rim)).max() > 0.24 * MM * np.hypot(*slopes)


def test_shape_that_is_not_star_shaped_is_refused_by_name():
    the_package = package()
    site = pad_table(the_package, board(), WARPAGE)[0]
    points, triangles, lower, upper = revolve(np.full(13, 0.24 * MM), site.gap, around=48)
    bay = np.exp(-((np.arctan2(points[:, 1], points[:, 0]) / 0.15) ** 2)) * np.sin(np.pi * points[:, 2] / site.gap) ** 2
    points[:, 0] -= 0.4 * MM * bay  # a bay that reaches past the axis
    with pytest.raises(JointMeshError, match=r"A3: section is not star-shaped"):
        mesh_joint(close_surface(points, triangles, lower, upper), site, the_package, side_of(WARPAGE, the_package))


def test_too_few_layers_for_a_ball_are_refused_and_more_are_taken():
    mesh, _ = mesh_corner(bulge=0.2 * MM, joint_numerics={"layers": 2})
    quality = joint_quality(mesh)
    assert re.match(r"its layers enclose 0\.\d+ of its volume.*use more layers", quality["tries"][0]["missed"])
    assert (quality["method"], quality["layers"], quality["tries"][0]["layers"]) == ("swept", 4, 2)


def test_solder_is_inside_its_cells():
    mesh, _ = mesh_corner()
    assert min(volumes(mesh.points, cells).min() for cells in mesh.cells.values()) > 0.0
