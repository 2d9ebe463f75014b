"""Equilibrium of solder and structure: collapse height, self-alignment, moments and warped packages."""

from types import SimpleNamespace

import numpy as np
import pytest

from reflowshock.fem.problem.thermal import KELVIN, Thermal
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.reference.young_laplace import joint_meridian
from reflowshock.particles.scenes.carried_joint import stiffness_estimate
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.reflow.coupling import Coupling, NotInBalance, floating_height, place_joints, scale_of, start
from reflowshock.workflow.reflow.forecast import LoadStep, load_steps
from tests.support.reflow_structures import NAMES, Bow, joints_here, rigid_modes
from tests.support.workflow_command import SMALL_CASE

RADIUS, GAMMA, BALL, GAP = 0.24e-3, 0.4985, 0.0724e-9, 0.33e-3
SOLDER = Solder(volume=BALL, numerics=SolderNumerics(spacing=7e-5, time_step_limit=100), effects={"gravity": "off"})
SQUARE = np.array([(x, y, 0.0) for x in (-1e-3, 1e-3) for y in (-1e-3, 1e-3)])
PULL = np.pi * RADIUS * GAMMA


def coupled(folder, structure, steps=(300.0,), *, rigid=0.0, bends=True, fail=None, solder=SOLDER):  # noqa: PLR0913
    """Return the equilibrium of solder and structure at each step, computed in a folder."""
    centres, modes = structure.centres, structure.rigid_modes
    drawn = {f"J{number}": JointGeometry(GAP, RADIUS, RADIUS) for number in range(len(centres))}
    geometries = list(drawn.values())
    state = start(geometries, solder, modes)
    state.rigid = state.rigid + rigid
    joints, seen = joints_here(solder, folder, fail), []
    scale = scale_of(geometries, solder, modes, 1e-3)
    coupling = Coupling(structure, joints, drawn, scale, bends, lambda _: None, seen.append)
    coupling.run(state, [LoadStep(temperature, 0.0) for temperature in steps])
    return SimpleNamespace(
        state=state, joints=joints, places=place_joints(drawn, state.state.pad_motion), seen=seen, scale=scale
    )


def exact_height(load):
    """Return the gap at which a joint carries a load [N], by Young-Laplace [m]."""

    def force(gap):
        return joint_meridian(BALL, RADIUS, RADIUS, gap, GAMMA).axial_force

    gaps = np.linspace(0.28e-3, 0.36e-3, 41)
    return float(np.interp(-load, [-force(gap) for gap in gaps], gaps))


@pytest.mark.parametrize("count", [pytest.param(1, marks=pytest.mark.long), 4])
def test_rigid_package_on_joints_has_the_height_of_one_joint(tmp_path, count):
    """Four identical joints share one reflow and carry four times the weight at the same height."""
    load = 5e-5
    structure = Bow(SQUARE[:count], rigid_modes(SQUARE[:count], ("z",), count * load))
    fine = SOLDER.model_copy(update={"numerics": SolderNumerics(spacing=5e-5, time_step_limit=100)})
    reflow = coupled(tmp_path, structure, solder=fine)
    assert len(reflow.joints.groups) == 1
    assert reflow.places["J0"].gap == pytest.approx(exact_height(load), rel=5e-3)
    assert reflow.seen[-1].residual <= 1e-3
    assert reflow.state.wrenches[:, 1, 2].sum() == pytest.approx(count * load, abs=1e-3 * count * PULL)
    assert floating_height(JointGeometry(GAP, RADIUS, RADIUS), SOLDER, load) == pytest.approx(
        exact_height(load), rel=1e-4
    )


@pytest.mark.long
def test_joints_with_inertia_carry_a_package_at_the_default_height(tmp_path):
    """With the scheme ispg each exchange ends at rest with the same height and forces that balance the weight."""
    load, gaps = 5e-5, {}
    flowing = {"numerics": SolderNumerics(spacing=1e-4, scheme="ispg"), "effects": {"gravity": "off", "inertia": "on"}}
    relaxing = {"numerics": SolderNumerics(spacing=1e-4, time_step_limit=100), "effects": {"gravity": "off"}}
    for name, settings in {"ispg": flowing, "energy": relaxing}.items():
        structure = Bow(SQUARE, rigid_modes(SQUARE, ("z",), 4 * load))
        reflow = coupled(tmp_path / name, structure, solder=Solder(volume=BALL, **settings))
        assert reflow.seen[-1].residual <= 1e-3
        assert reflow.state.wrenches[:, 1, 2].sum() == pytest.approx(4 * load, abs=4e-3 * PULL)
        shape = reflow.joints.shapes()["J0"]
        assert shape.metrics["at_rest"][0] == 1.0 and abs(shape.metrics["volume_drift"][0]) < 1e-9
        gaps[name] = reflow.places["J0"].gap
    assert abs(shape.metrics.get("energy_imbalance", (0.0, ""))[0]) < 1e-6
    assert gaps["ispg"] == pytest.approx(gaps["energy"], rel=5e-4)


@pytest.mark.long
def test_a_package_that_starts_tilted_and_shifted_levels_and_centres_itself(tmp_path):
    """Rigid-body modes start at 0.2 radii of shift and one degree of tilt and twist; one micrometre remains."""
    structure = Bow(SQUARE, rigid_modes(SQUARE, NAMES, 8e-5))
    reflow = coupled(tmp_path, structure, rigid=np.array([5e-5, -3e-5, 0.0, 0.01, -0.015, 0.02]))
    shift, turn = reflow.state.rigid[:2], reflow.state.rigid[3:]
    assert abs(shift).max() < 1e-6 and 1e-3 * abs(turn).max() < 1e-6
    assert np.ptp([joint.gap for joint in reflow.places.values()]) < 3e-6
    assert reflow.state.rigid[2] + GAP == pytest.approx(exact_height(2e-5), rel=5e-3)


