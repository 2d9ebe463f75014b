"""Cases, forecasts and plans of flows by delta-SPH, and the messages for invalid ones."""

from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from reflowshock.particles.flows.result import FlowResult
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.flows.droplet import droplet_curves
from reflowshock.workflow.kinds import kind_of
from reflowshock.workflow.pipeline.reader import read_case

CASES = Path(__file__).resolve().parents[3] / "cases"
DAM, CHANNEL, VORTICES = (CASES / name / "case.toml" for name in ("dam_break", "poiseuille", "taylor_green"))
PRINTING = CASES / "printing/case.toml"
FROZEN = CASES / "frozen_drop/case.toml"
FREE, CAP, IMPACT = (CASES / name / "case.toml" for name in ("young_laplace", "static_caps", "drop_impact"))
CARREAU = ["droplet.rheology.law=carreau", "droplet.rheology.exponent=0.5", "droplet.rheology.shear_rate=1e5 1/s"]
BAD_VALUES = {
    "column as wide as the tank": (
        DAM,
        "dam_break.width=3.3 m",
        ["dam_break.tank_length", '"3.22 m"', "> dam_break.width = 3.3 m"],
    ),
    "column thinner than a particle": (
        DAM,
        "dam_break.width=1 mm",
        ["dam_break.width", "narrower than one particle", ">= 0.01 m"],
    ),
    "sensor above the wall": (DAM, "dam_break.sensor_height=3 m", ["dam_break.sensor_height", "<= 2.4 m"]),
    "too few particles": (DAM, "dam_break.numerics.particles_across=4", ["particles_across = 4", ">= 8"]),
    "low speed of sound": (DAM, "dam_break.numerics.sound_speed=2", ["sound_speed = 2", ">= 5"]),
    "misspelt kernel": (
        DAM,
        "dam_break.numerics.kernel=wenland",
        ["one of cubic_spline, wendland", "did you mean wendland?"],
    ),
    "height in seconds": (DAM, "dam_break.height=1 s", ["dam_break.height", "expected a length"]),
    "negative speed": (CHANNEL, "poiseuille.speed=-1 m/s", ["poiseuille.speed", "> 0"]),
    "turbulent flow": (
        CHANNEL,
        "poiseuille.speed=10 m/s",
        ["poiseuille.viscosity", "Reynolds number 1e+04", ">= 0.01 Pa*s"],
    ),
    "viscosity off": (VORTICES, "taylor_green.effects.viscosity=off", ["effects.viscosity", "auto, on"]),
    "speed and Weber number": (
        IMPACT,
        "droplet.weber=8",
        ["droplet.weber = 8", "conflicts with droplet.speed", "7.986"],
    ),
    "viscosity and Reynolds number": (IMPACT, "droplet.reynolds=8", ["droplet.reynolds = 8", "droplet.viscosity"]),
    "Reynolds number at rest": (CAP, "droplet.reynolds=8", ["without an impact", "droplet.speed or droplet.weber"]),
    "spacing given twice": (FREE, "droplet.numerics.spacing=2 um", ["numerics.spacing", "particles_per_diameter"]),
    "speed of sound too low for the impact": (
        IMPACT,
        "droplet.numerics.sound_speed=5",
        ["droplet.numerics.sound_speed = 5", "too low for 5 m/s", "would change by 4 %", ">= 8, 40 m/s"],
    ),
    "cube on a wall": (CAP, "droplet.start=cube", ["droplet.start", "only a free drop", "sphere"]),
    "angle too small": (CAP, "droplet.contact_angle=10 deg", ["droplet.contact_angle", "30"]),
    "surface tension in metres": (FREE, "droplet.surface_tension=1 m", ["droplet.surface_tension", "N/m"]),
    "misspelt diameter": (FREE, "droplet.diametre=1 um", ["droplet.diametre", "unknown key", "diameter"]),
    "drop of few particles": (FREE, "droplet.numerics.particles_per_diameter=4", ["particles_per_diameter", ">= 8"]),
    "negative pitch": (PRINTING, "printing.pitch=-1 um", ["printing.pitch", "> 0"]),
    "pitch too small": (PRINTING, "printing.pitch=2 um", ["printing.pitch", "pile up", ">= 5.75 um"]),
    "delay too short": (PRINTING, "printing.delay=2 us", ["printing.delay", "the previous one", ">= 7.67 us"]),
    "light and freezing": (FROZEN, "printing.cure.dose=1 J/m^2", ["printing.cure", "drops freeze before", "off"]),
    "warm plate": (
        FROZEN,
        "printing.freezing.substrate_temperature=190 degC",
        ["freezing.substrate_temperature", "190 degC", "too warm", "< 183 degC"],
    ),
    "frozen drops": (
        FROZEN,
        "printing.freezing.temperature=100 degC",
        ["freezing.temperature", ">= 183 degC"],
    ),
    "delay shorter than cooling": (
        FROZEN,
        ["printing.layers=2", "printing.delay=200 us"],
        ["printing.delay", "on a warm one", ">= 1377 us"],
    ),
    "freezing without its table": (
        PRINTING,
        "printing.effects.freezing=on",
        ["effects.freezing", "[printing.freezing]"],
    ),
    "misspelt order": (
        PRINTING,
        "printing.order=rastr",
        ["one of raster, serpentine, interleaved", "did you mean raster?"],
    ),
    "bound of the Carreau law": (
        IMPACT,
        CARREAU + ["droplet.rheology.bound=5"],
        ["rheology.bound", "has no meaning", "omit it"],
    ),
    "missing shear rate": (IMPACT, CARREAU[:2], ["droplet.rheology.shear_rate"]),
    "viscosity at infinity too large": (
        IMPACT,
        [*CARREAU, "droplet.rheology.viscosity_at_infinity=20 mPa*s"],
        ["viscosity_at_infinity", "is not below the viscosity at rest", "< 14.9 mPa*s"],
    ),
    "exponent too large": (IMPACT, [*CARREAU, "droplet.rheology.exponent=3"], ["rheology.exponent", "<= 2"]),
    "misspelt law": (IMPACT, [*CARREAU, "droplet.rheology.law=careau"], ["did you mean carreau?"]),
    "shear-thinning vortices": (
        VORTICES,
        [setting.replace("droplet", "taylor_green") for setting in CARREAU],
        ["taylor_green.rheology", "requires a constant viscosity"],
    ),
    "advancing below the contact angle": (
        CAP,
        ["droplet.contact_angle=90 deg", "droplet.advancing_angle=80 deg"],
        ["droplet.advancing_angle", "wrong side", ">= 90 deg"],
    ),
    "receding without a wall": (FREE, "droplet.receding_angle=80 deg", ["receding_angle", "without a wall"]),
    "unknown key": (VORTICES, "taylor_green.sides=1 mm", ["taylor_green.sides", "unknown key", "side"]),
}


