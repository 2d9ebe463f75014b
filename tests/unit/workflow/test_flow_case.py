"""Flows by delta-SPH: cases, forecasts and plans; refused with key, value and range where they cannot be."""

from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.fluid.forecast import flow_tables, forecast_flow, time_step
from reflowshock.workflow.fluid.report import droplet_curves
from reflowshock.workflow.kinds import kind_of
from reflowshock.workflow.pipeline.reader import read_case

CASES = Path(__file__).resolve().parents[3] / "cases"
DAM, CHANNEL, VORTICES = (CASES / name / "case.toml" for name in ("dam_break", "poiseuille", "taylor_green"))
PRINTING = CASES / "printing/case.toml"
FROZEN = CASES / "frozen_drop/case.toml"
FREE, CAP, IMPACT = (CASES / name / "case.toml" for name in ("young_laplace", "static_caps", "drop_impact"))
CARREAU = ["droplet.rheology.law=carreau", "droplet.rheology.exponent=0.5", "droplet.rheology.shear_rate=1e5 1/s"]
BAD_VALUES = {
    "no room": (DAM, "dam_break.width=3.3 m", ["dam_break.tank_length", '"3.22 m"', "> dam_break.width = 3.3 m"]),
    "thin column": (DAM, "dam_break.width=1 mm", ["dam_break.width", "less than one particle", ">= 0.01 m"]),
    "sensor in the air": (DAM, "dam_break.sensor_height=3 m", ["dam_break.sensor_height", "<= 2.4 m"]),
    "coarse": (DAM, "dam_break.numerics.particles_across=4", ["particles_across = 4", ">= 8"]),
    "slow sound": (DAM, "dam_break.numerics.sound_speed=2", ["sound_speed = 2", ">= 5"]),
    "no kernel": (
        DAM,
        "dam_break.numerics.kernel=wenland",
        ["one of cubic_spline, wendland", "did you mean wendland?"],
    ),
    "a height in seconds": (DAM, "dam_break.height=1 s", ["dam_break.height", "expected a length"]),
    "negative speed": (CHANNEL, "poiseuille.speed=-1 m/s", ["poiseuille.speed", "> 0"]),
    "turbulent": (
        CHANNEL,
        "poiseuille.speed=10 m/s",
        ["poiseuille.viscosity", "Reynolds number 1e+04", ">= 0.01 Pa*s"],
    ),
    "without viscosity": (VORTICES, "taylor_green.effects.viscosity=off", ["effects.viscosity", "auto, on"]),
    "a speed twice": (IMPACT, "droplet.weber=8", ["droplet.weber = 8", "the speed is given, too", "7.986"]),
    "a viscosity twice": (IMPACT, "droplet.reynolds=8", ["droplet.reynolds = 8", "the viscosity is given, too"]),
    "half a number": (CAP, "droplet.reynolds=8", ["says nothing without an impact", "droplet.speed or droplet.weber"]),
    "two spacings": (FREE, "droplet.numerics.spacing=2 um", ["numerics.spacing", "particles_per_diameter"]),
    "sound slower than the impact needs": (
        IMPACT,
        "droplet.numerics.sound_speed=5",
        ["droplet.numerics.sound_speed = 5", "too slow for 5 m/s", "would change by 4 %", ">= 8, 40 m/s"],
    ),
    "a cube on a wall": (CAP, "droplet.start=cube", ["droplet.start", "only a free drop", "sphere"]),
    "an angle too flat": (CAP, "droplet.contact_angle=10 deg", ["droplet.contact_angle", "30"]),
    "a length for a tension": (FREE, "droplet.surface_tension=1 m", ["droplet.surface_tension", "N/m"]),
    "a diametre": (FREE, "droplet.diametre=1 um", ["droplet.diametre", "unknown key", "diameter"]),
    "a drop of few particles": (FREE, "droplet.numerics.particles_per_diameter=4", ["particles_per_diameter", ">= 8"]),
    "no pitch": (PRINTING, "printing.pitch=-1 um", ["printing.pitch", "> 0"]),
    "drops on each other": (PRINTING, "printing.pitch=2 um", ["printing.pitch", "on each other", ">= 5.75 um"]),
    "drops in each other": (PRINTING, "printing.delay=2 us", ["printing.delay", "in the one before", ">= 7.67 us"]),
    "light on what freezes": (FROZEN, "printing.cure.dose=1 J/m^2", ["printing.cure", "drops freeze before", "off"]),
    "a warm plate": (
        FROZEN,
        "printing.freezing.substrate_temperature=190 degC",
        ["freezing.substrate_temperature", "190 degC", "freezes nothing", "< 183 degC"],
    ),
    "drops that land frozen": (
        FROZEN,
        "printing.freezing.temperature=100 degC",
        ["freezing.temperature", ">= 183 degC"],
    ),
    "a drop on a warm one": (
        FROZEN,
        ["printing.layers=2", "printing.delay=200 us"],
        ["printing.delay", "still warm", ">= 1377 us"],
    ),
    "freezing of nothing known": (
        PRINTING,
        "printing.effects.freezing=on",
        ["effects.freezing", "no [printing.freezing]"],
    ),
    "no order": (PRINTING, "printing.order=rastr", ["one of raster, serpentine, interleaved", "did you mean raster?"]),
    "a carreau bound": (
        IMPACT,
        CARREAU + ["droplet.rheology.bound=5"],
        ["rheology.bound", "says nothing", "leave it out"],
    ),
    "no rate of shear": (IMPACT, CARREAU[:2], ["droplet.rheology.shear_rate"]),
    "thicker at infinity": (
        IMPACT,
        [*CARREAU, "droplet.rheology.viscosity_at_infinity=20 mPa*s"],
        ["viscosity_at_infinity", "is not below that at rest", "< 14.9 mPa*s"],
    ),
    "an exponent of three": (IMPACT, [*CARREAU, "droplet.rheology.exponent=3"], ["rheology.exponent", "<= 2"]),
    "a law that is none": (IMPACT, [*CARREAU, "droplet.rheology.law=careau"], ["did you mean carreau?"]),
    "vortices that thin": (
        VORTICES,
        [one.replace("droplet", "taylor_green") for one in CARREAU],
        ["taylor_green.rheology", "no exact solution is known"],
    ),
    "advancing below the contact angle": (
        CAP,
        ["droplet.contact_angle=90 deg", "droplet.advancing_angle=80 deg"],
        ["droplet.advancing_angle", "wrong side", ">= 90 deg"],
    ),
    "receding without a wall": (FREE, "droplet.receding_angle=80 deg", ["receding_angle", "without a wall"]),
    "unknown key": (VORTICES, "taylor_green.sides=1 mm", ["taylor_green.sides", "unknown key", "side"]),
}


