import gmsh
import meshio
import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM, board, package, side_of
from reflowshock.cases.hard.trials.surfaces import barrel
from reflowshock.meshing.board.pads import pad_table
from reflowshock.meshing.board.parameters import Warpage
from reflowshock.meshing.core.gmsh_session import gmsh_model
from reflowshock.meshing.core.hexahedra import volumes
from reflowshock.meshing.joint.joints_file import write_joints
from reflowshock.meshing.joint.solder_mesh import joint_quality, mesh_joint

WARPAGE = Warpage(corner=0.03 * MM)


@pytest.fixture
def meshes():
    """Return the meshes of all joints of the small package."""
    return [
        mesh_joint(barrel(site.gap, 0.03 * MM, offset=0.02 * MM), site, package(), side_of(WARPAGE, package()))
        for site in pad_table(package(), board(), WARPAGE)
    ]


def test_file_has_every_name_and_every_cell(tmp_path, meshes):
    write_joints(meshes, tmp_path / "joints.msh")
    mesh = meshio.read(tmp_path / "joints.msh")
    dimension = {name: int(entry[1]) for name, entry in mesh.field_data.items()}
    assert dimension == {name: 3 for joint in meshes for name in joint.cells} | {
        name: 2 for joint in meshes for name in joint.facets
    }
    assert len(mesh.points) == sum(len(joint.points) for joint in meshes)
    for name in ("solder@A4", "copper_package@B3"):
        joint = next(joint for joint in meshes if name in joint.cells)
        read = np.vstack([b.data[c] for b, c in zip(mesh.cells, mesh.cell_sets[name], strict=True) if len(c)])
        assert np.allclose(mesh.points[read], joint.points[joint.cells[name]], rtol=0.0, atol=1e-15)


def test_gmsh_reads_the_same_body(tmp_path, meshes):
    worst = write_joints(meshes, tmp_path / "joints.msh")
    with gmsh_model("read"):
        gmsh.open(str(tmp_path / "joints.msh"))
        tags = np.concatenate(list(gmsh.model.mesh.getElements(3)[1]))
        volume = gmsh.model.mesh.getElementQualities(tags, "volume").sum()
        quality = gmsh.model.mesh.getElementQualities(tags, "minSJ").min()
        nodes = gmsh.model.mesh.getNodes()[0]
    assert sorted(nodes) == list(range(1, len(nodes) + 1))
    assert quality == pytest.approx(min(worst.values()))
    assert volume == pytest.approx(sum(volumes(m.points, c).sum() for m in meshes for c in m.cells.values()), rel=1e-9)


def test_gmsh_finds_the_quality_sufficient(tmp_path, meshes):
    worst = write_joints(meshes, tmp_path / "joints.msh")
    assert set(worst) == {joint.name for joint in meshes}
    assert min(worst.values()) > 0.2
    assert min(joint_quality(joint)["minimum_scaled_jacobian"] for joint in meshes) > 0.2
