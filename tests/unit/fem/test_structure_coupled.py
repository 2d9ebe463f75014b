"""A structure divided into two models: unique nodes and cells, all loads, and the motion of one model."""

import numpy as np
import pytest

from reflowshock.fem.division.division import Division
from reflowshock.fem.division.structure_tables import structure_tables, tie_layers
from reflowshock.fem.division.tables import split
from reflowshock.fem.errors import CouplingError, StepError
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.mesh.mesh_file import read_mesh
from reflowshock.fem.output.compare import relative_error
from reflowshock.fem.output.compare_structures import solver_differences
from reflowshock.fem.problem.structure_checks import problems
from reflowshock.fem.setup.structure_models import divide_on_one_rank
from tests.support.fem_bars import bar_layers, run_bar, write_bar

WIDTH = 2e-3
LAYERS = bar_layers(("FR4", 6e-3, 6, (2, 2)), ("FR4", 1e-3, 4, (3, 3)), ("FR4", 6e-3, 6, (2, 2)))
LOADS = {
    "side": {"kind": "pressure", "on": "x_max", "peak": 1e5, "duration": 1e-5},
    "pull": {"kind": "motion", "on": "z_max", "component": "z", "peak": 0.1, "duration": 1e-5},
    "drop": {"kind": "input_g", "peak": 1e4, "duration": 2e-5, "direction": [1.0, 0.0, 0.2]},
    "poke": {"kind": "point_force", "at": [2e-4, 3e-4, 6.1e-3], "direction": [1.0, 1.0, 1.0], "peak": 0.2}
    | {"duration": 1e-5},  # in the fine layer, next to the tie
}
TABLES = {
    "supports": {
        "clamp": {"on": "z_min", "hold": ["x", "y", "z"]},
        "wall": {"on": "y_min", "hold": ["y"]},
    },
    "loads": LOADS,
    "watch": {name: {"at": [0.0, 0.0, z]} for name, z in (("low", 1e-3), ("inside", 6.5e-3), ("high", 12e-3))},
}


def dynamics(**changes) -> dict:
    """Return the table ``dynamics`` of two coupled models; ``changes`` replace keys."""
    numerics = {"history_samples": 60, "field_samples": 2}
    return {"duration": 2e-5, "coupling": {"scheme": "held_velocity"}, "numerics": numerics} | changes


def test_fine_layers_are_those_of_small_steps_and_all_is_counted_once(tmp_path):
    request = write_bar(tmp_path, WIDTH, LAYERS, 1e-5, **TABLES, dynamics=dynamics())
    whole = tie_layers(read_mesh(request.mesh), request)
    tables = structure_tables(whole, request)
    meso = (whole.mesh.points[whole.mesh.cells].mean(axis=1)[:, 2] > 3e-3) & whole.mesh.in_parts("layer_2".__ne__)
    plan = WindowPlan(1e-7, 2, 200, 1)
    division = Division("held_velocity", ~meso, meso, meso.astype(np.int32), (2,), plan)
    inputs = [item.tables for item in split(whole, tables, division).values()]
    (area,) = tables.areas.values()
    assert sum(item.areas["x_max"][1].sum(axis=0) for item in inputs) == pytest.approx(area[1].sum(axis=0))
    assert sum(len(item.areas["x_max"][0]) for item in inputs) == len(area[0])
    assert sum(item.pushed["poke"][1].sum() for item in inputs) == pytest.approx(1.0)
    for name, nodes in tables.nodes_of.items():
        assert sum(len(item.nodes_of[name]) for item in inputs) == len(nodes)
    for of_watch in ("nodes", "cells"):
        here = np.array([getattr(item.fitted.points, of_watch) >= 0 for item in inputs])
        assert np.all(here.sum(axis=0) == 1)


