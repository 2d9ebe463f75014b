import math

import pytest

from reflowshock.fem.estimates.solver_cost import box_factor, forecast_solvers, plate_nodes
from reflowshock.fem.problem.structure import StructureProblem
from tests.support.fem_structures import structure_tables_of

# Unknowns of three MUMPS factorisations by benchmarks/jedec_oracle.py: operations, entries.
MEASURED = {(80, 61, 5): (2.27e10, 3.14e7), (40, 41, 5): (4.42e9, 8.42e6), (20, 21, 21): (1.61e10, 1.60e7)}


def scene(**changes) -> StructureProblem:
    """Return the problem of the clamped strip; ``changes`` replace tables."""
    names = StructureProblem.model_fields
    return StructureProblem.model_validate({k: v for k, v in structure_tables_of(**changes).items() if k in names})


def test_factor_of_a_chain_is_that_of_a_band():
    """Chains of nodes are split into single fronts: work and fill are proportional to their length."""
    short, long = (box_factor((count, 1, 1)) for count in (255, 511))
    assert long.operations == pytest.approx(2 * short.operations, rel=0.02)
    assert long.entries == pytest.approx(2 * short.entries, rel=0.02)


def test_work_of_plates_and_cubes_grows_with_its_known_powers():
    """Nested dissection: n^(3/2) operations in two dimensions, n^2 in three (George 1973), n the number of nodes."""
    plate = [box_factor((count, count, 1)).operations for count in (255, 511)]
    cube = [box_factor((count, count, count)).operations for count in (63, 127)]
    assert math.log(plate[1] / plate[0], 4) == pytest.approx(1.5, abs=0.05)
    assert math.log(cube[1] / cube[0], 8) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("nodes", MEASURED)
def test_factor_is_within_a_third_of_what_mumps_needed(nodes):
    predicted = box_factor(nodes)
    assert (predicted.operations, predicted.entries) == pytest.approx(MEASURED[nodes], rel=0.33)


def test_few_explicit_steps_are_cheaper_and_many_are_not():
    few = forecast_solvers(scene(), 48, 10, 1000)
    many = forecast_solvers(scene(), 48, 10**7, 1000)
    assert (few.cheaper, many.cheaper) == ("explicit", "implicit")
    assert "Explicit steps are" in few.sentence
    assert "Implicit steps are" in many.sentence
    assert few.implicit.seconds > few.implicit.setup > 0.0
    assert few.implicit.memory > few.explicit.memory > 0.0


def test_what_only_explicit_steps_can_do():
    forecast = forecast_solvers(scene(dynamics={"duration": 1e-3, "kinematics": "finite"}), 48, 10, 1000)
    assert forecast.sentence == "Only the explicit solver supports finite rotations (dynamics.kinematics)."
    layers = {"joint": {"material": "SAC305", "thickness": 1e-3, "cells": 2}}
    forecast = forecast_solvers(scene(structure=structure_tables_of()["structure"] | {"layers": layers}), 48, 10, 1000)
    assert forecast.only_explicit == ("plasticity (layers joint)",)


def test_plate_that_stands_for_a_package_has_its_elements():
    x, y, z = plate_nodes(12_558)
    assert (x - 1) * (y - 1) * (z - 1) == pytest.approx(12_558, rel=0.02)