def forecast(case):
    """Return the forecast of a case."""
    return kind_of(case).forecast(case)


@pytest.mark.parametrize(("path", "setting", "words"), BAD_VALUES.values(), ids=BAD_VALUES.keys())
def test_invalid_case_is_rejected_with_key_value_and_range(path, setting, words):
    with pytest.raises(CaseError) as caught:
        read_case(path, [setting] if isinstance(setting, str) else setting, True)
    assert all(word in str(caught.value) for word in words), str(caught.value)


@pytest.mark.parametrize(
    ("keys", "duration"),
    [("weber = 32\nreynolds = 500", 6.0 * 2.0**-2.5), ('viscosity = "10 mPa*s"\ncontact_angle = "60 deg"', 4.0)],
)
def test_default_duration_of_a_drop(tmp_path, keys, duration):
    """An impact lasts 6 D / U, a drop that comes to rest 4 sqrt(rho D^3 / gamma)."""
    path = tmp_path / "case.toml"
    liquid = 'diameter = "50 um"\ndensity = "1000 kg/m^3"\nsurface_tension = "0.072 N/m"'
    path.write_text(f'case.name = "short"\n[droplet]\n{liquid}\n{keys}\n')
    capillary = (1000.0 * 50e-6**3 / 0.072) ** 0.5
    assert read_case(path, [], True).droplet.until == pytest.approx(duration * capillary)


def test_spacing_too_large_for_a_drop_is_rejected(tmp_path):
    text = FREE.read_text().replace("particles_per_diameter = 16", 'spacing = "20 um"').partition("[scales")[0]
    (tmp_path / "case.toml").write_text(text)
    with pytest.raises(CaseError, match=r"too large for this drop.*11.7 um"):
        read_case(tmp_path / "case.toml", [], True)


