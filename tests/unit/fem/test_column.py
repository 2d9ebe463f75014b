import re
from dataclasses import replace

import numpy as np
import pytest

from reflowshock.fem.division.tables import join_meshes
from reflowshock.fem.division.whole import Treatment, survey
from reflowshock.fem.errors import MeshError, StepError
from reflowshock.fem.mesh import column
from reflowshock.fem.mesh.mesh import append, boundary_facets, cells_of_facets
from reflowshock.materials.library import FR4
from reflowshock.materials.roles import ELASTIC
from tests.support.imprinted_patch import IMPRINTED, Mesh, Problem, boxes, data_of, patch
from tests.unit.meshing.test_column import MM, standing
from tests.unit.meshing.test_tied_column import hollow

GRADIENT = 1e-3 * np.array([[1.0, -0.4, 0.7], [0.3, -0.8, 0.2], [-0.6, 0.9, 0.5]])


@pytest.fixture(scope="module")
def whole():
    """Return the joined mesh of a joint in columns."""
    return patch(IMPRINTED)[0]


def test_columns_take_the_place_of_boxes(whole):
    mesh = whole.mesh
    counts = {name: int(np.sum(mesh.part == number)) for number, name in enumerate(mesh.part_names)}
    assert (counts["board"], counts["substrate"]) == (4 * (144 - 16), 2 * (144 - 16))
    assert whole.moved < 1e-15
    assert len(mesh.facets_of("board_bottom")) == 128
    assert not any(name.startswith(("column_", "board_bottom@")) for name in mesh.facets)


def test_facets_that_no_cell_has_any_more_go_in_one_search(whole, monkeypatch):
    stay, empty = whole.mesh.part % 2 == 0, {"empty": np.empty((0, 4), np.int32)}
    searched = []

    def search(cells, facets):
        searched.append(len(facets))
        return cells_of_facets(cells, facets)

    monkeypatch.setattr(column, "cells_of_facets", search)
    left = replace(whole.mesh, cells=whole.mesh.cells[stay], part=whole.mesh.part[stay])
    mesh = replace(left, facets=left.facets | empty)
    remaining = column.drop_stale_facets(mesh).facets
    assert searched == [sum(len(some) for some in mesh.facets.values())]
    assert list(remaining) == list(mesh.facets)
    one_by_one = {name: some[cells_of_facets(mesh.cells, some) >= 0] for name, some in mesh.facets.items()}
    assert all(np.array_equal(remaining[name], one_by_one[name]) for name in remaining)
    assert 0 < sum(len(some) for some in remaining.values()) < searched[0]


def test_a_constant_strain_passes_the_ties_of_a_column(whole):
    """On matching mesh lines the force at inner nodes is zero."""
    problem = Problem(whole, False, dict.fromkeys(("board", "substrate", "copper", "solder"), FR4))
    displacement = whole.mesh.points @ GRADIENT.T
    force = (problem.tie.T @ problem.hencky.linearised(displacement)[0].ravel()).reshape(-1, 3)
    points = whole.mesh.points
    lateral = np.abs(points[:, :2]).max(axis=1) > 1.5 * MM - 1e-9
    tied = np.zeros(len(points), bool)
    tied[whole.tie.master] = True
    around = tied & ~lateral & (np.abs(points[:, 2] + 0.5 * MM) < 0.4 * MM)
    assert around.sum() > 20
    scale = np.abs(problem.hencky.linearised(displacement)[0][around]).max()
    assert np.abs(force[around]).max() < 1e-10 * scale


def test_boxes_that_leave_no_room_for_a_column_are_refused():
    mesh = Mesh(0.3 * MM, IMPRINTED.joint, IMPRINTED.imprint)
    message = "board_column@A1 fills 1e-09 m^3, the boxes in its place 1.44e-09 m^3: the lines of board and package"
    with pytest.raises(MeshError, match=re.escape(message)):
        patch(mesh)


def neighbours(first=-2.5, upper=None, **lower):
    """Return two adjacent joints between boxes of board and warped substrate, starting at y = first [mm]."""
    joint, side = standing("B4", **lower)
    joints = [data_of(upper or standing("A4")[0]), data_of(joint)]
    lines = np.linspace(-2.5, 2.5, 21) * MM
    levels = (0.34 + np.array([0.0, 0.2, 0.4])) * MM
    along = lines[lines > first * MM - 1e-12]
    above = boxes("substrate", lines, levels, along)
    above.points[:] = side.displaced(above.points)
    return append([boxes("board", lines, np.linspace(-1.0, 0.0, 5) * MM, along), above, *joints])


