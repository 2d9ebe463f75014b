"""Bodies that no sweep fits: meshed in their place, their volume, pads and names kept."""

import gmsh
import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM, board, package, side_of
from reflowshock.cases.hard.trials.surfaces import barrel, bridged_pair, with_void
from reflowshock.meshing.board.pads import pad_table
from reflowshock.meshing.board.parameters import Warpage
from reflowshock.meshing.core.gmsh_session import gmsh_model
from reflowshock.meshing.core.hexahedra import boundary_quads, quad_areas, scaled_jacobian, volumes
from reflowshock.meshing.core.quadratic_tetrahedra import write_tetrahedra
from reflowshock.meshing.joint.joints_file import write_joints
from reflowshock.meshing.joint.solder_mesh import joint_quality, mesh_bridge, mesh_joint
from reflowshock.meshing.surface.closed_surface import enclosed_volume

FLAT = Warpage()


@pytest.fixture(scope="module")
def sites():
    """Return the pad sites of the small package by name."""
    return {site.name: site for site in pad_table(package(), board(), FLAT)}


@pytest.fixture(scope="module")
def hollow(sites):
    """The corner joint with a void inside, and its surface."""
    gap = sites["A4"].gap
    surface = with_void(barrel(gap, 0.04 * MM), (0.03 * MM, 0.0, 0.5 * gap), 0.07 * MM)
    return mesh_joint(surface, sites["A4"], package(), side_of(FLAT, package())), surface


@pytest.fixture(scope="module")
def bridge(sites):
    """Two neighbours that are one body, and its surface."""
    surface = bridged_pair(sites["A3"].gap, 1.0 * MM, 0.34 * MM, 0.1 * MM)
    pair = [sites["A3"], sites["A4"]]
    return mesh_bridge(surface, pair, package(), side_of(FLAT, package())), surface


def test_a_void_is_left_free(hollow):
    mesh, surface = hollow
    assert volumes(mesh.points, mesh.cells["solder@A4"]).sum() == pytest.approx(enclosed_volume(surface), rel=1e-9)
    quality = joint_quality(mesh)
    assert quality["method"] == "free-form"
    assert quality["contact_area_error"] < 1e-9 and quality["standoff_error"] < 1e-9
    assert quality["shape_deviation"] < 0.01 * MM
    assert quality["minimum_scaled_jacobian"] > 0.2


def test_the_failed_attempt_is_recorded(hollow):
    first, *others = joint_quality(hollow[0])["tries"]
    assert first["method"] == "free-form" and first["missed"].startswith("Gmsh: ")
    assert all(way["missed"] for way in others)  # how many there are depends on the system's numerical libraries


def test_a_bridge_has_the_pads_of_both_joints(bridge, sites):
    mesh, surface = bridge
    assert mesh.name == "A3+A4"
    assert volumes(mesh.points, mesh.cells["solder@A3+A4"]).sum() == pytest.approx(enclosed_volume(surface), rel=1e-9)
    for name in ("A3", "A4"):
        for end, height in (("foot", 0.0), ("head", 0.35 * MM)):
            nodes = mesh.points[np.unique(mesh.facets[f"{end}@{name}"])]
            assert nodes[:, 2] == pytest.approx(height, abs=1e-12)
            assert nodes[:, :2].mean(axis=0) == pytest.approx([sites[name].x, sites[name].y], abs=0.02 * MM)
    assert set(mesh.cells) == {"solder@A3+A4"} | {
        f"copper_{side}@{name}" for side in ("board", "package") for name in ("A3", "A4")
    }


def test_all_hexahedra_fit_together(bridge):
    """Boundary facets belong to solder or copper: no crack is open inside."""
    mesh, _ = bridge
    cells = np.vstack(list(mesh.cells.values()))
    quads = boundary_quads(cells)
    areas = np.cross(
        mesh.points[quads[:, 2]] - mesh.points[quads[:, 0]], mesh.points[quads[:, 3]] - mesh.points[quads[:, 1]]
    )
    assert np.abs(areas.sum(axis=0)).max() < 1e-9 * np.abs(areas).sum()
    assert min(scaled_jacobian(mesh.points, part).min() for part in mesh.cells.values()) > 0.2


def test_wetted_faces_are_where_solder_and_copper_meet(bridge):
    mesh, _ = bridge
    for side in ("board", "package"):
        for name in ("A3", "A4"):
            shared = np.intersect1d(mesh.cells["solder@A3+A4"], mesh.cells[f"copper_{side}@{name}"])
            assert set(shared) == set(mesh.facets[f"pad_{side}@{name}"].ravel())


def test_files_hold_hexahedra_and_tetrahedra(tmp_path, bridge):
    mesh, surface = bridge
    write_joints([mesh], tmp_path / "joints.msh")
    write_tetrahedra(tmp_path / "free_form.msh", mesh.name, mesh.tetrahedra)
    counts = {}
    for name in ("joints", "free_form"):
        with gmsh_model("read"):
            gmsh.open(str(tmp_path / f"{name}.msh"))
            groups = gmsh.model.getPhysicalGroups()
            counts[name] = {gmsh.model.getPhysicalName(*group) for group in groups}
            kinds = gmsh.model.mesh.getElementTypes(3)
            tags = gmsh.model.mesh.getElementsByType(kinds[0])[0]
            assert gmsh.model.mesh.getElementQualities(tags, "minDetJac").min() > 0.0
    assert counts["free_form"] == {"solder@A3+A4", "free", "pad_board", "pad_package"}
    assert {"solder@A3+A4", "foot@A3", "head@A4"} <= counts["joints"]
    assert joint_quality(mesh)["tetrahedra"]["volume_error"] < 1e-9
    wetted = sum(quad_areas(mesh.points, mesh.facets[f"pad_board@{name}"]).sum() for name in ("A3", "A4"))
    assert wetted == pytest.approx(2.0 * np.pi * (0.34**2 - 0.155**2) * MM**2, rel=0.03)
    assert surface.boundary.max() == 2