@pytest.mark.parametrize(("degrees", "across", "enough"), [(30, 10, 12), (45, 8, 9), (37, 10, 11)])
def test_cap_of_too_few_particles_is_rejected_with_a_sufficient_number(degrees, across, enough):
    """The widths of these caps are wrong by 9, 14 and 3 %."""
    angle, number = f"droplet.contact_angle={degrees} deg", "droplet.numerics.particles_per_diameter="
    with pytest.raises(CaseError, match=rf"too large for the cap of {degrees} deg.*, {enough} per diameter"):
        read_case(CAP, [angle, f"{number}{across}"], True)
    read_case(CAP, [angle, f"{number}{enough}"], True)
    read_case(CAP, [angle, f"{number}{across}", "droplet.speed=3 m/s"], True)


@pytest.mark.parametrize(
    "path", [DAM, CHANNEL, VORTICES, FREE, CAP, IMPACT], ids=["dam", "channel", "vortices", "free", "cap", "impact"]
)
def test_forecast_has_particles_steps_and_cost(path):
    case = read_case(path, [], True)
    predicted = forecast(case)
    assert predicted.particles == case.scene.particles
    assert predicted.steps * predicted.time_step >= case.scene.until
    assert predicted.seconds["particles"] > 0.0
    assert kind_of(case).size(case).memory > 0.0
    study = kind_of(case).study(case)
    assert {run.parameter for run in study.runs} == {"particle spacing", "smoothing length"}


def test_plan_shows_the_cost_of_both_devices_and_what_takes_a_day():
    plans = []
    for device in ("cpu", "cuda"):
        case = read_case(DAM, ["dam_break.numerics.particles_across=1000", f"dam_break.numerics.device={device}"], True)
        predicted = forecast(case)
        assert predicted.by_device["cuda"].seconds < 0.05 * predicted.by_device["cpu"].seconds
        assert predicted.seconds["particles"] == predicted.by_device[device].seconds
        console = Console(width=200)
        with console.capture() as text:
            console.print(*kind_of(case).plan(case, predicted))
        plans.append(text.get())
    assert plans[0] == plans[1]
    assert "on a GPU" in plans[0] and "try a GPU or a coarser spacing" in plans[0]
    small = read_case(IMPACT, [], True)
    assert forecast(small).by_device["cpu"].seconds < 3600.0


def test_shear_dependent_viscosity_raises_the_predicted_cost():
    case = read_case(IMPACT, CARREAU, True)
    (effect,) = (effect for effect in kind_of(case).effects if effect.name == "shear_dependent_viscosity")
    with_, without = forecast(case), forecast(effect.toggled(case, True))
    assert with_.effects[effect.name]["on"] and not without.effects[effect.name]["on"]
    assert 1.2 < with_.seconds["particles"] / without.seconds["particles"] < 1.4
    assert effect.toggled(case, False) is None


def test_viscosity_limits_the_time_step_of_fine_flows():
    scene = read_case(CHANNEL, ["poiseuille.numerics.particles_across=200"], True).scene
    assert scene.expected_time_step(True) < scene.expected_time_step(False)


@pytest.mark.parametrize(
    ("path", "settings", "widths", "motion", "energies"),
    [
        (IMPACT, ["droplet.speed=20 m/s", "droplet.viscosity=2 mPa*s"], 2, "largest speed", ["total"]),
        (IMPACT, [], 0, "largest speed", ["total"]),
        (FREE, [], 0, "mean pressure", []),
    ],
)
def test_droplet_charts_show_the_references_of_its_motion(path, settings, widths, motion, energies):
    case = read_case(path, settings, True)
    names = ("time", "spread", "height", "mean_pressure", "largest_speed", "kinetic_energy", "surface_energy")
    result = FlowResult([], np.zeros((0, 3)), {name: np.ones(2) for name in names}, {})
    shape, speed, energy = droplet_curves(case.scene, result)
    assert sum("correlations" in line.name for line in shape.series) == widths
    assert speed.y.label.startswith(motion)
    assert [line.name for line in energy.series] == ["kinetic", "surface and wall", *energies]
