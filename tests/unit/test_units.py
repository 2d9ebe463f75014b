import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from reflowshock.units import UnitError, dimension, from_si, to_si


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.48 mm", "mm", 4.8e-4),
        ("480 um", "mm", 4.8e-4),
        ("480 µm", "mm", 4.8e-4),
        ("1e-3mm", "mm", 1e-6),
        ("1500 G", "G", 1500 * 9.80665),
        ("9.81 m/s^2", "G", 9.81),
        ("60 deg", "deg", math.pi / 3),
        ("1.5 rad", "deg", 1.5),
        ("132.46 GPa", "GPa", 132.46e9),
        ("1910 kg/m^3", "kg/m^3", 1910.0),
        ("2.33 g/cm^3", "kg/m^3", 2330.0),
        ("0.0724 mm^3", "mm^3", 7.24e-11),
        ("2.27 mPa*s", "Pa*s", 2.27e-3),
        ("498.5 mJ/m**2", "N/m", 0.4985),
        ("25 degC", "K", 298.15),
        ("175 delta_degC", "K", 175.0),
        ("40 mil", "mm", 1.016e-3),
        ("40 thou", "mm", 1.016e-3),
        ("245 °C", "degC", 518.15),
        ("245degC", "degC", 518.15),
        ("480 μm", "mm", 4.8e-4),
        ("2 1/ms", "Hz", 2000.0),
        ("3/s", "s^-1", 3.0),
        ("17 ppm/°C", "ppm/K", 17e-6),
        ("0.25 turn", "deg", math.pi / 2),
        ("30 mrad", "deg", 0.03),
        ("100 gradian", "deg", math.pi / 2),
        ("10 rad/s", "Hz", 10.0),
    ],
)
def test_quantities_become_si(text, unit, value):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (0.48, 'needs a unit, as a string such as "0.48 mm"'),
        (True, "needs a unit"),
        ("0.48", 'needs a unit, such as "0.48 mm"'),
        ("mm", "is not a number and a unit"),
        ("inf mm", "is not a number and a unit"),
        ("nan mm", "is not a number and a unit"),
        ("1e999 mm", "is not finite"),
        ("1 kg", "is a mass; expected a length, e.g. in mm"),
        ("1 deg", "is an angle; expected a length"),
        ("1 mmm", '"mmm" is not a known unit'),
        ("1,5 mm", 'contains a comma; write decimals with a point, as "1.5 mm"'),
        ("1,500.0 G", "contains a comma"),
        ("1 2 mm", '"2 mm" is not a unit'),
        ("1 mm/", '"mm/" is not a unit'),
        ("1 mm^1e9", "is not a unit"),
        ("1 __import__('os')", "is not a unit"),
        ("1" * 5000 + " mm", "is not a number and a unit"),
        ("1 " + "m*" * 500 + "m", "is not a"),
        ("1e-400 mm", "is too small to be distinguished from zero"),
        ("1e400 mm", "is not finite"),
        ("1e308 Gm", "is not finite"),
        pytest.param(10**5000, "needs a unit", id="thousands of digits"),
        ("1 ¼", "is not a unit"),
        ("1 mm*deg", "contains the bare number degree"),
    ],
)
def test_values_that_are_not_lengths_are_rejected(text, words):
    with pytest.raises(UnitError) as caught:
        to_si(text, "mm")
    assert words in str(caught.value)


def test_an_angle_needs_its_unit():
    with pytest.raises(UnitError, match="is a pure number; expected an angle"):
        to_si("1 dimensionless", "deg")


@pytest.mark.parametrize("unit", ["percent", "bit", "count", "ppm", "dB"])
def test_a_pure_number_is_not_an_angle(unit):
    with pytest.raises(UnitError, match="expected an angle"):
        to_si(f"5 {unit}", "deg")


@pytest.mark.parametrize(
    ("first", "second", "unit"),
    [("0.04 mm", "40 um", "m"), ("2.3 ms", "2300 us", "s"), ("0.07 mm^3", "7e7 um^3", "mm^3")],
)
def test_the_same_quantity_is_the_same_number_in_any_unit(first, second, unit):
    assert to_si(first, unit) == to_si(second, unit)


@given(st.text(max_size=30))
def test_any_text_is_a_quantity_or_refused(text):
    for given_text in (text, f"1 {text}", f"1 m{text}"):
        try:
            assert math.isfinite(to_si(given_text, "mm"))
        except UnitError as error:
            assert str(error)


@given(st.floats(1e-6, 1e6), st.sampled_from(["mm", "G", "ms", "GPa", "kg/m^3", "deg", "mm^3", "N/m"]))
def test_what_is_written_reads_the_same(value, unit):
    assert to_si(from_si(value, unit, 17), unit) == pytest.approx(value, rel=1e-12)


def test_dimensions_have_names():
    assert [dimension(unit) for unit in ("mm", "G", "deg", "GPa", "mm^3")] == [
        "length", "acceleration", "angle", "pressure", "volume",
    ]  # fmt: skip
