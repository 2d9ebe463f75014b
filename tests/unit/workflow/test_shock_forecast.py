"""What plan says of two scales: scheme, levels of time steps, fine and coarse joints, cost."""

from itertools import pairwise
from pathlib import Path

import pytest

from reflowshock.fem.division.path_levels import MOST_LEVELS
from reflowshock.fem.kernels.levels import PACES
from reflowshock.meshing.board.estimate import count_elements
from reflowshock.workflow.board_drop.board_deflection import decided
from reflowshock.workflow.board_drop.forecast import forecast_board_drop
from reflowshock.workflow.board_drop.part_forecast import forecast_parts, two_scale_parts
from reflowshock.workflow.board_drop.shock_forecast import (
    SECONDS_TO_START,
    forecast_shock,
    implicit_seconds,
    mode_seconds,
    seconds_outside_windows,
)
from reflowshock.workflow.pipeline.reader import read_case
from tests.support.workflow_command import SMALL_CASE

CASES = Path(__file__).resolve().parents[3] / "cases"


def predicted(*settings: str):
    """Return the forecast of the shock of the shortened case with settings."""
    case = decided(read_case(SMALL_CASE, settings, oversubscribe=True))
    return forecast_shock(case, forecast_parts(case))


def test_joints_that_are_not_fine_have_the_coarse_mesh():
    case = read_case(SMALL_CASE)
    every, single_fine = (count_elements(case.package, case.board, case.warpage, fine) for fine in (None, 1))
    assert "solder_coarse" not in every
    assert single_fine["solder"].elements * 4 == every["solder"].elements
    assert single_fine["copper"].elements * 4 == every["copper"].elements
    assert single_fine["solder_coarse"].elements == 3 * 8
    assert single_fine["solder_coarse"].smallest[2] > every["solder"].smallest[2]


def test_linear_elements_take_local_steps_from_the_window_down():
    levels = predicted().levels
    assert levels[0].count == 1
    assert levels[0].parts == ("board", "board_patch")
    assert all(finer.count % coarser.count == 0 for coarser, finer in pairwise(levels))
    assert sum(level.elements for level in levels) == sum(
        p.elements for p in two_scale_parts(read_case(SMALL_CASE)).values()
    )


def test_copper_at_its_true_mass_takes_a_level_of_its_own():
    shock = predicted("shock.numerics.mass_scaled=[]")
    assert shock.scheme == "local_steps"
    assert shock.levels[-1].parts == ("copper",)
    assert shock.levels[-1].step <= 0.9 * forecast_parts(read_case(SMALL_CASE))["copper"].critical_step


def test_scaled_masses_follow_the_step_of_the_others_or_a_required_one():
    plain = forecast_parts(read_case(SMALL_CASE, ["shock.numerics.mass_scaled=[]"]))
    scaled = forecast_parts(read_case(SMALL_CASE, ['shock.numerics.mass_scaled=["copper"]']))
    others = min(part.critical_step for name, part in plain.items() if name != "copper")
    assert scaled["copper"].scaled_step == others > plain["copper"].scaled_step
    settings = ['shock.numerics.mass_scaled=["copper"]', "shock.numerics.mass_scaled_step=6 ns"]
    assert others > 6e-9
    assert forecast_parts(read_case(SMALL_CASE, settings))["copper"].scaled_step == pytest.approx(6e-9)


def test_one_level_is_one_ratio():
    assert len(predicted("shock.numerics.mass_scaled=[]", "shock.coupling.levels=1").levels) == 2


@pytest.mark.parametrize("setting", ["shock.numerics.plasticity=on", "shock.numerics.kinematics=finite"])
def test_path_dependent_models_use_held_velocity(setting):
    shock = predicted(setting)
    assert shock.scheme == "held_velocity"
    assert shock.levels[0].parts == ("board",)
    assert shock.levels[-1].count >= shock.substeps
    assert implicit_seconds(read_case(SMALL_CASE, [setting])) is None


PATH = ("shock.numerics.plasticity=on", "shock.numerics.mass_scaled=[]")


