"""Arithmetic of a run: materials, steps, comparison, energy balance, watch points."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid

from reflowshock.cases.hard.trials.grids import COPPER as PAD
from reflowshock.fem.dynamics.energy_balance import SUMS, EnergyBalance
from reflowshock.fem.elements.stress import principal_strain, von_mises
from reflowshock.fem.errors import EnergyError
from reflowshock.fem.estimates.estimate import (
    BOARD_ADVANTAGE,
    UPDATES_PER_SECOND,
    implicit_plan,
    largest_implicit_step,
    predict_seconds,
    window_plan,
)
from reflowshock.fem.loads.load import half_sine_drop
from reflowshock.fem.mesh.mesh import append
from reflowshock.fem.mesh.watch_table import centre_nodes, whole_watch
from reflowshock.fem.output.compare import compare_histories
from reflowshock.fem.problem.shock import Ranks
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import COPPER, FR4, SILICON
from reflowshock.materials.parameters import Isotropic, Orthotropic
from reflowshock.materials.roles import ELASTIC, material_of_part, role_of_part
from tests.support.fem_models import BOARD_Z, small_assembly


def test_isotropic_matrix_has_lame_constants():
    matrix = elasticity_matrix(Isotropic(density=1.0, young_modulus=2.6, poisson_ratio=0.3))
    assert matrix[3, 3] == pytest.approx(1.0)
    assert matrix[0, 1] == pytest.approx(2.6 * 0.3 / (1.3 * 0.4))


def test_laminate_with_equal_constants_is_isotropic():
    young, poisson = COPPER.young_modulus, COPPER.poisson_ratio
    shear = young / (2 * (1 + poisson))
    laminate = Orthotropic(
        density=1.0,
        young_modulus_in_plane=young,
        young_modulus_out_of_plane=young,
        poisson_ratio_in_plane=poisson,
        poisson_ratio_out_of_plane=poisson,
        shear_modulus_in_plane=shear,
        shear_modulus_out_of_plane=shear,
    )
    assert np.allclose(elasticity_matrix(laminate), elasticity_matrix(COPPER), rtol=1e-12)


def test_laminate_contracts_as_its_ratios_say():
    compliance = np.linalg.inv(elasticity_matrix(FR4))
    assert -compliance[2, 0] / compliance[0, 0] == pytest.approx(0.39)
    assert -compliance[1, 0] / compliance[0, 0] == pytest.approx(0.11)


def test_impossible_laminate_is_refused():
    with pytest.raises(ValueError, match="must be > 0"):
        elasticity_matrix(FR4.model_copy(update={"poisson_ratio_out_of_plane": 1.9}))


def test_silicon_wave_speed():
    # sqrt(E (1 - nu) / ((1 + nu)(1 - 2 nu) rho)), by hand
    assert np.sqrt(elasticity_matrix(SILICON)[0, 0] / SILICON.density) == pytest.approx(8525.0, rel=1e-3)


@pytest.mark.parametrize(("part", "role"), [("solder@A10", "solder"), ("copper_board@A1", "copper"), ("die", "die")])
def test_role_of_a_part(part, role):
    assert role_of_part(part) == role


def test_part_without_a_material_is_an_error():
    with pytest.raises(ValueError, match="role 'glue'"):
        material_of_part("glue_layer@A1", ELASTIC)


def test_window_is_below_both_limits_and_divides_the_duration():
    plan = window_plan(8.4e-8, 1.1e-8, 0.9, 1.5e-3, 600)
    assert plan.window <= 0.9 * 8.4e-8
    assert plan.step <= 0.9 * 1.1e-8
    assert plan.windows * plan.window == pytest.approx(1.5e-3, rel=1e-12)
    assert 600 <= plan.windows / plan.stride < 1200
    assert plan.windows % plan.stride == 0


def test_runs_of_other_steps_are_sampled_at_the_same_times():
    for step in (8.4e-8, 8.55e-8, 6.0e-8):
        plan = window_plan(step, 1.1e-8, 0.9, 1.5e-3, 600)
        assert plan.windows == 600 * plan.stride
        assert plan.window <= 0.9 * step
    assert window_plan(8.4e-8, 1.1e-8, 0.9, 1e-6, 600).stride == 1


def test_implicit_steps_have_the_samples_of_the_windows():
    plan = window_plan(8.4e-8, 1.1e-8, 0.9, 1.5e-3, 600)
    implicit = implicit_plan(plan, 1e-6)
    assert implicit.window == pytest.approx(plan.stride * plan.window, rel=1e-12)
    assert implicit.windows * implicit.window == pytest.approx(1.5e-3, rel=1e-12)
    assert 0.5e-6 < implicit.step <= 1e-6


def test_implicit_step_follows_the_shortest_pulse():
    assert largest_implicit_step(1e-3, []) == pytest.approx(1e-6)
    assert largest_implicit_step(1e-3, [4e-6, 1.0]) == pytest.approx(2e-8)


def test_prediction_of_equal_ranks():
    plan = window_plan(1.0, 0.1, 1.0, 100.0, 10)
    board, joints = 0.1 * UPDATES_PER_SECOND, 0.01 * UPDATES_PER_SECOND  # updates in this time
    ranks = Ranks(total=2, placement="disjoint", macro=1)
    two_scale, dns = predict_seconds(board * BOARD_ADVANTAGE, [(joints, 10)], plan, ranks, at_once=True)
    assert two_scale == pytest.approx(100 * 0.1, rel=0.01)
    assert dns == pytest.approx(100 * 0.55, rel=0.01)


def test_half_sine_changes_the_velocity_by_two_a_tau_over_pi():
    load = half_sine_drop(14709.975, 5e-4)
    assert load.pulse.integral(1.0) == pytest.approx(4.682, abs=1e-3)  # 1500 G, 0.5 ms: a drop from 1.12 m
    times = np.linspace(0, 5e-4, 2001)
    values = [load.pulse.value(time) for time in times]
    assert trapezoid(values, times) == pytest.approx(load.pulse.integral(1.0), rel=1e-6)
    assert load.acceleration(2.5e-4).tolist() == [0.0, 0.0, 14709.975]


def test_energy_balance_stops_a_run_that_does_not_balance():
    sums = np.zeros(SUMS)
    sums[[0, 1, 5]] = 1.0, 1.0, 2.1
    balance = EnergyBalance(limit=0.02, trivial=0.1)
    with pytest.raises(EnergyError, match=r"energy balance -1\.000e-01 J at time 1\.000000e-03 s"):
        balance.judge(sums, 1e-3)
    EnergyBalance(limit=0.02, trivial=10.0).judge(sums, 1e-3)
    sums[0] = np.nan
    with pytest.raises(EnergyError, match="not finite"):
        balance.judge(sums, 1e-3)


def test_von_mises_of_simple_states():
    states = np.array([[3.0, 0, 0, 0, 0, 0], [1.0, 1, 1, 0, 0, 0], [0, 0, 0, 1.0, 0, 0]])
    assert von_mises(states) == pytest.approx([3.0, 0.0, np.sqrt(3.0)])


def test_principal_strain_of_pure_shear():
    corners = np.array([[[0.0, 0], [2, 0], [2, 1], [0, 1]]])
    shear = corners[:, :, ::-1] * 1e-3
    largest, smallest = principal_strain(corners, shear)
    assert (largest[0], smallest[0]) == pytest.approx((1e-3, -1e-3))


def write_history(path: Path, scale: float, joints: tuple[str, ...] = ("A1", "A2")) -> Path:
    """Write a synthetic history of some joints, scaled; return the path."""
    time = np.linspace(0, 1, 11)
    base = scale * np.sin(time)[:, None]
    np.savez(
        path,
        time=time,
        joints=np.array(joints),
        die_centre=base * [0, 0, 1],
        board_centre=base * [0, 0, 2],
        board_strain=base[:, 0],
        von_mises_board=base * [1, 3],
        von_mises_package=base * [2, 1],
        peel_board=base * [1, 2],
        peel_package=base * [1, 1],
    )
    return path


def test_comparison_is_relative_to_the_dns(tmp_path):
    ours, reference = write_history(tmp_path / "a.npz", 1.1), write_history(tmp_path / "b.npz", 1.0)
    comparison = compare_histories(ours, reference)
    assert comparison["critical_joint"] == "A2"
    for name in (
        "critical_joint_stress",
        "critical_joint_peel",
        "die_displacement",
        "board_displacement",
        "worst_joint_stress",
    ):
        assert comparison[f"{name}_error"] == pytest.approx(0.1)


@pytest.mark.parametrize(("fine", "coarse", "worst"), [(("A2",), 0.0, 0.1), (("A1",), 1.0, 0.1)])
def test_comparison_says_whether_the_critical_joint_is_fine(tmp_path, fine, coarse, worst):
    ours, reference = write_history(tmp_path / "a.npz", 1.1), write_history(tmp_path / "b.npz", 1.0)
    comparison = compare_histories(ours, reference, fine)
    assert comparison["critical_joint"] == "A2"
    assert comparison["critical_joint_coarse"] == coarse
    assert comparison["worst_joint_stress_error"] == pytest.approx(worst)


def test_comparison_of_different_joints_is_an_error(tmp_path):
    other = write_history(tmp_path / "b.npz", 1.0, ("A1", "B2"))
    with pytest.raises(ValueError, match="different sample times or joints"):
        compare_histories(write_history(tmp_path / "a.npz", 1.0), other)


def test_watch_table_of_the_small_assembly():
    mesh = append(small_assembly())
    centres = centre_nodes(mesh)
    assert mesh.points[centres[0]] == pytest.approx([0, 0, -BOARD_Z])
    assert mesh.points[centres[1], :2] == pytest.approx([0, 0])
    table = whole_watch(mesh, 25e-6)
    assert set(table.joints) == {"A2", "A3", "B2", "B3"}
    assert len(table.layer.cells) == len(table.faces.cells) == 4 * 2 * 9
    assert table.layer.volume == pytest.approx(25e-6 * 0.4e-3**2)
    assert table.faces.area == pytest.approx(0.4e-3**2)
    assert table.faces.centre[:4, 2] == pytest.approx(PAD)
    assert len(table.strain_facets) == 7 * 7
    assert (table.strain_cells >= 0).all()
