"""Pulses and their tables: exact integrals, service conditions and file errors with line numbers."""

import numpy as np
import pytest

from reflowshock.fem.errors import LoadError, PulseError
from reflowshock.fem.loads.pulse import (
    SERVICE_CONDITIONS,
    Constant,
    HalfSine,
    Haversine,
    Tabulated,
    service_condition,
)
from reflowshock.fem.loads.pulse_table import read_pulse
from reflowshock.fem.mesh.facet import area_vectors
from reflowshock.fem.mesh.facet_areas import outward_areas
from tests.support.fem_models import bar

PULSES = {
    "half_sine": HalfSine(3.0, 0.8),
    "haversine": Haversine(3.0, 0.8),
    "constant": Constant(2.0),
    "step": Constant(2.0, 0.7),
    "table": Tabulated(np.array([0.1, 0.3, 0.9]), np.array([1.0, -2.0, 3.0])),
}


@pytest.mark.parametrize("name", PULSES)
def test_integrals_are_those_of_the_values(name):
    pulse = PULSES[name]
    times = np.linspace(0, 1.5, 30001)
    middle = 0.5 * (times[1:] + times[:-1])
    once = np.concatenate([[0.0], np.cumsum(np.diff(times) * [pulse.value(time) for time in middle])])
    twice = np.concatenate([[0.0], np.cumsum(np.diff(times) * 0.5 * (once[1:] + once[:-1]))])
    for k in (0, 3000, 9000, 14500, 22000, 30000):
        assert pulse.integral(times[k]) == pytest.approx(once[k], abs=2e-4)
        assert pulse.double_integral(times[k]) == pytest.approx(twice[k], abs=2e-4)


def test_service_conditions_are_the_drops_of_their_table():
    assert service_condition("B").integral(1.0) ** 2 / (2 * 9.80665) == pytest.approx(1.12, abs=0.005)
    assert sorted(SERVICE_CONDITIONS) == list("ABCDEFGH")
    heights = {
        "H": 1.5,
        "G": 1.3,
        "B": 1.12,
        "F": 0.762,
        "A": 0.508,
        "E": 0.33,
        "D": 0.178,
        "C": 0.0762,
    }  # [m], same table
    for name, height in heights.items():
        assert service_condition(name).integral(1.0) ** 2 / (2 * 9.80665) == pytest.approx(height, rel=0.07)
    harshness = [service_condition(name).integral(1.0) for name in "CDEAFBGH"]
    assert harshness == sorted(harshness)


def test_table_in_other_units(tmp_path):
    path = tmp_path / "pulse.csv"
    path.write_text("# drop table, sensor 3\ntime [ms], acceleration [G]\n0, 0\n0.25,1500\n\n0.5,0\n")
    pulse = read_pulse(path, "acceleration")
    assert pulse.value(2.5e-4) == pytest.approx(14709.975)
    assert pulse.integral(1.0) == pytest.approx(0.5 * 5e-4 * 14709.975)


FAULTS = {
    "time [ms],acceleration [G]\n0,0\n0.5,1\n0.5,2\n": "line 4: times must increase, 0.0005 s follows 0.0005 s",
    "time [ms],acceleration [G]\n0,0\n0.5,one\n": "line 3: two numbers are needed, found 0.5, one",
    "time [ms],acceleration [G]\n0,0\n0.5\n": "line 3: two numbers are needed",
    "time [ms],acceleration [G]\n0,0\n0.5,nan\n": "line 3: 0.5, nan is not finite",
    "time [ms],acceleration [Gs]\n0,0\n0.5,1\n": r"line 1: column 'acceleration \[Gs\]' needs its unit in brackets",
    "time [msec],acceleration [G]\n0,0\n0.5,1\n": r"did you mean \[ms\]",
    "time,acceleration\n0,0\n0.5,1\n": "column 'time' needs its unit in brackets, one of s, ms, us, ns",
    "0,0\n0.5,1\n1,0\n": "column '0' needs its unit",
    "time [ms]\n0\n1\n": "line 1: the header must name a column of times and one of values",
    "time_ms,x_mm,a_G\n0,0,0\n1,1,1\n": "line 1: has several columns of values, x_mm, a_G: name one",
    "": "a header and at least two rows are needed, found 0 lines",
}


RECORD = "time_s,input_g,board_g\n-0.5,1,7\n-0.25,2,8\n0.0,4,9\n"


@pytest.mark.parametrize(("column", "first"), [("input_g", 1.0), ("input", 1.0), ("board", 7.0)])
def test_column_of_a_record_that_begins_before_its_trigger(tmp_path, column, first):
    path = tmp_path / "record.csv"
    path.write_text(RECORD)
    pulse = read_pulse(path, "acceleration", column)
    assert pulse.times == pytest.approx([0.0, 0.25, 0.5])
    assert pulse.value(0.0) == pytest.approx(first * 9.80665)


RECORD_FAULTS = {
    "inputs_g": "line 1: 0 columns are titled 'inputs_g'; titles are input_g, board_g; did you mean 'input_g'",
    "time_s": "0 columns are titled 'time_s'",
}


@pytest.mark.parametrize("column", RECORD_FAULTS)
def test_column_that_is_not_there(tmp_path, column):
    path = tmp_path / "record.csv"
    path.write_text(RECORD)
    with pytest.raises(PulseError, match=RECORD_FAULTS[column]):
        read_pulse(path, "acceleration", column)


def test_row_of_a_record_with_a_missing_cell(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text(RECORD + "0.25,5\n")
    with pytest.raises(PulseError, match=r"line 5: 3 numbers are needed, found 0\.25, 5"):
        read_pulse(path, "acceleration", "input")


@pytest.mark.parametrize("text", FAULTS)
def test_fault_of_a_table_is_named_with_its_line(tmp_path, text):
    path = tmp_path / "pulse.csv"
    path.write_text(text)
    with pytest.raises(PulseError, match=FAULTS[text]):
        read_pulse(path, "acceleration")


def test_missing_table(tmp_path):
    with pytest.raises(PulseError, match=r"nowhere\.csv: No such file"):
        read_pulse(tmp_path / "nowhere.csv", "pressure")


def test_areas_of_facets():
    square = np.array([[[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]]])
    assert area_vectors(square)[0] == pytest.approx(np.tile([0, 0, 0.5], (4, 1)))
    trapezium = np.array([[[0.0, 0, 0], [3, 0, 0], [1, 1, 0], [0, 1, 0]]])
    two = area_vectors(np.concatenate([trapezium[:, [0, 1, 2]], trapezium[:, [0, 2, 3]]]))
    assert area_vectors(trapezium).sum(axis=(0, 1)) == pytest.approx(two.sum(axis=(0, 1)))
    mesh = bar(1.0, 4, 0.5)
    for name, sign in (("low", -1.0), ("high", 1.0)):
        nodes, areas = outward_areas(mesh, name)
        assert len(nodes) == 4
        assert areas.sum(axis=0) == pytest.approx([sign * 0.25, 0, 0])


def test_unknown_facet_set_has_a_hint():
    with pytest.raises(LoadError, match="no facet belongs to 'hihg'; the mesh has low, high; did you mean 'high'"):
        outward_areas(bar(1.0, 4, 0.5), "hihg")