def test_levels_along_a_path_have_layers_of_solder_with_the_copper():
    case = read_case(SMALL_CASE, PATH)
    parts, levels = two_scale_parts(case), predicted(*PATH).levels
    solder, copper = parts["solder"].elements, parts["copper"].elements
    assert len(levels) > 2
    assert sum(level.elements for level in levels) == sum(part.elements for part in parts.values())
    layer = 2 * solder // case.package.joint_numerics.layers
    assert levels[-1].elements >= copper + min(solder, 2 * layer)
    assert levels[-1].step <= 0.9 * parts["copper"].scaled_step


@pytest.mark.parametrize(
    "setting",
    ["shock.coupling.levels=1", "shock.damping.stiffness_coefficient=1e-9 s", "shock.coupling.scheme=impulse"],
)
def test_other_effects_exclude_levels_of_path_dependent_models(setting):
    shock = predicted(*PATH, setting)
    assert [level.count for level in shock.levels] == [1, shock.substeps]


def test_a_large_mass_on_the_board_leaves_levels():
    shaken = predicted(*PATH, "shock.method=large_mass")
    assert [level.count for level in shaken.levels] == [level.count for level in predicted(*PATH).levels]


def test_elements_around_holes_set_the_window_where_they_are_the_smallest():
    """hu_bga_drop takes 33 600 windows of 44.64 ns: 49.8 ns are the critical step of an element at its hole."""
    case = read_case(CASES / "hu_bga_drop/case.toml")
    shock = forecast_shock(case, forecast_parts(case))
    assert shock.windows == 33600
    assert forecast_parts(case)["board"].critical_step == pytest.approx(49.82e-9, rel=0.005)


def test_elements_of_a_section_set_the_steps_of_joints():
    """The meshes of hu_bga_drop: 3.469 ns of copper, 5.646 ns of solder; 3, 9 and 18 steps a window."""
    case = read_case(CASES / "hu_bga_drop/case.toml", ["scale=physical", "shock.numerics.kinematics=corotational"])
    parts = two_scale_parts(case)
    assert parts["copper"].critical_step == pytest.approx(3.469e-9, rel=0.003)
    assert parts["solder"].critical_step == pytest.approx(5.646e-9, rel=0.003)
    assert [level.count for level in forecast_shock(case, forecast_parts(case)).levels] == [1, 3, 9, 18]


def test_no_more_levels_than_the_kernels_have_paces():
    assert MOST_LEVELS == PACES


def test_the_requested_scheme_is_used():
    assert predicted("shock.coupling.scheme=held_velocity").scheme == "held_velocity"


def test_an_elastic_drop_has_an_implicit_cost_to_compare_with():
    seconds = implicit_seconds(decided(read_case(SMALL_CASE)))
    assert seconds > 0.0
    early = read_case(SMALL_CASE, ["shock.numerics.dns_duration=0.01 ms"])
    assert (
        implicit_seconds(decided(early)) == seconds
    )  # of the whole shock: beside the two-scale run, which does not end early


def test_one_way_the_coarse_model_takes_the_window_of_all_its_parts():
    shock = predicted("shock.coupling.direction=one_way", "shock.coupling.fine_joints=['A4']")
    macro, meso = shock.levels
    assert shock.scheme == "held_velocity"
    assert "die" in macro.parts
    assert meso.parts == ("solder", "copper")
    assert macro.step < predicted().window


def test_what_lies_around_windows_counts():
    """Start-up, set-up and samples: a run of few windows takes seconds all the same."""
    case = read_case(SMALL_CASE)
    parts = forecast_parts(case)
    assert seconds_outside_windows(case, parts) > seconds_outside_windows(case, parts, share=0.1) > SECONDS_TO_START
    assert forecast_board_drop(case).seconds["shock"] > forecast_shock(case, parts).two_scale + SECONDS_TO_START


def test_natural_modes_cost_only_where_they_are_asked_for():
    assert (
        mode_seconds(read_case(SMALL_CASE, ["shock.modes=4"]))
        > mode_seconds(read_case(SMALL_CASE, ["shock.modes=0"]))
        == 0.0
    )


def test_columns_are_no_boxes():
    """Elements of a column around a fine joint turn at the price of any hexahedra."""
    case = read_case(CASES / "jedec_bga/case.toml", ["scale=quick", "shock.numerics.kinematics=corotational"])
    parts = two_scale_parts(case)
    assert parts["board_column"].cost == parts["copper"].cost > parts["board_patch"].cost
