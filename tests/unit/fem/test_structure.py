"""A structure run from input to results on one rank."""

import json
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.errors import AgreedError, EnergyError
from reflowshock.fem.loads.follower_pressure import FollowerPressure
from reflowshock.fem.loads.load import NodalForces
from reflowshock.fem.loads.structure_loads import LoadedModel, structure_loads
from reflowshock.fem.loads.structure_pulses import pulses_of
from reflowshock.fem.output.compare_structures import solver_differences
from reflowshock.fem.run.program import main
from reflowshock.fem.run.structure import run_structure
from reflowshock.fem.setup.structure_models import build_structure
from tests.support.fem_structures import (
    LENGTH,
    STEEL,
    THICKNESS,
    WIDTH,
    strip_mesh,
    structure_input,
    structure_tables_of,
    write_structure,
)

GRAVITY = 9.80665


def run(directory: Path, mesh=None, **changes) -> tuple[dict, dict[str, np.ndarray]]:
    """Run a structure and return its result and history."""
    request = structure_input(directory, mesh, **changes)
    run_structure(MPI.COMM_SELF, request)
    with np.load(request.output / "history.npz") as arrays:
        return json.loads((request.output / "result.json").read_text()), dict(arrays)


def test_program_reads_its_input_and_writes_all_products(tmp_path, capsys):
    assert main(MPI.COMM_SELF, [str(write_structure(tmp_path))]) == 0
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert all(check["ok"] for check in result["health"].values())
    assert result["model"]["elements"] == 48
    assert result["effects"]["input_g"] == {"on": True, "why": "loads.drop"}
    assert not result["effects"]["plasticity"]["on"]
    assert "neglects strains of up to" in result["effects"]["finite_rotation"]["why"]
    assert result["metrics"]["peak_neglected_strain@board"]["value"] > 0.0
    assert (tmp_path / "out" / "structure.pvd").exists()
    with np.load(tmp_path / "out" / "history.npz") as history:
        assert len(history["time"]) == 41
        assert history["time"][-1] == pytest.approx(8e-5)
        assert history["displacement@tip"].shape == (41, 3)
        assert history["strain@root"].shape == (41, 6)
        assert history["load@drop"].max() == pytest.approx(1e4)
        assert np.ptp(history["kinetic"]) > 0.0
        peak = np.linalg.norm(history["displacement@tip"], axis=1).max()
    assert result["metrics"]["peak_element_stress@board"]["value"] > result["metrics"]["peak_von_mises@tip"]["value"]
    assert result["metrics"]["peak_displacement@tip"] == {"value": pytest.approx(peak), "unit": "m"}


def test_hanging_rod_at_rest(tmp_path):
    """Damped to rest under its weight along x: end displacement rho g L^2 / 2E, E eps = rho g x, reaction = weight."""
    density, young = STEEL["density"], STEEL["young_modulus"]
    sound = np.sqrt(young / density)
    mode = 2 * np.pi * sound / (4 * LENGTH)
    _, history = run(
        tmp_path,
        materials={"steel": STEEL | {"poisson_ratio": 0.0}},
        loads={"weight": {"kind": "gravity", "direction": [3.0, 0.0, 0.0]}},
        watch={"tip": {"at": [LENGTH / 2, 0.0, 0.0]}, "middle": {"at": [0.0, WIDTH / 6, THICKNESS]}},
        dynamics={
            "duration": 25 / mode,
            "damping": {"mass_ratio": 1.0 - 1e-9, "frequency": mode / (2 * np.pi)},
            "numerics": {"history_samples": 5, "field_samples": 2},
        },
    )
    force = density * GRAVITY
    assert history["displacement@tip"][-1, 0] == pytest.approx(force * LENGTH**2 / (2 * young), rel=1e-7)
    assert history["strain@middle"][-1, 0] == pytest.approx(force * LENGTH / 2 / young, rel=1e-7)
    assert history["stress@middle"][-1, 0] == pytest.approx(force * LENGTH / 2, rel=1e-7)
    assert history["reaction@clamp"][-1, 0] == pytest.approx(-force * LENGTH * WIDTH * THICKNESS, rel=1e-7)


def test_reaction_of_a_support_has_the_components_that_it_holds(tmp_path):
    """The clamp also supports z at the nodes shared with the side, which fixes only y."""
    supports = {"clamp": {"on": "x_min", "hold": ["x", "y", "z"]}, "side": {"on": "y_min", "hold": ["y"]}}
    _, history = run(tmp_path, supports=supports)
    assert np.abs(history["reaction@clamp"][:, 2]).max() > 0.0
    assert np.abs(history["reaction@side"][:, [0, 2]]).max() == 0.0


def test_rigid_flight_has_no_strain(tmp_path):
    result, history = run(
        tmp_path,
        supports={},
        loads={},
        dynamics={
            "duration": 1e-4,
            "initial_velocity": [1.0, -2.0, 0.5],
            "numerics": {"history_samples": 4, "field_samples": 2},
        },
    )
    assert np.allclose(history["displacement@tip"][-1], 1e-4 * np.array([1.0, -2.0, 0.5]), rtol=1e-12)
    assert np.allclose(history["velocity@tip"], [1.0, -2.0, 0.5], rtol=1e-12)
    assert np.abs(history["strain@tip"]).max() < 1e-12
    assert result["effects"]["initial_velocity"]["on"]


