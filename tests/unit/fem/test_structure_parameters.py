"""Parameters of a structure: errors name key, value, range and nearest name."""

import pytest

from reflowshock.fem.problem.structure import StructureProblem
from reflowshock.fem.problem.structure_checks import check, problems

TIN = {"kind": "isotropic", "density": 7400.0, "young_modulus": 50e9, "poisson_ratio": 0.36}
HELD = {"on": "mounting_holes", "hold": ["x", "y", "z"]}
POKE = {"kind": "point_force", "at": [0.02, 0.0, 1e-3], "direction": [0.0, 0.0, -1.0], "table": "force.csv"}
SHAKEN = {"kind": "input_g", "service_condition": "B", "method": "large_mass"}
YIELDING = TIN | {"plasticity": {"A": 40e6}}


def scene(**changes) -> StructureProblem:
    """Return a dropped board fixed at its holes; ``changes`` replace its tables."""
    board = {"material": "FR4", "thickness": 1e-3, "cells": 2}
    tables = {
        "structure": {
            "length": 0.132,
            "width": 0.077,
            "cells": [8, 6],
            "layers": {"board": board},
            "symmetry": ["x"],
            "holes": {"spacing": [0.105, 0.071], "diameter": 3e-3},
        },
        "supports": {"holes": {"on": "mounting_holes", "hold": ["x", "y", "z"]}},
        "loads": {"drop": {"kind": "input_g", "service_condition": "B"}},
        "watch": {"centre": {"at": [0.0, 0.0, 0.0]}},
        "dynamics": {"duration": 2e-3},
    }
    return StructureProblem.model_validate(tables | changes)


def layered(material: str, **more) -> dict:
    """Return the table ``structure`` with one layer of a material."""
    layers = {"board": {"material": material, "thickness": 1e-3}}
    return {"length": 0.1, "width": 0.05, "cells": [8, 6], "layers": layers} | more


def test_a_good_scene_has_no_problem_and_survives_its_json():
    good = scene()
    assert not problems(good)
    assert StructureProblem.model_validate_json(good.model_dump_json()) == good
    assert good.structure.corners == ((0.0, -0.0385, 0.0), (0.066, 0.0385, 1e-3))


