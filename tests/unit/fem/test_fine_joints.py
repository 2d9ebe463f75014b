"""A scene with some fine joints and otherwise coarse joints."""

from dataclasses import replace

import pytest

from reflowshock.cases.hard.trials.grids import joint_mesh
from reflowshock.fem.division.fine_joints import read_coarse, with_coarse_joints
from reflowshock.fem.division.tables import join_meshes
from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.mesh import append
from reflowshock.fem.mesh.watch_table import joint_names, whole_watch
from tests.support.fem_models import SITES, small_assembly


def coarse_joints(names=tuple(SITES)):
    """Return coarse joints: two single-element layers of solder with the height of fine joints, without copper."""
    meshes = []
    for name in names:
        mesh = joint_mesh(name, *SITES[name], layers=2, edges=1)
        only = [f"solder@{name}"] * len(mesh.part_names)
        facets = {f"pad_board@{name}": mesh.facets[f"foot@{name}"], f"pad_package@{name}": mesh.facets[f"head@{name}"]}
        meshes.append(replace(mesh, part=0 * mesh.part, part_names=(only[0],), facets=mesh.facets | facets))
    return append(meshes)


@pytest.fixture(scope="module")
def mesh():
    """Return the mesh of the small package."""
    return append(small_assembly())


def cells_of(mesh, part):
    """Return the number of cells of a part."""
    return int(mesh.in_parts(part.__eq__).sum())


def test_all_joints_but_the_fine_ones_are_coarse(mesh):
    mixed = with_coarse_joints(mesh, coarse_joints(), ["A3"])
    assert cells_of(mixed, "solder@A3") == cells_of(mesh, "solder@A3")
    assert cells_of(mixed, "copper_board@A3") == 9
    for name in ("A2", "B2", "B3"):
        assert cells_of(mixed, f"solder@{name}") == 4
        assert cells_of(mixed, f"copper_board@{name}") == 0
        assert len(mixed.facets_of(f"foot@{name}")) == 1
    for part in ("board", "board_patch", "substrate", "die"):
        assert cells_of(mixed, part) == cells_of(mesh, part)


def test_joints_keep_their_order_so_that_histories_compare(mesh):
    mixed = with_coarse_joints(mesh, coarse_joints(), ["B3"])
    assert joint_names(mixed) == joint_names(mesh)
    assert whole_watch(join_meshes(mixed).mesh, 25e-6).joints == whole_watch(join_meshes(mesh).mesh, 25e-6).joints


def test_all_fine_is_the_mesh_itself(mesh):
    assert with_coarse_joints(mesh, coarse_joints(), list(SITES)) is mesh


@pytest.mark.parametrize(
    ("fine", "names", "words"),
    [
        (["A33"], tuple(SITES), r"no joint A33, allowed: .*did you mean A3"),
        ([], tuple(SITES), r"is empty: no joint would be fine"),
        (["A3"], ("A2", "B2"), r"B3 is not fine and has no coarse mesh; coarse joints: A2, B2"),
    ],
)
def test_what_does_not_fit_is_said(mesh, fine, names, words):
    with pytest.raises(MeshError, match=words):
        with_coarse_joints(mesh, coarse_joints(names), fine)


def test_coarse_joints_need_a_file():
    with pytest.raises(MeshError, match=r"no file of coarse joints"):
        read_coarse(None)