def test_layers_have_their_materials_and_mass_scaling_is_reported(tmp_path):
    """The stiff layer is scaled to the step of the soft one."""
    soft = STEEL | {"young_modulus": 2e9}
    body = structure_tables_of()["structure"]
    layers = {name: {"material": name, "thickness": THICKNESS / 2} for name in ("soft", "steel")}
    result, _ = run(
        tmp_path,
        strip_mesh(layers=("soft", "steel")),
        structure=body | {"layers": layers},
        materials={"steel": STEEL, "soft": soft},
        dynamics={
            "duration": 2e-5,
            "numerics": {"mass_scaled": ["steel"], "history_samples": 5, "field_samples": 2},
        },
    )
    critical = result["model"]["critical_steps"]
    assert critical["soft"] == pytest.approx(10 * critical["steel"], rel=1e-6)
    mass = STEEL["density"] * LENGTH * WIDTH * THICKNESS
    assert result["metrics"]["added_mass"]["value"] == pytest.approx(99 * mass / 2, rel=1e-6)
    assert not result["health"]["added_mass_fraction"]["ok"]


def test_large_mass_gives_what_direct_input_gives(tmp_path):
    """Displacements are relative to the supports, so the inertia force opposes the acceleration."""
    drop = structure_tables_of()["loads"]["drop"]
    _, direct = run(tmp_path)
    _, large = run(tmp_path, loads={"drop": drop | {"method": "large_mass"}})
    assert direct["displacement@tip"][:, 2].min() < -10 * direct["displacement@tip"][:, 2].max()
    differences = solver_differences(large, direct)
    assert differences["displacement_difference"] < 5e-3
    assert differences["strain_difference"] < 5e-3
    speed = np.abs(direct["velocity@tip"]).max()
    assert np.abs(large["velocity@tip"] - direct["velocity@tip"]).max() < 5e-3 * speed
    peak = np.abs(direct["reaction@clamp"]).max()
    assert np.abs(large["reaction@clamp"] - direct["reaction@clamp"]).max() < 5e-3 * peak


def test_both_solvers_agree_under_all_loads(tmp_path):
    drop = structure_tables_of()["loads"]["drop"]
    loads = {
        "drop": drop,
        "push": {"kind": "pressure", "on": "z_max", "peak": 1e5, "duration": 6e-5},
        "pull": {"kind": "motion", "on": "x_max", "component": "x", "peak": 0.1, "duration": 4e-5},
        "poke": {"kind": "point_force", "at": [1e-3, 1e-3, 7e-4], "direction": [1.0, 1.0, 1.0], "peak": 5.0}
        | {"duration": 5e-5},
    }
    numerics = {"history_samples": 100, "field_samples": 2, "implicit_step": 2e-7}
    changes = {"loads": loads, "dynamics": {"duration": 1e-4, "numerics": numerics}}
    _, explicit = run(tmp_path, **changes)
    result, implicit = run(tmp_path, **changes, solver="implicit")
    assert result["metrics"]["step"]["value"] == pytest.approx(2e-7)
    assert result["health"]["energy_balance_error"]["value"] < 1e-10
    assert result["metrics"]["factor_entries"]["value"] > 0
    assert result["effects"]["strain_at_surface"]["on"]
    differences = solver_differences(explicit, implicit)
    assert differences["displacement_difference"] < 1e-3
    assert differences["strain_difference"] < 5e-3
    reactions = explicit["reaction@clamp"], implicit["reaction@clamp"]
    assert np.linalg.norm(reactions[0] - reactions[1]) < 5e-3 * np.linalg.norm(reactions[1])


@pytest.mark.parametrize(("kinematics", "kind"), [("small", NodalForces), ("finite", FollowerPressure)])
def test_pressure_follows_the_surface_where_it_may_turn(tmp_path, kinematics, kind):
    loads = {"push": {"kind": "pressure", "on": "z_max", "peak": 1e5, "pulse": "constant"}}
    request = structure_input(tmp_path, loads=loads, dynamics={"duration": 1e-5, "kinematics": kinematics})
    model, _ = build_structure(MPI.COMM_SELF, request, [])
    (load,) = structure_loads(LoadedModel(MPI.COMM_SELF, model.body, model.tables, request), pulses_of(request.loads))
    assert isinstance(load, kind)


def test_implicit_solver_with_nothing_to_solve(tmp_path):
    supports = {side: {"on": side, "hold": ["x", "y", "z"]} for side in ("z_min", "z_max")}
    request = structure_input(tmp_path, strip_mesh((4, 2, 1)), supports=supports, solver="implicit")
    with pytest.raises(AgreedError, match="implicit solver: the supports fix every node"):
        run_structure(MPI.COMM_SELF, request)