def test_own_materials_go_before_those_of_the_library():
    overridden = scene(materials={"FR4": TIN}, structure=layered("FR4"), supports={})
    assert overridden.layer_materials["board"].density == 7400.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"structure": layered("FR5"), "supports": {}}, "structure.layers.board.material = FR5: no such material"),
        ({"structure": layered("FR5"), "supports": {}}, "did you mean FR4?"),
        ({"structure": layered("FR4") | {"layers": {}}, "supports": {}}, "structure.layers: the structure has no"),
        (
            {"structure": layered("FR4", element="tetrahedron", formulation="one_point"), "supports": {}},
            "structure.formulation = one_point: applies to hexahedra",
        ),
        ({"supports": {"foot": {"on": "zmin", "hold": ["x"]}}}, "supports.foot.on = zmin: no such facet set"),
        ({"supports": {"foot": {"on": "zmin", "hold": ["x"]}}}, "did you mean z_min?"),
        ({"supports": {"foot": {"on": "z_min", "hold": []}}}, "supports.foot.hold = []: fixes no component"),
        ({"loads": {"push": {"kind": "pressure", "on": "top", "peak": 1e6}}}, "loads.push.on = top"),
        ({"loads": {"push": {"kind": "pressure", "on": "z_max", "peak": 1e6}}}, "loads.push.duration: is missing"),
        ({"loads": {"drop": {"kind": "input_g"}}}, "loads.drop: is given by nothing; allowed: exactly one of"),
        (
            {"loads": {"drop": {"kind": "input_g", "peak": 1e4, "service_condition": "B"}}},
            "loads.drop: is given by service_condition and peak",
        ),
        (
            {"loads": {"drop": {"kind": "input_g", "service_condition": "B", "duration": 1e-3}}},
            "loads.drop.duration = 0.001 s: is already given by service_condition",
        ),
        (
            {"loads": {"fall": {"kind": "gravity", "direction": [0.0, 0.0, 0.0]}}},
            "loads.fall.direction = [0.0, 0.0, 0.0]: has no length",
        ),
        (
            {"loads": {"poke": POKE | {"at": [0.02, 0.0, 2e-3]}}},
            "loads.poke.at = (0.02, 0, 0.002) m: lies 0.001 m outside the meshed body; its nearest point is"
            " (0.02, 0, 0.001) m",
        ),
        (
            {"loads": {"poke": POKE | {"at": [0.0525, -0.0345, 0.0]}}},
            "loads.poke.at = (0.0525, -0.0345, 0) m: lies in a mounting hole, 0.001 m from its axis; allowed:",
        ),
        ({"loads": {"poke": POKE | {"direction": [0.0, 0.0, 0.0]}}}, "direction = [0.0, 0.0, 0.0]: has no length"),
        (
            {"loads": {"poke": POKE | {"at": [0.0, 0.0, 0.0], "direction": [1.0, 0.0, 1.0]}}},
            "loads.poke.direction = [1.0, 0.0, 1.0]: crosses the plane of symmetry x = 0",
        ),
        ({"loads": {"poke": POKE | {"peak": 10.0}}}, "loads.poke: is given by peak and table"),
        (
            {"supports": {}, "loads": {"drop": SHAKEN}},
            "loads.drop.method = large_mass: needs a support",
        ),
        (
            {"supports": {"foot": {"on": "z_min", "hold": ["z"]}}, "loads": {"drop": SHAKEN}},
            "loads.drop.method = large_mass: needs a support that it can move: one that holds x, y, z",
        ),
        (
            {"supports": {"holes": HELD, "foot": {"on": "z_min", "hold": ["z"]}}, "loads": {"drop": SHAKEN}},
            "supports.foot.hold = [z]: would stay in place along z while the large mass of loads.drop moves",
        ),
        ({"loads": {"drop": SHAKEN, "again": SHAKEN}}, "again.method = large_mass: is already the method of loads."),
        (
            {"loads": {"drop": SHAKEN}, "dynamics": {"duration": 1e-3, "initial_velocity": [0.0, 0.0, 1.0]}},
            "loads.drop.method = large_mass: cannot be combined with initial_velocity",
        ),
        (
            {"loads": {"drop": SHAKEN, "pull": {"kind": "motion", "on": "x_max", "component": "z", "table": "v.csv"}}},
            "loads.drop.method = large_mass: cannot be combined with loads.pull",
        ),
        (
            {"loads": {"drop": {"kind": "input_g", "service_condition": "B", "direction": [1.0, 0.0, 1.0]}}},
            "loads.drop.direction = [1.0, 0.0, 1.0]: crosses the plane of symmetry x = 0",
        ),
        (
            {"dynamics": {"duration": 1e-3, "initial_velocity": [1.0, 0.0, 0.0]}},
            "dynamics.initial_velocity = [1.0, 0.0, 0.0]: crosses the plane of symmetry x = 0",
        ),
        (
            {"loads": {"push": {"kind": "pressure", "on": "x_min", "table": "p.csv"}}},
            "loads.push.on = x_min: is a plane of symmetry inside the body; allowed: x_max",
        ),
        (
            {"loads": {"pull": {"kind": "motion", "on": "mounting_holes", "component": "z", "table": "v.csv"}}},
            "loads.pull.component = z: is held by supports.holes",
        ),
        (
            {"loads": {name: {"kind": "motion", "on": "z_max", "component": "z", "table": "v.csv"} for name in "ab"}},
            "loads.b.component = z: is moved by loads.a on the same facet set",
        ),
        (
            {"loads": {"pull": {"kind": "motion", "on": "z_max", "component": "z", "table": "v.csv"}}},
            "loads.pull.component = z: is held by supports.holes where mounting_holes and z_max meet",
        ),
        (
            {"loads": {"pull": {"kind": "motion", "on": "y_max", "component": "x", "table": "v.csv"}}},
            "loads.pull.component = x: is held by a plane of symmetry where x_min and y_max meet",
        ),
        (
            {"supports": {"end": {"on": "y_max", "hold": ["x", "y", "z"]}}}
            | {"loads": {"drop": {"kind": "input_g", "service_condition": "B", "method": "large_mass"}}},
            "cannot move supports.end: a plane of symmetry fixes nodes of it in space where x_min and y_max meet",
        ),
        ({"loads": {}}, "loads: nothing moves the structure"),
        (
            {"watch": {"centre": {"at": [0.0, 0.0, 4e-3]}}},
            "watch.centre.at = (0, 0, 0.004) m: lies 0.003 m outside the meshed body; its nearest point is"
            " (0, 0, 0.001) m",
        ),
        ({"watch": {"left": {"at": [-0.01, 0.0, 0.0]}}}, "allowed: (0, -0.0385, 0) m to (0.066, 0.0385, 0.001) m"),
        (
            {"materials": {"tin": YIELDING}, "structure": layered("tin"), "supports": {}}
            | {"dynamics": {"duration": 1e-3, "solver": "both"}},
            "structure.layers.board.material = tin: yields, but the solver both is linear",
        ),
        ({"dynamics": {"duration": 1e-3, "solver": "implicit", "kinematics": "finite"}}, "dynamics.kinematics = fin"),
        ({"dynamics": {"duration": 1e-3, "damping": {"mass_ratio": 0.01}}}, "dynamics.damping.frequency: is missing"),
        (
            {"dynamics": {"duration": 1e-3, "kinematics": "finite", "damping": {"stiffness_coefficient": 1e-9}}},
            "dynamics.damping.stiffness_coefficient: needs a constant stiffness, but dynamics.kinematics = finite",
        ),
        ({"dynamics": {"duration": 1e-3, "numerics": {"mass_scaled": ["copper"]}}}, "mass_scaled = copper: no such"),
        ({"dynamics": {"duration": 1e-3, "numerics": {"mass_scaled": ["board"]}}}, "leaves no layer that defines"),
        ({"dynamics": {"duration": 1e-3, "solver": "both", "numerics": {"mass_scaled": ["board"]}}}, "to explicit"),
        ({"dynamics": {"duration": 1e-5, "numerics": {"implicit_step": 1e-3}}}, "implicit_step = 0.001 s: is too long"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_said(changes, message):
    with pytest.raises(ValueError) as error:
        check(scene(**changes))
    assert message in str(error.value).replace(chr(34), "")  # values as TOML writes them


def test_large_mass_with_supports_across_its_direction():
    supports = {"holes": HELD, "rail": {"on": "y_min", "hold": ["y"]}}
    assert not problems(scene(supports=supports, loads={"drop": SHAKEN, "weight": {"kind": "gravity"}}))


def test_a_force_beside_a_plane_of_symmetry_may_point_anywhere():
    """Its mirror image acts as well; holes end at the symmetry walls."""
    at_wall = POKE | {"at": [0.0525, -0.037, 0.0]}
    assert not problems(scene(loads={"poke": POKE | {"direction": [1.0, 0.0, 0.0]}, "at_wall": at_wall}))


def test_gravity_needs_neither_peak_nor_duration():
    assert not problems(scene(loads={"weight": {"kind": "gravity"}}))
