"""Shapes, arrays and warpages that break sweeps: volume, positive Jacobians and position."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from reflowshock.cases.hard.trials.joints import mesh_warped
from reflowshock.cases.hard.trials.packages import MM, board, package, side_of
from reflowshock.cases.hard.trials.surfaces import barrel
from reflowshock.meshing.board.assembly import write_assembly
from reflowshock.meshing.board.checks import problems
from reflowshock.meshing.board.estimate import count_elements
from reflowshock.meshing.board.pads import pad_table
from reflowshock.meshing.board.parameters import Warpage
from reflowshock.meshing.joint.joints_file import write_joints
from reflowshock.meshing.joint.solder_mesh import joint_quality, mesh_joint

HARD = {
    "strongly bulged": {"bulge": 0.20 * MM},
    "thin neck": {"bulge": -0.15 * MM},
    "pads of ratio two": {"lower": 0.30 * MM, "upper": 0.15 * MM},
    "bulged between pads of ratio two": {"lower": 0.15 * MM, "upper": 0.30 * MM, "bulge": 0.10 * MM},
    "slanted by half a radius": {"offset": 0.12 * MM},
    "slanted hourglass": {"offset": 0.12 * MM, "bulge": -0.10 * MM},
}


def quality_of(corner=0.0, bulge=0.0, lower=0.24 * MM, upper=0.24 * MM, offset=0.0):
    """Mesh the corner joint of the small package with the given shape and its standoff."""
    return joint_quality(mesh_warped(corner, bulge, (lower, upper), offset).mesh)


@pytest.mark.parametrize("shape", HARD.values(), ids=HARD.keys())
def test_hard_shapes(shape):
    quality = quality_of(**shape)
    assert quality["volume_error"] < 1e-12
    assert quality["minimum_scaled_jacobian"] > 0.3


@pytest.mark.parametrize("corner", [-0.12 * MM, 0.5 * MM])
def test_thick_warpage(corner):
    quality = quality_of(corner, bulge=0.05 * MM)
    assert quality["volume_error"] < 1e-12
    assert quality["minimum_scaled_jacobian"] > 0.3


SHAPES = st.fixed_dictionaries(
    {
        "bulge": st.floats(-0.06 * MM, 0.12 * MM),
        "lower": st.floats(0.16 * MM, 0.30 * MM),
        "upper": st.floats(0.16 * MM, 0.30 * MM),
        "offset": st.floats(0.0, 0.1 * MM),
    }
)


@settings(max_examples=40, deadline=None)
@given(SHAPES, st.floats(-0.1 * MM, 0.1 * MM))
@example({"bulge": 0.0, "lower": 0.284 * MM, "upper": 0.296 * MM, "offset": 0.069 * MM}, -0.0823 * MM)
def test_random_joints(shape, corner):
    quality = quality_of(corner, **shape)
    assert quality["volume_error"] < 1e-12
    assert quality["minimum_scaled_jacobian"] > 0.2


def write_whole(folder, the_package, the_board, warpage):
    """Mesh assembly and joints and return their element counts."""
    counts = write_assembly(the_package, the_board, folder / "assembly.msh")
    meshes = [
        mesh_joint(barrel(site.gap, 0.02 * MM), site, the_package, side_of(warpage, the_package))
        for site in pad_table(the_package, the_board, warpage)
    ]
    assert min(write_joints(meshes, folder / "joints.msh").values()) > 0.2
    for mesh in meshes:
        for part, cells in mesh.cells.items():
            role = part.split("@")[0].split("_")[0]
            counts[role] = counts.get(role, 0) + len(cells)
    return counts


@pytest.mark.long
@pytest.mark.parametrize(
    "changes",
    [
        {"rows": 1, "columns": 1},
        {"rows": 3, "columns": 3, "depopulated": ("B2",)},
        {"rows": 1, "columns": 4, "joint_numerics": {"layers": 2}},
    ],
    ids=["one joint", "centre depopulated", "one row, two layers"],
)
def test_odd_arrays_in_full(tmp_path, changes):
    the_package, the_board, warpage = package(**changes), board(symmetry="full"), Warpage(corner=0.02 * MM)
    assert not problems(the_package, the_board, warpage)
    estimate = count_elements(the_package, the_board)
    counts = write_whole(tmp_path, the_package, the_board, warpage)
    assert counts == {name: part.elements for name, part in estimate.items()}


def test_single_layers_everywhere(tmp_path):
    flat = {"length": 5.0 * MM, "width": 5.0 * MM, "thickness": 0.4 * MM, "elements": 1}
    the_package = package(substrate=flat, die=flat)
    the_board = board(numerics={"layers": 2, "patch_layers": 1, "patch_margin": 1})
    assert not problems(the_package, the_board, Warpage())
    counts = write_assembly(the_package, the_board, tmp_path / "assembly.msh")
    assert counts["die"] == counts["substrate"] == 25


@st.composite
def assemblies(draw):
    """Draw a package and a board that may not fit each other."""
    side, hole = draw(st.floats(4.2, 9.0)) * MM, draw(st.floats(0.8, 4.0)) * MM
    layer = {"length": side, "width": 5 * MM, "thickness": 0.4 * MM}
    the_package = package(substrate=layer, die=layer | {"length": draw(st.floats(0.2, 1.0)) * side})
    the_board = board(
        length=draw(st.floats(20.0, 60.0)) * MM,
        holes={"diameter": hole, "inset_x": 1.2 * hole, "inset_y": hole},
        numerics={"element_size": draw(st.floats(0.35, 1.0)) * MM, "growth": draw(st.floats(1.1, 1.8))},
        symmetry=draw(st.sampled_from(["quarter", "full"])),
    )
    return the_package, the_board


@settings(max_examples=2, deadline=None)
@given(assemblies())
def test_random_assemblies_are_refused_or_upright(tmp_path_factory, parameters):
    check_assembly(tmp_path_factory, parameters)


@pytest.mark.long
@settings(max_examples=20, deadline=None)
@given(assemblies())
def test_more_random_assemblies_are_refused_or_upright(tmp_path_factory, parameters):
    check_assembly(tmp_path_factory, parameters)


def check_assembly(tmp_path_factory, parameters):
    """Assert that an assembly is rejected or meshed with the estimated number of elements."""
    the_package, the_board = parameters
    if problems(the_package, the_board, Warpage()):
        return
    counts = write_assembly(the_package, the_board, tmp_path_factory.mktemp("random") / "assembly.msh")
    estimate = count_elements(the_package, the_board)
    assert counts == {name: estimate[name].elements for name in counts}