@pytest.mark.parametrize(("path", "setting", "words"), BAD_VALUES.values(), ids=BAD_VALUES.keys())
def test_what_cannot_be_is_refused_in_words(path, setting, words):
    with pytest.raises(CaseError) as caught:
        read_case(path, [setting] if isinstance(setting, str) else setting, True)
    assert all(word in str(caught.value) for word in words), str(caught.value)


@pytest.mark.parametrize(
    ("given", "followed"),
    [("weber = 32\nreynolds = 500", 6.0 * 2.0**-2.5), ('viscosity = "10 mPa*s"\ncontact_angle = "60 deg"', 4.0)],
)
def test_a_drop_is_followed_as_long_as_its_scene_asks_for(tmp_path, given, followed):
    """Without a duration: an impact 6 D / U, a drop that comes to rest 4 sqrt(rho D^3 / gamma)."""
    path = tmp_path / "case.toml"
    liquid = 'diameter = "50 um"\ndensity = "1000 kg/m^3"\nsurface_tension = "0.072 N/m"'
    path.write_text(f'case.name = "short"\n[droplet]\n{liquid}\n{given}\n')
    capillary = (1000.0 * 50e-6**3 / 0.072) ** 0.5
    assert read_case(path, [], True).droplet.until == pytest.approx(followed * capillary)


def test_a_spacing_that_a_drop_does_not_resolve_is_refused(tmp_path):
    text = FREE.read_text().replace("particles_per_diameter = 16", 'spacing = "20 um"').partition("[scales")[0]
    (tmp_path / "case.toml").write_text(text)
    with pytest.raises(CaseError, match=r"too large for this drop.*11.7 um"):
        read_case(tmp_path / "case.toml", [], True)


