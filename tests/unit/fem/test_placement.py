"""Placement of models on ranks from prescribed costs and speeds."""

import json
from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI
from pydantic import ValidationError

from reflowshock.cases.hard.trials.grids import grid, joint_mesh, mesh_of
from reflowshock.fem.coupling.planner import (
    Measured,
    ModelWork,
    plan_from,
    plan_ranks,
    store_costs,
    stored_costs,
    words,
)
from reflowshock.fem.coupling.speeds import (
    Kind,
    StepCost,
    families,
    fit_step_cost,
    sample_terms,
    seconds_of_step,
    speeds_of,
)
from reflowshock.fem.estimates.estimate import WindowPlan, predict_seconds
from reflowshock.fem.estimates.placement import (
    ModelCost,
    WindowCost,
    alternatives,
    disjoint,
    least_seconds,
    shared,
    window_seconds,
)
from reflowshock.fem.parallel.communicators import Communicators
from reflowshock.fem.problem.shock import Ranks
from reflowshock.materials.library import LIBRARY

EVEN = WindowCost(ModelCost(1e-3, 0.0, 1), ModelCost(1e-3, 0.0, 8), 1e-5)
KIND = Kind([LIBRARY["FR4"], LIBRARY["copper"]], "incompatible_modes", "small", 1e-8)


def cost(macro: float, meso: float, latency: float = 1e-5) -> WindowCost:
    """Return the cost of a window, from seconds of both models and of a message."""
    return WindowCost(ModelCost(macro, 0.0, 1), ModelCost(meso, 0.0, 8), latency)


def best(total: int, speeds: list[float] | None = None, window: WindowCost = EVEN, **asked):
    """Return the best placement of two models on ``total`` ranks."""
    return alternatives(Ranks(total=total, **asked), speeds or [1.0] * total, window)[0].placement


def test_elements_that_turn_are_timed_at_rest():
    joint = joint_mesh("A1", 0.0, 0.0)
    kind = replace(KIND, materials=[LIBRARY["FR4"]] * len(joint.part_names), kinematics="finite")
    assert seconds_of_step(sample_terms(joint, kind), len(joint.points)) > 0.0


@pytest.mark.parametrize(
    "asked", [{}, {"placement": "shared"}, {"placement": "disjoint"}, {"placement": "disjoint", "macro": 2}]
)
@pytest.mark.parametrize("window", [EVEN, cost(3e-3, 1e-4), replace(EVEN, overlap=False)])
def test_the_fastest_of_equal_ranks_is_known_without_trying_them(asked, window):
    for total in (3, 8):
        ranks = Ranks(total=total, **asked)
        assert least_seconds(ranks, window) == alternatives(ranks, [1.0] * total, window)[0].seconds


def test_one_rank_carries_both_models():
    assert best(1) == shared(("macro", "meso"), 1)


def test_equal_models_go_apart_to_save_messages():
    assert best(2) == disjoint([0], 2)


def test_unequal_models_share_ranks():
    assert best(2, window=cost(0.2e-3, 1.8e-3)).name == "shared"


def test_number_of_macro_ranks_follows_the_work():
    assert best(4, window=cost(1e-3, 3e-3)) == disjoint([0], 4)
    assert len(best(4, window=cost(3e-3, 1e-3)).ranks["macro"]) == 3


def test_models_that_wait_for_each_other_share_ranks():
    assert best(2, window=replace(EVEN, overlap=False)).name == "shared"
    apart = window_seconds(disjoint([0], 2), [1.0, 1.0], replace(EVEN, overlap=False))
    assert apart == pytest.approx(2e-3 + 2e-5)


def test_slow_ranks_get_the_small_model():
    """A core of half the speed takes a third of the work shared with a fast core."""
    assert best(2, [1.0, 0.5], cost(0.5e-3, 1e-3)) == disjoint([1], 2)
    assert best(2, [1.0, 0.5], cost(1e-3, 0.5e-3)) == disjoint([0], 2)
    assert best(3, [0.5, 1.0, 1.0], cost(0.5e-3, 2e-3)) == disjoint([0], 3)


def test_what_the_input_asks_for_is_all_there_is():
    assert best(2, window=cost(1e-3, 9e-3), placement="disjoint") == disjoint([0], 2)
    assert best(4, placement="disjoint", macro=3) == disjoint([0, 1, 2], 4)
    assert best(2, placement="shared") == shared(("macro", "meso"), 2)


def test_window_by_hand():
    speeds, window = [1.0, 2.0], cost(3e-3, 8e-3, latency=1e-4)
    assert window_seconds(disjoint([0], 2), speeds, window) == pytest.approx(4e-3 + 2e-4)
    assert window_seconds(shared(("macro", "meso"), 2), speeds, window) == pytest.approx(11e-3 / 3 + 11e-4)
    assert window_seconds(shared(("macro", "meso"), 1), [2.0], window) == pytest.approx(5.5e-3)


@pytest.mark.parametrize(
    "bad", [{"total": 0}, {"total": 1, "placement": "disjoint"}, {"macro": 1}, {"placement": "split"}, {"meso": 1}]
)
def test_ranks_that_do_not_fit_are_refused(bad):
    with pytest.raises(ValidationError):
        Ranks(**bad)
    with pytest.raises(ValidationError):
        Ranks(total=2, placement="disjoint", macro=2)


