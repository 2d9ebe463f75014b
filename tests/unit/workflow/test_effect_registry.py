"""The registry of effects, and what plans tell of scenes that differ in one effect: on or off, influence, cost."""

from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console
from typer.testing import CliRunner

from reflowshock.fem.estimates.drop_effects import (
    NEGLIGIBLE_STIFFENING,
    STIFFENING_BOUND,
    STIFFENING_OF_BOARD,
    called_for,
    stiffened,
)
from reflowshock.fem.problem.load_kinds import KINDS
from reflowshock.workflow.board_drop.board_deflection import decided
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.cli import app
from reflowshock.workflow.effects.page import effects_table
from reflowshock.workflow.effects.registry import effect_of, registry
from reflowshock.workflow.effects.table import cost_shares, per_cent, read_measured_ratios
from reflowshock.workflow.kinds import kind_of
from reflowshock.workflow.pipeline.reader import read_case
from tests.support.workflow_command import SMALL_CASE

CASES = Path(__file__).parents[3] / "cases"
FILES = [*sorted(CASES.glob("*/case.toml")), SMALL_CASE]
LOADS = {"input_g", "initial_velocity", *(kind.effect for kind in KINDS)}
METHOD = {*LOADS, "hourglass_stiffness"}  # and the formulation
SLOW = "shock.peak_acceleration=2 G"
HEATED = CASES / "hu_bga_drop/case.toml"
DROP = CASES / "sessile_drop/case.toml"
# Scene, setting of the one, of the other: effect that is on in the first and off in the second.
SCENES = {
    "gravity": (DROP, "gravity=on", "gravity=off"),
    "flexible": (HEATED, "thermal.effects.flexible=on", "thermal.effects.flexible=off"),
    "residual_stress": (HEATED, "thermal.effects.residual_stress=on", "thermal.effects.residual_stress=off"),
    "plasticity": (SMALL_CASE, "shock.numerics.plasticity=on", "shock.gravity=auto"),
    "damping": (SMALL_CASE, "shock.damping.mass_coefficient=100 Hz", "shock.damping.estimate=off"),
    "one_way": (SMALL_CASE, "shock.coupling.direction=one_way", "shock.coupling.direction=two_way"),
    "finite_rotation": (SMALL_CASE, "shock.numerics.kinematics=finite", "shock.numerics.kinematics=small"),
    "gravity_in_the_shock": (SMALL_CASE, "shock.peak_acceleration=100 G", "shock.peak_acceleration=1500 G"),
}


def printed(case) -> list[str]:
    """Return the lines of the table of effects of a case."""
    console = Console(width=100, record=True, file=StringIO())
    console.print(effects_table(case, kind_of(case).forecast(case).effects, "scene"))
    return console.export_text().splitlines()


@pytest.mark.parametrize("name", SCENES)
def test_a_plan_distinguishes_scenes(name):
    path, *settings = SCENES[name]
    lines = []
    for setting in settings:
        row = next(
            line for line in printed(read_case(path, [setting], True)) if line.startswith(name.replace("_", " "))
        )
        lines.append([cell.strip() for cell in row.split("│")])
    (acting, left_out) = lines
    assert (acting[1], left_out[1]) == ("on", "off")
    assert left_out[3] == "–" or left_out[3].startswith("(")
    assert not acting[3].startswith("(")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.parent.name)
def test_every_effect_of_a_plan_is_in_the_registry(path):
    case = read_case(path, (), True)
    effects = kind_of(case).forecast(case).effects
    unknown = {name for name in effects if effect_of(name, "reflow" in case.pipeline.names) is None}
    assert unknown <= METHOD
    assert all(decision.get("influence", 0.0) >= 0.0 for decision in effects.values())


def test_what_yields_turns_or_is_fine_costs_and_what_is_coarse_saves():
    case = read_case(CASES / "bga_drop/case.toml", (), True)
    shares = cost_shares(case, kind_of(case).forecast(case).effects)
    assert shares["finite_rotation"] > 0.1 and 0.2 < shares["plasticity"] < 1.0
    assert shares["mass_scaling"] < 0.0 < shares["identical_joints"]
    assert 0.0 < shares["gravity_in_the_shock"] < 0.1
    assert set(read_measured_ratios()) - {"damping_stiffness"} <= set(registry())


