"""Joint meshes: volume kept, quality, position, and shapes that are hard to sweep."""

import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshing.hexahedra import scaled_jacobian, shortest_lengths, volumes
from meshing.joints_file import write_joints
from meshing.pads import pad_table
from meshing.parameters import Copper, JointNumerics
from meshing.solder_mesh import JointMeshError, joint_quality, mesh_joint
from meshing.surface import close_surface
from tests.support.joint_surfaces import revolve


def barrel(gap: float, bulge: float, lower: float = 0.24e-3, upper: float = 0.24e-3, offset: float = 0.0):
    """A parabolic barrel (bulge > 0) or hourglass (bulge < 0) between discs of two radii [m]."""
    share = np.linspace(0.0, 1.0, 25)
    profile = lower + (upper - lower) * share + 4.0 * bulge * share * (1.0 - share)
    return close_surface(*revolve(profile, gap, offset=offset))


@pytest.fixture
def corner(package, board, warpage):
    return {site.name: site for site in pad_table(package, board, warpage)}["A4"]


@pytest.mark.parametrize("bulge", [-0.12e-3, 0.0, 0.04e-3, 0.15e-3])
@pytest.mark.parametrize("offset", [0.0, 0.07e-3])
def test_volume_and_quality_are_kept(package, warpage, corner, bulge, offset):
    mesh = mesh_joint(barrel(corner.gap, bulge, offset=offset), corner, package, warpage)
    quality = joint_quality(mesh)
    assert quality["volume_error"] < 1e-5
    assert quality["minimum_scaled_jacobian"] > 0.3
    assert quality["smallest_length"]["copper"] == pytest.approx(0.02e-3, rel=1e-3)


@pytest.mark.parametrize("numerics", [(1, 1, 2), (2, 1, 6), (3, 2, 5), (6, 3, 16)])
def test_any_resolution_keeps_the_volume(package, warpage, corner, numerics):
    core, rings, layers = numerics
    package = package.model_copy(update={"joint_numerics": JointNumerics(core=core, rings=rings, layers=layers)})
    mesh = mesh_joint(barrel(corner.gap, 0.04e-3), corner, package, warpage)
    assert len(mesh.cells["solder@A4"]) == (core**2 + 4 * core * rings) * layers
    assert joint_quality(mesh)["volume_error"] < 1e-5


def test_joint_stands_on_the_board_and_reaches_the_warped_package(package, warpage, corner):
    mesh = mesh_joint(barrel(corner.gap, 0.04e-3), corner, package, warpage)
    foot = mesh.points[np.unique(mesh.facets["foot@A4"])]
    head = mesh.points[np.unique(mesh.facets["head@A4"])]
    assert np.abs(foot[:, 2]).max() < 1e-15
    expected = 2 * 0.02e-3 + 0.3e-3 + warpage.height(head[:, 0], head[:, 1], 1.5e-3, 1.5e-3)
    assert np.abs(head[:, 2] - expected).max() < 1e-15
    assert np.hypot(head[:, 0] - corner.x, head[:, 1] - corner.y).max() == pytest.approx(0.29e-3, rel=0.06)


def test_solder_and_copper_share_their_nodes(package, warpage, corner):
    mesh = mesh_joint(barrel(corner.gap, 0.04e-3), corner, package, warpage)
    solder, copper = mesh.cells["solder@A4"], mesh.cells["copper_board@A4"]
    assert set(mesh.facets["pad_board@A4"].ravel()) == set(np.intersect1d(solder, copper))
    assert volumes(mesh.points, copper).sum() == pytest.approx(np.pi * 0.24e-3**2 * 0.02e-3, rel=0.01)


def test_plate_layout_has_solder_only(package, warpage, corner):
    package = package.model_copy(update={"copper": Copper(layout="plate")})
    mesh = mesh_joint(barrel(corner.gap, 0.04e-3), corner, package, warpage)
    assert list(mesh.cells) == ["solder@A4"]
    assert mesh.points[np.unique(mesh.facets["foot@A4"]), 2] == pytest.approx(0.02e-3)