@pytest.mark.long
def test_weight_off_the_centre_tilts_the_package_towards_it(tmp_path):
    """Moments balance about both axes; the axial joint stiffness predicts the tilt to some per cent."""
    weight, at = 4e-4, (0.3e-3, 0.1e-3)
    structure = Bow(SQUARE, rigid_modes(SQUARE, NAMES, weight, at))
    reflow = coupled(tmp_path, structure)
    forces = reflow.state.wrenches[:, 1]
    centres = SQUARE + reflow.state.state.pad_motion[:, 1, :3]
    moment = np.cross(centres, forces[:, :3]).sum(axis=0) + forces[:, 3:].sum(axis=0)
    assert forces[:, 2].sum() == pytest.approx(weight, abs=4e-3 * PULL)
    assert moment[:2] == pytest.approx((at[1] * weight, -at[0] * weight), abs=6e-3 * PULL * 1e-3)
    stiffness = -stiffness_estimate(next(iter(reflow.places.values())), SOLDER)[2, 2]
    lean = weight * np.array([-at[1], at[0]]) / (4.0 * stiffness * 1e-6)
    assert reflow.state.rigid[3:5] == pytest.approx(lean, rel=0.2)
    gaps = np.array([joint.gap for joint in reflow.places.values()])
    assert gaps.argmin() == 3 and gaps.argmax() == 0  # J3 is at +x, +y


def test_a_package_that_bows_has_one_joint_at_four_corners(tmp_path):
    """One-way standoffs equal the structure; two-way standoffs differ by force times compliance."""
    steps, bow = (300.0, 350.0, 400.0), 20e-6 / 2e-6 / 100.0
    runs = {}
    for bends in (True, False):
        structure = Bow(SQUARE, rigid_modes(SQUARE, (), 0.0), bow, compliance=5e-3)
        runs[bends] = coupled(tmp_path / str(bends), structure, steps, bends=bends)
        assert len(runs[bends].joints.groups) == 1
    one_way, both = runs[False], runs[True]
    assert one_way.places["J2"].gap == pytest.approx(GAP + 20e-6, rel=1e-12)
    assert one_way.places["J3"].tilt == pytest.approx((0.02, -0.02), rel=1e-3)
    assert [exchange.load_step for exchange in one_way.seen] == [0, 1, 2]
    last = {exchange.load_step: exchange for exchange in both.seen}
    assert len(last) == 3 and all(exchange.force_residual <= 1e-3 for exchange in last.values())
    pulled = both.places["J2"].gap - one_way.places["J2"].gap
    assert pulled == pytest.approx(
        5e-3 * (both.state.wrenches[2, 1, 2] - both.state.wrenches[2, 0, 2]), abs=1e-3 * 4e-6
    )
    assert pulled < 0.0  # the solder pulls the package down


def test_a_killed_run_continues_to_the_same_bits(tmp_path):
    """Joint files contain the full state: a repeated exchange gives the same wrenches."""
    structure = Bow(SQUARE[:2], rigid_modes(SQUARE[:2], (), 0.0), bow=1e-1, compliance=5e-3)
    whole = coupled(tmp_path / "whole", structure, (300.0, 350.0))
    drawn = {name: JointGeometry(GAP, RADIUS, RADIUS) for name in ("J0", "J1")}
    with pytest.raises(KeyboardInterrupt):
        coupled(tmp_path / "parts", structure, (300.0, 350.0), fail=4)
    joints = joints_here(SOLDER, tmp_path / "parts")
    state = start(list(drawn.values()), SOLDER, structure.rigid_modes)
    Coupling(structure, joints, drawn, whole.scale, True, lambda _: None, lambda _: None).run(
        state, [LoadStep(300.0, 0.0), LoadStep(350.0, 0.0)]
    )
    assert np.array_equal(state.wrenches, whole.state.wrenches)
    assert [exchange.residual for exchange in state.exchanges] == [exchange.residual for exchange in whole.seen]


def test_missing_equilibrium_reports_load_step_and_residuals(tmp_path, monkeypatch):
    monkeypatch.setattr("reflowshock.workflow.reflow.coupling.MOST_EXCHANGES", 1)
    structure = Bow(SQUARE[:1], rigid_modes(SQUARE[:1], (), 0.0), compliance=5e-3)
    with pytest.raises(NotInBalance, match=r"load step 1 at 300\.0 K: after 1 exchanges forces still change by"):
        coupled(tmp_path, structure)


def test_load_steps_cover_the_liquid_phase():
    paper = Thermal(peak=200 + KELVIN, melting=25 + KELVIN, solidification=200 + KELVIN, steps=7)
    assert [step.temperature - KELVIN for step in load_steps(paper)] == pytest.approx(range(25, 201, 25))
    lead_free = Thermal(steps=10, package="moved", corner_displacement=-1e-4)
    steps = load_steps(lead_free)
    assert [step.temperature - KELVIN for step in steps] == pytest.approx([217, 223, 245, 223, 217])
    assert steps[2].corner == pytest.approx(-1e-4) and steps[0].corner == pytest.approx(-1e-4 * 192 / 220)


def test_a_process_too_short_for_rest_is_refused():
    with pytest.raises(CaseError, match=r"solder\.process_time.*with \[thermal\], whose load steps are at rest"):
        read_case(
            SMALL_CASE,
            ['warpage.corner="0 mm"', "thermal.steps=2", 'solder.process_time="5 ms"'],
            oversubscribe=True,
        )
