"""The package where the solder froze: what moves, what stays, what is refused."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM, PLATE, board, package
from reflowshock.meshing.board.assembly import write_assembly
from reflowshock.meshing.board.displaced_assembly import (
    ContactError,
    DisplacementError,
    computed_displacement,
    prescribed_displacement,
    write_displaced_assembly,
)
from reflowshock.meshing.board.package_side import NotStructuredError, PackageSide, StructuredFace, underside
from reflowshock.meshing.board.pads import lift
from reflowshock.meshing.board.parameters import Warpage
from tests.support.mesh_file import MeshFile

PACKAGE = ("substrate", "die")


@pytest.fixture(scope="module")
def flat(tmp_path_factory):
    """The flat assembly of the small package, and a folder of its own."""
    folder = tmp_path_factory.mktemp("displaced")
    write_assembly(package(), board(), folder / "flat.msh")
    return folder


def nodes_of(mesh, *parts):
    """Return the numbers of the nodes of mesh parts, sorted."""
    return np.unique(np.concatenate([mesh.cells(part).ravel() for part in parts]))


def bend(points):
    """A smooth displacement with all components, those in plane of some micrometres."""
    x, y, z = points.T / MM
    return 1e-6 * np.column_stack([3.0 * x + 0.4 * y * z, 2.0 * y - 0.3 * x * z, 6.0 * x**2 + 5.0 * x * y + y**2])


def test_warpage_lifts_the_package_only(flat):
    warpage = Warpage(corner=0.2 * MM)
    write_displaced_assembly(flat / "flat.msh", prescribed_displacement(package(), warpage), flat / "warped.msh")
    warped = MeshFile(flat / "warped.msh")
    under = warped.points[np.unique(warped.cells("package_side", "quad"))]
    expected = 0.35 * MM + lift(package(), warpage, under[:, 0], under[:, 1])
    assert under[:, 2] == pytest.approx(expected, rel=1e-9)
    assert warped.points[np.unique(warped.cells("board"))][:, 2].max() < 1e-12
    assert warped.volume("substrate") == pytest.approx((2.5 * MM) ** 2 * 0.4 * MM)


def test_nothing_else_changes(flat):
    write_displaced_assembly(flat / "flat.msh", prescribed_displacement(package(), Warpage()), flat / "same.msh")
    before, after = MeshFile(flat / "flat.msh"), MeshFile(flat / "same.msh")
    assert set(before.mesh.field_data) == set(after.mesh.field_data)
    for name, (_, dimension) in before.mesh.field_data.items():
        cells = [mesh.points[mesh.cells(name, ("quad", "hexahedron")[dimension - 2])] for mesh in (before, after)]
        assert np.abs(cells[0] - cells[1]).max() < 1e-15


def test_only_what_the_package_does_beyond_the_board_counts(flat):
    """A board that bends under a package that bends with it, plus something: that something is left."""
    mesh = MeshFile(flat / "flat.msh")
    is_package = np.zeros(len(mesh.points), bool)
    is_package[nodes_of(mesh, *PACKAGE)] = True
    package_motion = np.where(is_package[:, None], 2.0 * bend(mesh.points * [1.0, 1.0, 0.0]), 0.0)
    common = bend(mesh.points * [1.0, 1.0, 0.0])
    coarse = StructuredFace.of_nodes(*(a[(mesh.points[:, 2] == 0.0) & (mesh.points[:, :2] < 2.6 * MM).all(axis=1)]
                                       for a in (mesh.points, common)))  # fmt: skip
    common[is_package] = coarse(*mesh.points[is_package, :2].T)
    displacement = computed_displacement(mesh.points, package_motion + common, is_package)
    assert np.abs(displacement(mesh.points[is_package]) - package_motion[is_package]).max() < 1e-18
    with pytest.raises(DisplacementError, match=r"no displacement is known at \(0, 0, 9\) m"):
        displacement(np.array([[0.0, 0.0, 9.0]]))


@pytest.mark.parametrize("symmetry", ["quarter", pytest.param("full", marks=pytest.mark.long)])
def test_the_underside_equals_the_facets(tmp_path, symmetry):
    """``PackageSide`` gives the heights of displaced facets, which their shape functions give independently."""
    write_assembly(package(), board(symmetry=symmetry), tmp_path / "flat.msh")
    side = write_displaced_assembly(tmp_path / "flat.msh", bend, tmp_path / "bent.msh")
    mesh = MeshFile(tmp_path / "bent.msh")
    corners = mesh.points[mesh.cells("package_side", "quad")]
    xi, eta = np.random.default_rng(3).uniform(-1.0, 1.0, (2, len(corners)))
    shape = np.column_stack([(1 - xi) * (1 - eta), (1 + xi) * (1 - eta), (1 + xi) * (1 + eta), (1 - xi) * (1 + eta)])
    points = 0.25 * np.einsum("fa,fai->fi", shape, corners)
    assert side.height(*points.T[:2]) == pytest.approx(points[:, 2], abs=1e-15)


def test_the_prescribed_underside_equals_the_displaced_mesh(flat):
    warpage = Warpage(corner=0.05 * MM)
    meshed = write_displaced_assembly(
        flat / "flat.msh", prescribed_displacement(package(), warpage), flat / "warped.msh"
    )
    drawn = PackageSide.prescribed(package(), board(), warpage)
    x, y = np.random.default_rng(1).uniform(0.0, 2.5 * MM, (2, 500))
    assert meshed.height(x, y) == pytest.approx(drawn.height(x, y), abs=1e-15)


def test_underside_lies_on_copper():
    assert underside(package()) == pytest.approx(0.35 * MM)
    assert underside(package(copper=PLATE)) == pytest.approx(0.33 * MM)


def test_a_package_in_the_board_is_refused(flat):
    sunk = prescribed_displacement(package(), Warpage(corner=-0.2 * MM))
    with pytest.raises(ContactError, match=r"inside the board at x = 2\.5 mm, y = 2\.5 mm, allowed < 0 mm"):
        write_displaced_assembly(flat / "flat.msh", sunk, flat / "sunk.msh")


def test_points_that_form_no_grid_are_rejected():
    with pytest.raises(NotStructuredError, match="3 nodes do not form a grid of 2 x 2 lines"):
        StructuredFace.of_nodes(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.zeros((3, 1)))
    side = PackageSide.prescribed(package(), board(), Warpage())
    with pytest.raises(NotStructuredError, match=r"x = 0\.003 m, allowed 0 to 0\.0025 m"):
        side.height(np.array([3.0 * MM]), np.array([0.0]))