def test_modes_of_a_cantilever(tmp_path):
    """The first bending frequency, (1.8751^2 / 2 pi) sqrt(E I / (rho A L^4)), lies between beam and wide plate."""
    dynamics = {"duration": 1e-5, "modes": 3, "numerics": {"history_samples": 4, "field_samples": 2}}
    result, _ = run(tmp_path, dynamics=dynamics)
    modes = json.loads((tmp_path / "out" / "modes.json").read_text())
    beam = (
        1.8751**2 / (2 * np.pi) * np.sqrt(STEEL["young_modulus"] * THICKNESS**2 / (12 * STEEL["density"] * LENGTH**4))
    )
    assert [mode["mode"] for mode in modes] == [1, 2, 3]
    assert beam < modes[0]["frequency"] < 1.05 * beam
    assert modes[0]["mass_fraction"]["z"] == pytest.approx(0.613, abs=0.02)  # beam: 4 (0.7340 / 1.8751)^2
    assert result["metrics"]["first_frequency"]["value"] == modes[0]["frequency"]
    assert (tmp_path / "out" / "modes.pvd").exists()


def test_more_modes_than_there_are_is_an_error(tmp_path):
    request = structure_input(tmp_path, dynamics={"duration": 1e-5, "modes": 200}, mesh=strip_mesh((2, 1, 1)))
    with pytest.raises(AgreedError, match=r"dynamics\.modes: number of modes = 200; allowed: 1 to"):
        run_structure(MPI.COMM_SELF, request)


def test_power_iteration_gives_a_larger_step_that_is_stable(tmp_path):
    numerics = {"critical_step": "power_iteration", "history_samples": 4, "field_samples": 2, "step_fraction": 0.99}
    result, _ = run(tmp_path, dynamics={"duration": 2e-4, "numerics": numerics})
    assert result["metrics"]["critical_step"]["value"] > 1.005 * result["model"]["critical_steps"]["board"]
    assert result["health"]["energy_balance_error"]["value"] < 1e-10


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"supports": {"clamp": {"on": "x_mni", "hold": ["x"]}}}, "did you mean x_min?"),
        ({"watch": {"tip": {"at": [1.0, 0.0, 0.0]}}}, "lies 0.99 m outside the meshed body"),
        ({"loads": {"drop": {"kind": "input_g", "table": "nowhere.csv"}}}, "nowhere.csv"),
        ({"loads": {"push": {"kind": "preassure"}}}, "preassure"),
        ({"solver": "explizit"}, "explizit"),
    ],
)
def test_bad_input_is_said_before_anything_is_computed(tmp_path, capsys, changes, message):
    assert main(MPI.COMM_SELF, [str(write_structure(tmp_path, **changes))]) == 1
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out" / "history.npz").exists()


def test_mesh_that_does_not_fit_the_layers(tmp_path):
    request = structure_input(tmp_path, strip_mesh(layers=("board", "cover")))
    with pytest.raises(AgreedError, match="parts without a layer: cover"):
        run_structure(MPI.COMM_SELF, request)


def test_mesh_of_other_elements(tmp_path):
    body = structure_tables_of()["structure"] | {"element": "tetrahedron"}
    with pytest.raises(AgreedError, match=r"structure\.element = tetrahedron has 4 nodes, the cells of the mesh .* 8"):
        run_structure(MPI.COMM_SELF, structure_input(tmp_path, structure=body))


def test_facet_set_that_the_mesh_has_not(tmp_path):
    mesh = strip_mesh()
    del mesh.facets["x_min"]
    with pytest.raises(AgreedError, match="x_min"):
        run_structure(MPI.COMM_SELF, structure_input(tmp_path, mesh))


def test_motion_of_what_is_held(tmp_path):
    pull = {"kind": "motion", "on": "z_max", "component": "y", "peak": 1.0, "pulse": "constant"}
    with pytest.raises(AgreedError, match=r"loads\.pull moves z_max along y, where .* holds 4 of its 36 nodes"):
        run_structure(MPI.COMM_SELF, structure_input(tmp_path, loads={"pull": pull}))


def test_large_mass_on_what_is_held(tmp_path):
    clamp = {"on": "x_min", "hold": ["x", "y", "z"]}
    supports = {"clamp": clamp, "rail": {"on": "y_min", "hold": ["y"]}}
    drop = structure_tables_of()["loads"]["drop"] | {"method": "large_mass"}
    request = structure_input(tmp_path, supports=supports, loads={"drop": drop})
    with pytest.raises(AgreedError, match=r"cannot move supports\.clamp: another support .* holds 3 of its 12 nodes"):
        run_structure(MPI.COMM_SELF, request)


def test_run_ends_where_energies_do_not_balance(tmp_path):
    numerics = {"history_samples": 40, "field_samples": 2, "energy_balance_limit": 1e-20}
    request = structure_input(tmp_path, dynamics={"duration": 8e-5, "numerics": numerics})
    with pytest.raises(EnergyError, match="energy_balance_limit"):
        run_structure(MPI.COMM_SELF, request)