def test_the_finest_layer_and_its_buffer_are_the_meso_model(tmp_path):
    request = write_bar(tmp_path, WIDTH, LAYERS, 1e-5, **TABLES, dynamics=dynamics())
    division = divide_on_one_rank(request)
    elements = {role: len(tables.part) for role, tables in division.tables.items()}
    assert elements == {"macro": 2 * 4 * 4, "meso": 36 + 2 * 2 * 4}
    assert division.coupling["cut_nodes"] == 2 * 9
    assert [level["elements"] for level in division.coupling["levels"]] == list(elements.values())


def test_layers_that_are_alike_have_none_that_is_fine(tmp_path):
    layers = LAYERS | {"layer_1": LAYERS["layer_1"] | {"cells": 1, "in_plane": (2, 2)}}
    request = write_bar(tmp_path, WIDTH, layers, 1e-5, **TABLES, dynamics=dynamics())
    with pytest.raises(CouplingError, match=r"half of the longest.*name the fine layers in dynamics\.coupling\.fine"):
        divide_on_one_rank(request)


def test_a_pulse_shorter_than_a_window_is_refused_with_both_durations(tmp_path):
    request = write_bar(tmp_path, WIDTH, LAYERS, 1e-8, dynamics=dynamics())
    with pytest.raises(StepError, match=r"loads\.push lasts 1e-08 s, less than the coupling window of 1\.\d+e-07 s"):
        divide_on_one_rank(request)


@pytest.mark.parametrize("scheme", ["held_velocity", "gravouil_combescure", "local_steps"])
def test_two_models_move_as_one(tmp_path, scheme):
    """Loads across tie and interface, reactions and watch points agree within the error of the steps."""
    changes = {"coupling": {"scheme": scheme, "fine": ["layer_1"]}}
    result, two = run_bar(write_bar(tmp_path / "two", WIDTH, LAYERS, 1e-5, **TABLES, dynamics=dynamics(**changes)))
    assert all(check["ok"] for check in result["health"].values())
    assert result["coupling"]["scheme"] == scheme
    single = dynamics(**changes)
    request = write_bar(tmp_path / "one", WIDTH, LAYERS, 1e-5, **TABLES, solver="dns", dynamics=single)
    _, single_model = run_bar(request)
    differences = solver_differences(two, single_model)
    assert differences["displacement_difference"] < 0.005
    assert differences["strain_difference"] < 0.02
    for name in ("reaction@clamp", "external"):
        values = np.array(
            [np.interp(single_model["time"], two["time"], part) for part in two[name].reshape(len(two["time"]), -1).T]
        )
        assert relative_error(values, single_model[name].reshape(len(single_model["time"]), -1).T) < 0.02, name


@pytest.mark.parametrize(
    ("load", "clamped"),
    [
        ({"kind": "pressure", "on": "z_max", "peak": 1e5, "duration": 3e-5}, "z_min"),
        ({"kind": "motion", "on": "z_max", "component": "z", "peak": 0.1, "duration": 3e-5}, "z_min"),
        ({"kind": "input_g", "peak": 1e4, "duration": 3e-5}, "z_max"),
        (
            {"kind": "point_force", "at": [0.0, 0.0, 7e-3], "direction": [0.0, 0.0, 1.0], "peak": 0.4}
            | {"duration": 3e-5},
            "z_min",
        ),
    ],
    ids=["pressure", "motion", "support", "point_force"],
)
def test_what_acts_on_fine_elements_strains_them_as_in_one_model(tmp_path, load, clamped):
    """With nine steps per window: loads applied per window give strains 100 times too large, 1.5 times at a support."""
    layers = bar_layers(("FR4", 6e-3, 6, (2, 2)), ("FR4", 1e-3, 16, (2, 2)))
    support = {"clamp": {"on": clamped, "hold": ["x", "y", "z"]}}
    scene = {"loads": {"load": load}, "supports": support, "watch": {"end": {"at": [0.0, 0.0, 7e-3 - 2.5e-5]}}}
    changes = dynamics(duration=6e-5, coupling={"scheme": "local_steps", "fine": ["layer_1"]})
    result, two = run_bar(write_bar(tmp_path / "two", WIDTH, layers, 1e-5, **scene, dynamics=changes))
    _, single = run_bar(write_bar(tmp_path / "one", WIDTH, layers, 1e-5, **scene, solver="dns", dynamics=changes))
    assert result["coupling"]["m"] == 9
    assert all(check["ok"] for check in result["health"].values())
    assert solver_differences(two, single)["strain_difference"] < 0.03


