"""Joints that few hexahedra cannot follow keep their fine mesh where others are coarse, and say why."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM, board, package, side_of
from reflowshock.cases.hard.trials.surfaces import barrel
from reflowshock.fem.division.fine_joints import copied_joints, copies, with_coarse_joints
from reflowshock.fem.mesh.mesh import MeshData, append
from reflowshock.fem.mesh.mesh_file import read_mesh
from reflowshock.meshing.board.pads import pad_table
from reflowshock.meshing.board.parameters import Warpage
from reflowshock.meshing.joint.joints_file import write_joints
from reflowshock.meshing.joint.solder_mesh import joint_quality, mesh_coarse_or_fine, mesh_joint
from reflowshock.workflow.package_report import joint_tables as mesh_tables

BULGES = {"A4": 0.25 * MM, "B4": 0.04 * MM}  # two layers cannot hold the first


@pytest.fixture(scope="module")
def meshes():
    """Fine and coarse meshes of a ball and of a barrel."""
    whole, sites = package(), {site.name: site for site in pad_table(package(), board(), Warpage())}
    side, fine, coarse = side_of(Warpage(), whole), [], []
    for name, bulge in BULGES.items():
        body = barrel(sites[name].gap, bulge)
        fine.append(mesh_joint(body, sites[name], whole, side))
        coarse.append(mesh_coarse_or_fine(body, fine[-1], sites[name], whole, side))
    return SimpleNamespace(fine=fine, coarse=coarse)


@pytest.fixture(scope="module")
def files(meshes, tmp_path_factory) -> tuple[MeshData, MeshData]:
    """Return fine and coarse joints as they are read from their files."""
    folder = tmp_path_factory.mktemp("joints")
    for name, joints in vars(meshes).items():
        write_joints(joints, folder / f"{name}.msh")
    return read_mesh(folder / "fine.msh"), read_mesh(folder / "coarse.msh")


def test_the_reason_is_recorded_and_other_joints_are_coarse(meshes):
    ball, barrel_ = (joint_quality(mesh) for mesh in meshes.coarse)
    assert "use more layers" in ball["fine_instead"] and "fine_instead" not in barrel_
    assert np.array_equal(meshes.coarse[0].points, meshes.fine[0].points)
    assert set(meshes.coarse[1].cells) == {"solder@B4"}


def test_the_report_lists_fine_joints_with_reasons(meshes, tmp_path):
    assert mesh_tables.fine_instead(tmp_path) is None
    (tmp_path / "solder_mesh").mkdir()
    quality = {mesh.name: joint_quality(mesh) for mesh in meshes.coarse}
    (tmp_path / "solder_mesh/coarse_quality.json").write_text(json.dumps(quality))
    (row,) = mesh_tables.fine_instead(tmp_path)["rows"]
    assert row[0] == "A4" and "use more layers" in row[1]


def test_such_a_joint_takes_its_place_among_coarse_ones(files):
    fine, coarse = files
    mixed = with_coarse_joints(fine, coarse, ["B4"])
    counts = [len(mesh.cells[mesh.in_parts(lambda part: part.endswith("@A4"))]) for mesh in (fine, mixed)]
    assert counts[0] == counts[1]


def test_coarse_and_fine_copies_of_a_joint_have_their_own_parts(files):
    fine, coarse = files
    both = append([fine, copies(coarse, ["A4"])])
    original, copy = copied_joints(both)
    assert original.sum() == copy.sum() == fine.in_parts(lambda part: part.endswith("@A4")).sum()