@pytest.mark.parametrize(("degrees", "across", "would_do"), [(30, 10, 12), (45, 8, 9), (37, 10, 11)])
def test_a_cap_of_too_few_particles_is_refused_with_the_number_that_would_do(degrees, across, would_do):
    """The widths of these caps are 9, 14 and 3 % off."""
    angle, number = f"droplet.contact_angle={degrees} deg", "droplet.numerics.particles_per_diameter="
    with pytest.raises(CaseError, match=rf"too large for the cap of {degrees} deg.*, {would_do} a diameter"):
        read_case(CAP, [angle, f"{number}{across}"], True)
    read_case(CAP, [angle, f"{number}{would_do}"], True)
    read_case(CAP, [angle, f"{number}{across}", "droplet.speed=3 m/s"], True)


@pytest.mark.parametrize(
    "path", [DAM, CHANNEL, VORTICES, FREE, CAP, IMPACT], ids=["dam", "channel", "vortices", "free", "cap", "impact"]
)
def test_plans_tell_particles_steps_and_cost(path):
    case = read_case(path, [], True)
    outlook = forecast_flow(case)
    assert outlook.particles == case.scene.particles
    assert outlook.steps * outlook.time_step >= case.scene.until
    assert outlook.seconds["particles"] > 0.0
    assert kind_of(case).size(case).memory > 0.0
    study = kind_of(case).study(case)
    assert {run.parameter for run in study.runs} == {"particle spacing", "smoothing length"}


def test_plans_say_what_takes_a_day_and_what_a_gpu_would_take():
    told = []
    for device in ("cpu", "cuda"):
        case = read_case(DAM, ["dam_break.numerics.particles_across=1000", f"dam_break.numerics.device={device}"], True)
        outlook = forecast_flow(case)
        assert outlook.by_device["cuda"].seconds < 0.05 * outlook.by_device["cpu"].seconds
        assert outlook.seconds["particles"] == outlook.by_device[device].seconds
        console = Console(width=200)
        with console.capture() as text:
            console.print(*flow_tables(case, outlook))
        told.append(text.get())
    assert told[0] == told[1]
    assert "on a GPU" in told[0] and "a GPU or a coarser spacing is needed" in told[0]
    small = read_case(IMPACT, [], True)
    assert forecast_flow(small).by_device["cpu"].seconds < 3600.0


def test_viscosity_by_shear_costs_what_its_forecast_says():
    case = read_case(IMPACT, CARREAU, True)
    (effect,) = (one for one in kind_of(case).effects if one.name == "shear_dependent_viscosity")
    with_, without = forecast_flow(case), forecast_flow(effect.other_way(case, True))
    assert with_.effects[effect.name]["on"] and not without.effects[effect.name]["on"]
    assert 1.2 < with_.seconds["particles"] / without.seconds["particles"] < 1.4
    assert effect.other_way(case, False) is None


def test_viscosity_limits_the_step_of_fine_flows():
    scene = read_case(CHANNEL, ["poiseuille.numerics.particles_across=200"], True).scene
    assert time_step(scene, True) < time_step(scene, False)


@pytest.mark.parametrize(
    ("path", "settings", "widths", "motion", "energies"),
    [
        (IMPACT, ["droplet.speed=20 m/s", "droplet.viscosity=2 mPa*s"], 2, "largest speed", ["both"]),
        (IMPACT, [], 0, "largest speed", ["both"]),
        (FREE, [], 0, "mean pressure", []),
    ],
)
def test_charts_of_a_droplet_show_what_is_known_of_its_kind(path, settings, widths, motion, energies):
    case = read_case(path, settings, True)
    names = ("time", "spread", "height", "mean_pressure", "largest_speed", "kinetic_energy", "surface_energy")
    shape, moves, energy = droplet_curves(case, {name: np.ones(2) for name in names})
    assert sum("correlations" in one.name for one in shape.series) == widths
    assert moves.y.label.startswith(motion)
    assert [one.name for one in energy.series] == ["kinetic", "surface and wall", *energies]