def test_file_has_every_name_and_contiguous_tags(package, board, warpage, tmp_path):
    sites = pad_table(package, board, warpage)
    meshes = [mesh_joint(barrel(site.gap, 0.03e-3), site, package, warpage) for site in sites]
    count = write_joints(meshes, tmp_path / "joints.msh")
    mesh = meshio.read(tmp_path / "joints.msh")
    assert {name for name, (_, dimension) in mesh.field_data.items() if dimension == 3} == {
        f"{part}@{site.name}" for site in sites for part in ("solder", "copper_board", "copper_package")
    }
    assert sum(len(block.data) for block in mesh.cells if block.type == "hexahedron") == count
    assert len(mesh.points) == sum(len(joint.points) for joint in meshes)


def test_gmsh_agrees_on_quality(package, warpage, corner, tmp_path):
    import gmsh

    mesh = mesh_joint(barrel(corner.gap, -0.08e-3, offset=0.05e-3), corner, package, warpage)
    write_joints([mesh], tmp_path / "joint.msh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "joint.msh"))
        tags = np.concatenate(list(gmsh.model.mesh.getElements(3)[1]))
        theirs = gmsh.model.mesh.getElementQualities(tags, "minSJ").min()
        volume = gmsh.model.mesh.getElementQualities(tags, "volume").sum()
    finally:
        gmsh.finalize()
    assert joint_quality(mesh)["minimum_scaled_jacobian"] == pytest.approx(theirs, rel=0.05)
    assert sum(volumes(mesh.points, cells).sum() for cells in mesh.cells.values()) == pytest.approx(volume, rel=1e-6)


def test_shape_that_is_not_star_shaped_is_refused_by_name(package, warpage, corner):
    points, triangles, lower, upper = revolve(np.full(25, 0.24e-3), corner.gap, around=96)
    angle = np.arctan2(points[:, 1], points[:, 0])
    bay = np.exp(-((angle / 0.25) ** 2)) * np.sin(np.pi * points[:, 2] / corner.gap) ** 2
    points[:, 0] -= 0.26e-3 * bay  # a bay that reaches past the axis
    with pytest.raises(JointMeshError, match=r"A4: section is not star-shaped"):
        mesh_joint(close_surface(points, triangles, lower, upper), corner, package, warpage)


@settings(max_examples=15, deadline=None)
@given(
    gap=st.floats(0.15e-3, 0.5e-3), bulge=st.floats(-0.06e-3, 0.1e-3), upper=st.floats(0.16e-3, 0.3e-3),
    offset=st.floats(0.0, 0.07e-3),
)  # fmt: skip
def test_random_joints_keep_volume_and_quality(gap, bulge, upper, offset):
    from meshing.pads import PadSite
    from meshing.parameters import Layer, Package, Pad, Warpage

    pads = {"diameter": 0.5e-3, "mask_opening": 0.48e-3, "definition": "SMD"}
    layer = Layer(length=5e-3, width=5e-3, thickness=4e-4)
    package = Package(
        rows=2, columns=2, pitch=1e-3, standoff=gap, board_pad=Pad(**pads), package_pad=Pad(**pads), substrate=layer, die=layer
    )
    site = PadSite("A1", 0, 0, 0.5e-3, 0.5e-3, gap, 0.24e-3, upper, 0.25e-3, max(0.25e-3, upper), 2e-5)
    mesh = mesh_joint(barrel(gap, bulge, upper=upper, offset=offset), site, package, Warpage(corner=1e-5))
    assert joint_quality(mesh)["volume_error"] < 1e-5


def test_lengths_and_jacobian_of_a_sheared_box():
    shear = 0.5
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 2], [1, 0, 2], [1, 1, 2], [0, 1, 2]], float)
    corners[:, 0] += shear * corners[:, 2]
    cell = np.arange(8)[None]
    assert volumes(corners, cell)[0] == pytest.approx(2.0)
    assert scaled_jacobian(corners, cell)[0] == pytest.approx(2.0 / np.sqrt(4.0 + 1.0))
    assert shortest_lengths(corners, cell)[0] == pytest.approx(2.0 / np.sqrt(5.0))
