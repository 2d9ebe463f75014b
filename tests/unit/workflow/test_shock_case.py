"""The shock in a case file: all forms of its pulse, and messages for impossible ones."""

from pathlib import Path

import numpy as np
import pytest

from reflowshock.workflow.board_drop.board_deflection import decided, expected_deflection, expected_duration
from reflowshock.workflow.board_drop.duration import first_mode, longest_duration
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.convergence.packages import board_drop_study
from reflowshock.workflow.pipeline.reader import read_case
from tests.support.workflow_command import SMALL_CASE

CASES = Path(__file__).parents[3] / "cases"
PULSE = 'peak_acceleration = "1500 G"\npulse_duration = "0.02 ms"\n'


def case_with(directory: Path, pulse: str) -> Path:
    """Write the shortened case with another pulse; return the path."""
    path = directory / "case.toml"
    text = SMALL_CASE.read_text()
    assert PULSE in text
    path.write_text(text.replace(PULSE, pulse))
    return path


def test_service_condition_damping_and_method(tmp_path):
    pulse = 'service_condition = "G"\nmethod = "large_mass"\ngravity = "on"\n'
    pulse += 'damping = { stiffness_ratio = 0.01, frequency = "1 kHz" }\n'
    shock = read_case(case_with(tmp_path, pulse)).shock
    assert (shock.service_condition, shock.method, shock.gravity) == ("G", "large_mass", "on")
    assert shock.damping.coefficients[1] == pytest.approx(0.01 / (3.14159265 * 1e3))


def test_the_table_is_relative_to_the_case(tmp_path):
    (tmp_path / "drop.csv").write_text("time [ms], acceleration [G]\n0, 0\n0.25, 1500\n0.5, 0\n")
    case = read_case(case_with(tmp_path, 'table = "drop.csv"\n'))
    assert case.shock.table == str((tmp_path / "drop.csv").resolve())
    assert case.files == {"shock.table": (tmp_path / "drop.csv").resolve()}


FAULTS = {
    'service_condition = "J"\n': ["shock.service_condition", "one of A, B, C, D, E, F, G, H"],
    PULSE + 'service_condition = "B"\n': [
        "shock.peak_acceleration",
        '"1500 G"',
        "cannot be combined with shock.service_condition",
    ],
    'peak_acceleration = "1500 G"\n': ["shock.pulse_duration", "is missing"],
    "": ["shock.peak_acceleration", "is missing", "service_condition"],
    PULSE + "damping = { mass_ratio = 0.01 }\n": ["shock.damping.frequency: is missing"],
    PULSE + 'damping = { stiffness_ratio = 0.9, frequency = "1e-6 Hz" }\n': ["shock.duration", "more than 1e+10"],
    PULSE + 'damping = { stiffness_coefficient = "1e308 s" }\n': ["shock.duration", "has no explicit time step"],
    PULSE + 'method = "large_mas"\n': ["shock.method", "did you mean large_mass?"],
    PULSE.replace("0.02 ms", "10 ns"): [
        'shock.pulse_duration = "10 ns"',
        "shorter than one coupling window (75 ns)",
        "allowed: >= 75 ns",
    ],
    PULSE + 'gravity = "yes"\n': ["shock.gravity", "one of auto, on, off"],
}


@pytest.mark.parametrize("pulse", FAULTS)
def test_impossible_shock_is_said(tmp_path, pulse):
    with pytest.raises(CaseError) as error:
        read_case(case_with(tmp_path, pulse), force=True)
    text = "\n".join(str(problem) for problem in error.value.problems)
    assert [word for word in FAULTS[pulse] if word not in text] == [], text


PMIC = 'packages.pmic={{at=["{}", "0 mm"], rows={}, columns=2, pitch="1 mm", post="0.5 mm", standoff="0.3 mm"'
PMIC += ', substrate=["3 mm", "2 mm", "0.4 mm"], die=["{}", "1 mm", "0.3 mm"]}}'
FITTED = {
    PMIC.format("10 mm", 2, "2 mm").replace('"0 mm"', '"3 mm"').replace("0.5 mm", "2 mm"): ["pmic.post", "wider than"],
    PMIC.format("10 mm", 2, "4 mm").replace('"0 mm"', '"3 mm"'): ["pmic.substrate", "smaller along x than its joints"],
    PMIC.format("3 mm", 2, "2 mm").replace('"0 mm"', '"3 mm"'): ["pmic.at", "overlaps package"],
    PMIC.format("10 mm", 2, "2 mm"): ["pmic.at", "outside the meshed body"],
    PMIC.format("15 mm", 2, "2 mm").replace('"0 mm"', '"9 mm"'): ["pmic.at", "lies over a mounting hole"],
    'watch.a.at=["21 mm", "0 mm", "0 mm"]': ["watch.a.at", "lies 0.001 m outside the meshed body"],
    'watch.a={at=["0 mm", "0 mm", "0 mm"], direction=[0, 0, 0]}': ["watch.a.direction", "has no length"],
    'watch.package.at=["0 mm", "0 mm", "0 mm"]': ["watch.package", "is reserved for the results of the package"],
    'gauges.g.at=["19.5 mm", "5 mm"]': ["gauges.g.length", "outside the meshed body"],
    'gauges.g.at=["13.8 mm", "11 mm"]': ["gauges.g.length", "lies in a mounting hole"],
    'gauges.g={at=["5 mm", "5 mm"], face="top"}': ["gauges.g.face", "upper, lower"],
    'masses.m={mass="1 g", at=["16 mm", "11 mm", "0 mm"]}': ["masses.m.at", "lies in a mounting hole"],
    'supports.s={on="z_max", hold=["x"]}': ["supports.s.on", "no such facet set", "mounting_holes"],
    'supports.s.on="mounting_holes"': ["supports.s.hold", "fixes no component"],
}


