"""Pulses and their tables: exact integrals, service conditions, every fault of a file named with its line."""

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
    "time [ms],acceleration [G]\n-1,0\n0.5,1\n": "line 2: time -0.001 s is before the start",
    "time [ms],acceleration [g]\n0,0\n0.5,1\n": r"line 1: column 'acceleration \[g\]' needs its unit in brackets",
    "time [msec],acceleration [G]\n0,0\n0.5,1\n": r"did you mean \[ms\]",
    "time,acceleration\n0,0\n0.5,1\n": "column 'time' needs its unit in brackets, one of s, ms, us, ns",
    "0,0\n0.5,1\n1,0\n": "column '0' needs its unit",
    "time [ms],x [mm],acceleration [G]\n0,0,0\n1,1,1\n": "must name two columns, found 3",
    "": "a header and at least two rows are needed, found 0 lines",
}


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
