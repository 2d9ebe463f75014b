"""All numbers of elements of a structure are multiplied together; one model may be run where two are described."""

import numpy as np
import pytest

from reflowshock.workflow.case.case import CASES
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.structure.findings import Motion, compare_with_references, layers_of
from reflowshock.workflow.structure.forecast import forecast_structure

TWO_SCALES, ONE_SCALE = CASES / "two_scale_bar/case.toml", CASES / "cantilever/case.toml"


def counts(*settings: str) -> dict[str, int]:
    """Elements of the layers of the bar."""
    outlook = forecast_structure(read_case(TWO_SCALES, settings))
    return {name: layer.elements for name, layer in outlook.layers.items()}


def test_all_elements_are_multiplied():
    assert counts() == {"lower": 18 * 18 * 60, "section": 22 * 22 * 10, "upper": 18 * 18 * 60}
    assert counts("structure.refine=0.5") == {"lower": 9 * 9 * 30, "section": 11 * 11 * 5, "upper": 9 * 9 * 30}
    assert counts("structure.refine=2") == {"lower": 36 * 36 * 120, "section": 44 * 44 * 20, "upper": 36 * 36 * 120}


def test_halves_go_up_and_one_element_is_left():
    assert counts("structure.refine=0.25") == {"lower": 5 * 5 * 15, "section": 6 * 6 * 3, "upper": 5 * 5 * 15}
    assert counts("structure.refine=0.01")["section"] == 1


def test_refined_steps_and_implicit_cost_follow():
    coarse, fine = (forecast_structure(read_case(ONE_SCALE, [f"structure.refine={f}"])) for f in (1, 2))
    assert fine.steps["explicit"] == pytest.approx(0.5 * coarse.steps["explicit"], rel=1e-9)
    assert fine.solvers.implicit.memory > 3.0 * coarse.solvers.implicit.memory


def test_one_model_in_place_of_two():
    dynamics = read_case(TWO_SCALES, ["dynamics.solver=dns"]).dynamics
    assert dynamics.solvers == ("dns",)
    assert read_case(TWO_SCALES, []).dynamics.solvers == ("explicit", "dns")


def test_one_model_without_two_is_the_explicit_solver():
    with pytest.raises(CaseError, match="solver") as caught:
        read_case(ONE_SCALE, ["dynamics.solver=dns"])
    assert "replaces two coupled models" in caught.value.lines()[0]


@pytest.mark.parametrize("name", ["two_scale_bar", "bar_wave"])
def test_waves_are_compared_where_they_are_recorded(name):
    """A mesh without a node at a watch point records the wave at another one; exact waves there have no error."""
    case = read_case(CASES / name / "case.toml", [])
    (reference,) = (item for key, item in case.references.items() if key == "wave")
    time = np.linspace(0.0, case.dynamics.duration, 2001)
    load, points = case.loads[reference.load], [*reference.incident, reference.transmitted]
    shape = np.sin if load.pulse == "half_sine" else lambda angle: np.sin(angle) ** 2
    places = {point: (0.0, 0.0, case.watch[point].at[2] + 3e-4) for point in points}

    def pressure(t: float) -> float:
        return load.peak * float(shape(np.pi * t / load.duration)) if 0.0 < t < load.duration else 0.0

    history = {"time": time}
    for point in points:
        velocity = np.zeros((len(time), 3))
        velocity[:, 2] = layers_of(case).velocity(places[point][2], time, pressure)
        history[f"velocity@{point}"] = velocity
    metrics, health = compare_with_references(case, Motion([], history, places))
    assert metrics["wave_error"]["value"] < 1e-12
    assert all(check["ok"] for check in health.values())