@pytest.mark.parametrize("setting", FITTED)
def test_what_cannot_be_fitted_to_the_board_is_said(setting):
    with pytest.raises(CaseError) as error:
        read_case(SMALL_CASE, [setting])
    text = "\n".join(str(problem) for problem in error.value.problems)
    assert [word for word in FITTED[setting] if word not in text] == [], text


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ('shock.coupling.scheme="local_steps"', "does not support supports.screws.bedding"),
        ('shock.method="large_mass"', "needs mounting holes without supports"),
    ],
)
def test_what_does_not_go_with_elastic_screws_is_said(setting, message):
    springs = 'supports.screws={on="mounting_holes", hold=["x", "y"], bedding={z="1e11 N/m^3"}}'
    with pytest.raises(CaseError, match=message):
        read_case(SMALL_CASE, [springs, setting])
    assert read_case(SMALL_CASE, [springs]).supports["screws"].stiffness == (0.0, 0.0, 1e11)


def test_a_shock_within_one_window_is_refused():
    with pytest.raises(CaseError, match=r'shock.duration = "10 ns": is shorter than one coupling window \(75.6 ns\)'):
        read_case(SMALL_CASE, ["shock.duration=10 ns"])
    assert read_case(SMALL_CASE, ["shock.duration=10 ns", 'shock.numerics.modes=["dns"]']).shock.duration == 1e-8


@pytest.mark.parametrize(
    ("setting", "why"),
    [("shock.numerics.plasticity=on", "solder yields"), ("shock.numerics.kinematics=finite", "kinematics is finite")],
)
def test_local_steps_along_a_path_are_refused(setting, why):
    local = "shock.coupling.scheme=local_steps"
    with pytest.raises(
        CaseError, match=rf'shock.coupling.scheme = "local_steps": needs elastic .*{why}; allowed: held'
    ):
        read_case(SMALL_CASE, [local, setting])
    assert read_case(SMALL_CASE, [local]).shock.coupling.scheme == "local_steps"


def test_an_automatic_duration_is_at_most_a_period_after_the_pulse():
    case = read_case(SMALL_CASE, ["shock.duration=auto"])
    period = 2.0 * np.pi / expected_deflection(case).omega
    assert longest_duration(case) == pytest.approx(case.shock.pulse_duration + period)
    assert decided(case).shock.duration == longest_duration(case)
    with pytest.raises(ValueError, match="case must decide it"):
        _ = case.shock.decided_duration
    explicit = read_case(SMALL_CASE, ["shock.duration=0.2 ms"])
    assert longest_duration(explicit) == explicit.shock.decided_duration == 2e-4


@pytest.mark.parametrize(("kinematics", "measured"), [("corotational", 2.05e-3), ("small", 3.05e-3)])
def test_expected_duration_agrees_with_the_default_case(kinematics, measured):
    """Duration at which its run ended, see cases/jedec_bga/README.md."""
    case = read_case(CASES / "jedec_bga" / "case.toml", [f"shock.numerics.kinematics={kinematics}"])
    assert expected_duration(case) == pytest.approx(measured, rel=0.1)
    assert expected_duration(case) < longest_duration(case)
    explicit = read_case(SMALL_CASE, ["shock.duration=0.2 ms"])
    assert expected_duration(explicit) == 2e-4


def test_what_is_fitted_to_the_board_makes_it_slower():
    bare, pmic = read_case(SMALL_CASE, ["masses={}"]), PMIC.format("10 mm", 2, "2 mm").replace('"0 mm"', '"3 mm"')
    heavy = read_case(SMALL_CASE, ["masses={}", pmic])
    substrate, die = heavy.materials.substrate.density, heavy.materials.die.density
    mass = 4.0 * (4 * 0.25e-6 * 0.3e-3 * heavy.materials.solder.density + 2.4e-9 * substrate + 0.6e-9 * die)
    share = 2.0 * mass / (40e-3 * 30e-3 * 1e-3 * bare.materials.board.density)
    assert first_mode(bare)[1] / first_mode(heavy)[1] == pytest.approx(np.sqrt(1.0 + share))


@pytest.mark.parametrize("text", ["automatic", "0 ms", "3", '"-1 ms"'])
def test_a_duration_is_a_time_or_auto(text):
    with pytest.raises(CaseError, match=r"shock.duration.*\n?.*(> 0 ms|auto)"):
        read_case(SMALL_CASE, [f"shock.duration={text}"])


def test_meshes_are_compared_over_the_same_time():
    case = read_case(SMALL_CASE, ["shock.duration=auto"])
    runs = board_drop_study(case).runs
    assert {run.settings["shock.duration"] for run in runs} == {f"{1e3 * longest_duration(case):.6g} ms"}
    assert "shock.duration" not in board_drop_study(read_case(SMALL_CASE)).runs[0].settings