def test_shares_of_what_is_on_are_of_the_whole():
    """On, an effect that costs r times the rest is the share 1 - 1 / r of the stage; off, it would add r - 1."""
    acting, left_out = (read_case(DROP, [f"gravity={switch}"], True) for switch in ("on", "off"))
    on, off = (cost_shares(case, kind_of(case).forecast(case).effects)["gravity"] for case in (acting, left_out))
    assert off == pytest.approx(read_measured_ratios()["gravity"] - 1.0)
    assert on == pytest.approx(1.0 - 1.0 / read_measured_ratios()["gravity"])


@pytest.mark.parametrize(
    ("share", "text"), [(0.0, "0 %"), (0.0013, "0.13 %"), (8.4, "840 %"), (-0.18, "-18 %"), (1e-9, "< 0.0001 %")]
)
def test_shares_have_two_digits(share, text):
    assert per_cent(share) == text


def test_stretching_is_bounded_and_grows_with_the_deflection():
    assert stiffened(0.0, STIFFENING_BOUND) == 0.0
    for ratio in (0.01, 0.1, 1.0, 10.0):
        shrunk = 1.0 - stiffened(ratio, STIFFENING_BOUND)
        assert ratio**2 == pytest.approx((shrunk * ratio) ** 2 + 0.5 * STIFFENING_BOUND * (shrunk * ratio) ** 4)
        assert stiffened(ratio, STIFFENING_OF_BOARD) < stiffened(ratio, STIFFENING_BOUND)
    assert stiffened(0.01, STIFFENING_BOUND) == pytest.approx(0.25 * STIFFENING_BOUND * 1e-4, rel=1e-3)
    for measured_change, ratio in ((1.0 - 5.0 / 7.7, 7.7), (1.0 - 4.83 / 10.94, 10.94), (1.0 - 0.949 / 1.094, 1.094)):
        assert 0.5 < measured_change / stiffened(ratio, STIFFENING_OF_BOARD) < 2.0
    assert called_for(0.05, False)[0] == "small"
    assert called_for(1.0, False)[0] == "corotational" and called_for(1.0, True)[0] == "finite"
    assert stiffened(0.1, STIFFENING_BOUND) < NEGLIGIBLE_STIFFENING < stiffened(0.15, STIFFENING_BOUND)


def test_auto_kinematics_follow_the_deflection():
    auto = "shock.numerics.kinematics=auto"
    hard, soft = (read_case(SMALL_CASE, [auto, *more], True) for more in ([], [SLOW]))
    assert decided(hard).shock.numerics.kinematics == ("corotational" if _ratio(hard) > 0.12 else "small")
    assert decided(soft).shock.numerics.kinematics == "small"
    far = read_case(CASES / "bga_drop/case.toml", [auto], True)
    assert decided(far).shock.numerics.kinematics == "corotational"
    decision = kind_of(far).forecast(far).effects["finite_rotation"]
    assert decision["on"] and "auto" in decision["why"] and decision["influence"] > 0.3
    with pytest.raises(ValueError, match="case must decide it"):
        _ = far.shock.numerics.decided_kinematics


@pytest.mark.parametrize(
    "setting",
    [
        "shock.damping.stiffness_coefficient=1 ns",
        "shock.numerics.dns_solver=implicit",
        "shock.coupling.scheme=local_steps",
    ],
)
def test_what_is_linear_does_not_go_with_auto_where_the_board_bends_far(setting):
    with pytest.raises(CaseError, match=r"shock\.(numerics\.kinematics|coupling\.scheme)"):
        read_case(CASES / "bga_drop/case.toml", ["shock.numerics.kinematics=auto", setting], True)


def _ratio(case) -> float:
    from reflowshock.workflow.board_drop.board_deflection import expected_deflection

    return expected_deflection(case).largest / case.board.thickness


def test_the_command_prints_the_registry_and_a_scene():
    runner = CliRunner()
    page = runner.invoke(app, ["effects"])
    assert page.exit_code == 0
    assert runner.invoke(app, ["effects", str(SMALL_CASE), "--set", SLOW]).exit_code == 0


@pytest.mark.parametrize("effect", registry().values(), ids=lambda effect: effect.name)
def test_entries_are_complete(effect):
    texts = (effect.adds, effect.number, effect.influence, effect.implementation, effect.switch, effect.source)
    assert all(texts)
    assert effect.stage in ("reflow", "shock", "particles") and effect.acts in ("above", "below")
