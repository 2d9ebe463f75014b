"""Division of a small package into models: buffers, ties, levels and invalid divisions."""

from dataclasses import replace

import numpy as np
import pytest

from reflowshock.cases.hard.trials.coupled import MANY, surveyed
from reflowshock.fem.division.checks import check_division
from reflowshock.fem.division.divide import divide, grow_region, scheme_for
from reflowshock.fem.division.split import interface_between, part_of
from reflowshock.fem.division.tables import model_inputs
from reflowshock.fem.errors import CouplingError
from reflowshock.fem.mesh.mesh import append
from reflowshock.fem.model.steps import steps_of_division
from reflowshock.fem.problem.shock import Coupling
from reflowshock.materials.library import SAC305
from reflowshock.materials.roles import ELASTIC, Materials
from tests.support.fem_models import small_assembly

ELASTIC, YIELDING = ELASTIC, Materials(solder=SAC305)


@pytest.fixture(scope="module")
def mesh():
    """Return the mesh of the small package."""
    return append(small_assembly())


def scene(mesh, materials=ELASTIC, **coupling):
    """Return joined mesh, survey and rules of a mesh under a coupling."""
    return surveyed(mesh, materials, coupling=Coupling(**coupling))


def refused(parts, division, words):
    """Check that a division is rejected with some words."""
    with pytest.raises(CouplingError, match=words):
        check_division(parts[0], parts[1], division, parts[2])


@pytest.mark.parametrize("scheme", ["held_velocity", "gravouil_combescure", "local_steps"])
def test_every_cell_is_in_one_model_and_ties_are_complete(mesh, scheme):
    parts = scene(mesh, scheme=scheme)
    division = divide(*parts)
    check_division(*parts[:2], division, parts[2])
    assert np.array_equal(division.macro, ~division.meso)
    macro, meso = (part_of(parts[0], cells) for cells in (division.macro, division.meso))
    assert len(macro.tie.slave) + len(meso.tie.slave) >= len(parts[0].tie.slave)
    assert (meso.tie.master >= 0).all()
    interface = interface_between(parts[0], macro, meso)
    assert not np.isin(interface, parts[0].tie.slave).any()
    tables = {role: item.tables for role, item in model_inputs(parts[0], division).items()}
    assert len(tables["macro"].interface) == len(tables["meso"].interface) == len(interface)


def test_cut_of_gravouil_combescure_are_the_masters(mesh):
    parts = scene(mesh, scheme="gravouil_combescure")
    division = divide(*parts)
    interface = interface_between(parts[0], part_of(parts[0], division.macro), part_of(parts[0], division.meso))
    on_board = parts[0].tie.master[parts[0].mesh.points[parts[0].tie.slave][:, 2] < 1e-9]
    assert np.array_equal(interface, np.unique(on_board))


def test_more_buffer_layers_are_more_cells(mesh):
    cells = [int(divide(*scene(mesh, scheme="held_velocity", buffer_layers=k)).meso.sum()) for k in (2, 3)]
    assert cells[1] > cells[0]


def test_layers_grow_by_nodes():
    cells = np.array([[0, 1], [1, 2], [2, 3], [3, 4]], np.int32)
    seeds = np.array([True, False, False, False, False])
    assert grow_region(cells, seeds, np.ones(4, bool), 2).tolist() == [True, True, False, False]
    assert grow_region(cells, seeds, np.array([True, False, True, True]), 4).tolist() == [True, False, False, False]


def test_large_mass_leaves_levels_along_a_path_where_the_meso_model_has_none_of_its_nodes(mesh):
    whole, division, rules = scene(mesh, YIELDING, scheme="held_velocity")
    dear = replace(division, cost=division.cost * MANY)
    free = divide(whole, dear, rules)
    assert len(free.ratios) > 1
    inside = np.unique(whole.mesh.cells[free.meso])
    outside = np.setdiff1d(whole.mesh.cells[free.macro], inside)
    assert divide(whole, dear, replace(rules, shaken=outside)).ratios == free.ratios
    assert len(divide(whole, dear, replace(rules, shaken=inside[:1])).ratios) == 1


def test_levels_of_the_program_are_integer_parts_of_the_window(mesh):
    parts = scene(mesh, scheme="local_steps", levels=2)
    division = divide(*parts)
    assert division.plan.substeps == np.prod(division.ratios)
    assert division.level.max() == len(division.ratios) <= 2
    assert division.meso_step == division.plan.window
    steps = division.plan.window / np.cumprod([1, *division.ratios])
    assert (steps[division.level] <= 0.9 * parts[1].step * (1 + 1e-9)).all()


@pytest.mark.parametrize(
    ("materials", "coupling", "scheme"),
    [
        (ELASTIC, {}, "local_steps"),
        (YIELDING, {}, "held_velocity"),
        (YIELDING, {"buffer_layers": 20}, "gravouil_combescure"),
        (ELASTIC, {"scheme": "held_velocity"}, "held_velocity"),
    ],
)
def test_scheme_follows_from_materials_and_room(mesh, materials, coupling, scheme):
    assert scheme_for(*scene(mesh, materials, **coupling)).scheme == scheme


def test_strong_stiffness_damping_leaves_held_velocity(mesh):
    whole, division, rules = scene(mesh)
    choice = scheme_for(whole, division, replace(rules, stiffness=1e-8))
    assert choice.scheme == "held_velocity"
    assert "damping" in choice.why


def test_yielding_solder_is_no_business_of_local_steps(mesh):
    parts = scene(mesh, YIELDING, scheme="local_steps")
    refused(parts, divide(*parts), r"elements of solder are not; use held_velocity or gravouil_combescure")


def test_window_above_the_elements_step_is_refused(mesh):
    parts = scene(mesh, scheme="held_velocity")
    division = divide(*parts)
    larger = replace(division, plan=replace(division.plan, window=1.01 * division.plan.window))
    refused(parts, larger, r"the window of .* is above step_fraction = 0\.9 of .* elements \(board\).* is stable")


def test_board_that_is_all_buffer_is_refused(mesh):
    parts = scene(mesh, scheme="held_velocity", buffer_layers=20)
    division = divide(*parts)
    assert steps_of_division(*parts[:2], division, parts[2]).macro_critical > 0.0
    refused(parts, division, r"the macro model is empty: .*20 layers")