def test_neighbouring_columns_share_their_face():
    mesh = neighbours()
    whole = join_meshes(mesh)
    number = {name: k for k, name in enumerate(whole.mesh.part_names)}
    for part, shared in (("board_column", 5 * 8), ("substrate_column", 5 * 6)):
        nodes = [np.unique(whole.mesh.cells[whole.mesh.part == number[f"{part}@{joint}"]]) for joint in ("A4", "B4")]
        assert len(np.intersect1d(*nodes)) == shared
    inside = np.abs(whole.mesh.points[whole.tie.slave, 1] - 1.0 * MM) < 1e-9
    x = whole.mesh.points[whole.tie.slave[inside], 0] / MM
    assert np.abs(x - 1.5).min() > 0.4  # only the ends of the common face are tied
    assert whole.moved < 1e-9


def test_a_joint_with_a_void_shares_the_face_of_its_neighbour_and_stands_on_its_column():
    mesh = neighbours(upper=hollow()[0])
    whole = join_meshes(mesh)
    columns = [np.unique(whole.mesh.cells[whole.mesh.in_parts(f"board_column@{name}".__eq__)]) for name in ("A4", "B4")]
    assert len(np.intersect1d(*columns)) == 5 * 8
    copper = np.unique(whole.mesh.cells[whole.mesh.in_parts("copper_board@A4".__eq__)])
    tied = np.isin(whole.tie.slave, copper)
    assert tied.sum() == len(np.unique(mesh.facets["slave@foot@A4"]))
    assert np.isin(whole.tie.master[tied], columns[0]).all()
    assert whole.moved < 1e-6 * MM


def test_neighbours_with_other_rims_are_refused():
    finer = {"core": 5, "rings": 2, "layers": 10, "copper_layers": 2}
    message = r"the columns of A4 and B4 touch with \d+ faces that do not match, near \(0\.001\d+, 0\.001, "
    with pytest.raises(MeshError, match=message):
        join_meshes(neighbours(joint_numerics=finer))


def test_faces_on_a_plane_of_symmetry_are_held_there():
    """The lower column ends at y = 0, the symmetry plane of a quarter model."""
    mesh = neighbours(first=0.0)
    facets = boundary_facets(mesh.cells[mesh.in_parts(lambda name: "@" not in name)])
    mesh.facets["symmetry_y"] = facets[(mesh.points[facets, 1] < 1e-12).all(axis=1)]
    whole = join_meshes(mesh)
    held = whole.mesh.facets["symmetry_y"]
    column = np.unique(whole.mesh.cells[whole.mesh.in_parts("board_column@B4".__eq__)])
    assert np.sum(np.isin(held, column).all(axis=1)) == 4 * 7
    assert (np.abs(whole.mesh.points[held, 1]) < 1e-12).all()


def test_masses_of_a_column_are_scaled_to_the_step_of_the_boxes_or_as_far_as_wanted(whole):
    """Column elements below the target step are scaled exactly to it; all others are unchanged."""
    mesh, scaled_parts = whole.mesh, ("column", "solder", "copper")
    plain, full = (survey(mesh, ELASTIC, Treatment(mass_scaled=scaled)) for scaled in ((), scaled_parts))
    boxes = mesh.in_parts(lambda name: "@" not in name)
    assert np.array_equal(full.factor[boxes], np.ones(boxes.sum()))
    assert full.step.min() == pytest.approx(plain.plain_step[boxes].min(), rel=1e-12)
    target_step = 0.5 * (plain.plain_step.min() + plain.plain_step[boxes].min())
    some = survey(mesh, ELASTIC, Treatment(mass_scaled=scaled_parts, scaled_step=target_step))
    assert some.step.min() == pytest.approx(target_step, rel=1e-12)
    assert np.array_equal(some.factor > 1.0, ~boxes & (plain.plain_step < target_step))
    assert 0.0 < some.added_mass.sum() < full.added_mass.sum()


def test_all_that_is_scaled_has_no_step_but_a_wanted_one(whole):
    every = ("board", "substrate", "copper", "solder")
    with pytest.raises(StepError, match="includes every role"):
        survey(whole.mesh, ELASTIC, Treatment(mass_scaled=every))
    assert survey(whole.mesh, ELASTIC, Treatment(mass_scaled=every, scaled_step=1e-8)).step.min() >= 1e-8 * (1 - 1e-12)