def test_speeds_alike_are_equal():
    assert speeds_of(np.array([1.0, 1.1])).tolist() == [1.0, 1.0]
    assert speeds_of(np.array([1.0, 3.0])) == pytest.approx([1.5, 0.5])


def test_step_cost_from_two_samples():
    assert fit_step_cost(100, 2e-5, 1100, 1.2e-4) == pytest.approx((1e-5, 1e-7))
    assert fit_step_cost(100, 3e-4, 1000, 1e-4) == pytest.approx((5e-5, 5e-8))  # disturbed
    assert fit_step_cost(64, 1e-4, 64, 1e-4) == pytest.approx((5e-5, 0.5e-4 / 64))


def model(count: int, steps: int, level: int = 0, ratios: tuple[int, ...] = ()) -> ModelWork:
    """Return a strip of FR4 boxes, a quarter of them copper at a level, with distorted elements at its end."""
    points, cells = grid(np.arange(count + 1) * 1e-3, [0, 1e-3], [0, 1e-3])
    points[-1, 0] += 1e-4
    mesh = mesh_of(points, cells, np.where(np.arange(count) < count // 4, "copper", "board"), {})
    levels = np.where(np.arange(count) < count // 4, level, 0).astype(np.int32)
    return ModelWork(mesh, levels, steps * np.cumprod([1, *ratios]), steps, KIND)


def measured(ranks: int, box: float = 1e-7, assembled: float = 4e-7, slow: float = 1.0) -> Measured:
    """Return measured costs of ranks, the first of which is slower by a factor."""
    element = np.tile([box, assembled, 0.0, 0.0, 0.0], (ranks, 1)) * np.array([slow] + [1.0] * (ranks - 1))[:, None]
    return Measured(StepCost(np.zeros(element.shape), element), 1e-6)


def planned(ranks: Ranks, measurement: Measured, **loads: ModelWork):
    """Return the plan of models with some work on ranks with measured costs."""
    family = {role: families(load.mesh, load.kind) for role, load in loads.items()}
    return plan_from(loads, family, ranks, measurement, True)


def test_families_and_levels_make_the_work():
    plan = planned(Ranks(total=1), measured(1), dns=model(100, 5, level=1, ratios=(4,)))
    work = 5 * (75 - 1) * 1e-7 + 5 * 4e-7 + 20 * 25 * 1e-7
    assert plan.summary["predicted_window_seconds"] == pytest.approx(work + 5 * 2.5e-5)
    assert not plan.cells


def test_cells_of_a_level_are_shared_too():
    plan = planned(Ranks(total=2), measured(2), dns=model(100, 1, level=1, ratios=(32,)))
    quick = plan.cells["dns"][:25]
    assert 10 <= (quick == 0).sum() <= 15


def test_slow_rank_gets_fewer_cells():
    loads = {"macro": model(400, 1), "meso": model(400, 8)}
    plan = planned(Ranks(total=2, placement="shared"), measured(2, slow=3.0), **loads)
    assert plan.summary["speeds"] == pytest.approx([0.5, 1.5])
    for cells in plan.cells.values():
        assert (cells == 0).mean() == pytest.approx(0.25, abs=0.02)
    assert "shared by 2" in words(plan)


def test_measurement_is_kept_for_a_run_that_continues(tmp_path):
    loads = {"macro": model(300, 1), "meso": model(300, 8)}
    first = plan_ranks(MPI.COMM_SELF, loads, Ranks(total=1), tmp_path)
    assert first.summary["update_seconds"].keys() == {"box", "assembled"}
    assert plan_ranks(MPI.COMM_SELF, loads, Ranks(total=1), tmp_path).summary == first.summary
    store_costs(tmp_path, measured(2))
    assert stored_costs(MPI.COMM_SELF, tmp_path, np.array([0])) is None
    store_costs(tmp_path, measured(1))
    assert stored_costs(MPI.COMM_SELF, tmp_path, np.array([0])) is not None
    assert stored_costs(MPI.COMM_SELF, tmp_path, np.array([0, 2])) is None
    json.dumps(first.summary)


def test_other_ranks_hear_the_choice(tmp_path):
    """A rank without a mesh only takes part in the measurement and receives the plan from rank 0."""
    loads = {"dns": replace(model(64, 1), steps=3)}
    assert plan_ranks(MPI.COMM_SELF, loads, Ranks(), None).placement == shared(("dns",), 1)


def test_communicators_of_any_placement():
    with Communicators(MPI.COMM_SELF, shared(("macro", "meso"), 1)) as comms:
        assert list(comms.models) == ["macro", "meso"]
        assert comms.first == {"macro": 0, "meso": 0}


def test_forecast_knows_placement_and_levels():
    plan = WindowPlan(1e-6, 20, 1000, 1)
    two_scale, dns = predict_seconds(1e5, [(1e4, 20)], plan, Ranks(total=2, placement="shared"), at_once=False)
    levels, _ = predict_seconds(1e5, [(9e3, 2), (1e3, 20)], plan, Ranks(total=2, placement="shared"), at_once=False)
    assert two_scale / dns == pytest.approx((1e5 / 4.3 + 2e5) / (20 * (1e5 / 4.3 + 1e4)), rel=0.1)
    assert levels < 0.4 * two_scale
    apart, _ = predict_seconds(1e5, [(1e4, 20)], plan, Ranks(total=2, placement="disjoint"), at_once=False)
    auto, _ = predict_seconds(1e5, [(1e4, 20)], plan, Ranks(total=2), at_once=False)
    assert auto == min(apart, two_scale)