@pytest.mark.parametrize("scheme", ["held_velocity", "impulse"])
def test_support_in_the_meso_model_carries_a_body_force_as_in_one_model(tmp_path, scheme):
    """With nine steps per window: a load per window gave strain errors of 3.5 and 8 % at support and interface."""
    layers = bar_layers(("FR4", 1e-3, 16, (2, 2)), ("FR4", 6e-3, 6, (2, 2)))
    scene = {
        "loads": {"drop": {"kind": "input_g", "peak": 1e4, "duration": 3e-5}},
        "supports": {"clamp": {"on": "z_min", "hold": ["x", "y", "z"]}},
        "watch": {"support": {"at": [0.0, 0.0, 2.5e-5]}, "near the cut": {"at": [0.0, 0.0, 1.5e-3]}},
    }
    changes = dynamics(duration=6e-5, coupling={"scheme": scheme, "fine": ["layer_0"]})
    result, two = run_bar(write_bar(tmp_path / "two", WIDTH, layers, 1e-5, **scene, dynamics=changes))
    _, single = run_bar(write_bar(tmp_path / "one", WIDTH, layers, 1e-5, **scene, solver="dns", dynamics=changes))
    assert result["coupling"]["m"] == 9
    assert all(check["ok"] for check in result["health"].values())
    assert solver_differences(two, single)["strain_difference"] < 0.01


def test_impulses_refuse_a_prescribed_motion_of_the_cut(tmp_path):
    """Only the macro model would have the motion, and the meso interface would drift: strains were wrong by 1.3."""
    side = {"loads": {"side": LOADS["pull"] | {"on": "x_max", "component": "x"}}, "supports": {}}
    changes = dynamics(coupling={"scheme": "impulse", "fine": ["layer_1"]})
    with pytest.raises(CouplingError, match=r"loads\.side prescribes the motion of 6 interface nodes.*impulse"):
        divide_on_one_rank(write_bar(tmp_path, WIDTH, LAYERS, 1e-5, **(TABLES | side), dynamics=changes))


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"coupling": {"fine": ["layer_3"]}}, "dynamics.coupling.fine", "no such layer"),
        ({"coupling": {"fine": list(LAYERS)}}, "dynamics.coupling.fine", "leaves no layer"),
        ({"coupling": {"direction": "one_way"}}, "dynamics.coupling.direction", "coarse mesh"),
        ({"coupling": {"placement": "disjoint"}}, "dynamics.coupling.placement", "one rank for each"),
        ({"coupling": {"macro_ranks": 1}}, "dynamics.coupling.macro_ranks", "applies only to placement"),
        ({"solver": "implicit"}, "dynamics.solver", "does not support coupling"),
        ({"modes": 2}, "dynamics.modes", "single model"),
        ({"kinematics": "finite", "coupling": {"scheme": "local_steps"}}, "dynamics.coupling.scheme", "elastic"),
        ({"numerics": {"explicit_step": 1e-9}}, "dynamics.numerics.explicit_step", "single model"),
    ],
)
def test_what_two_models_cannot_do_is_said_before_anything_is_computed(tmp_path, changes, key, words):
    messages = problems(write_bar(tmp_path, WIDTH, LAYERS, 1e-5, **TABLES, dynamics=dynamics(**changes)))
    assert [problem.key for problem in messages] == [key]
    assert words in messages[0].message
