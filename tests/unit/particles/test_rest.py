"""Criterion of rest: a weakly damped oscillation is calm at its turning points, so that calm must last."""

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest

from reflowshock.particles.core.cloud import sphere_cloud
from reflowshock.particles.parameters.effects import LIQUID_EFFECTS
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.reference.drop_oscillation import cap_frequency, rayleigh_frequency
from reflowshock.particles.scenes.flow_setup import start_flow, stop_rule
from reflowshock.particles.steps.flow import StepRecord
from reflowshock.particles.steps.rest import CALM_STEPS, NotAtRest, Run, StopRule, is_calm, is_lasting, run_to_rest

PERIOD = 60  # steps
# Surface displacement per step at the limit of calm, in spacings.
BOUND = 1e-4


def records_of(displacements):
    """Return one-second step records that move the surface at constant energy."""
    nan = float("nan")
    return [
        StepRecord(number, float(number), 1.0, "", 0.0, 1.0, 1.0, 0.0, displacement, 0, 0, nan, nan)
        for number, displacement in enumerate(displacements, 1)
    ]


def swing(amplitude, decay, steps):
    """Return displacements [spacings] of a damped oscillation that starts at its turning point."""
    turn = 2.0 * pi / PERIOD
    positions = [amplitude * (1.0 - decay) ** step * cos(turn * step) for step in range(steps + 1)]
    return np.abs(np.diff(positions))


def steps_to_rest(records, rule):
    """Return the number of steps until rest is detected, and the run."""
    run = Run()
    for record in records:
        run.records.append(record)
        run.calm = run.calm + 1 if is_calm(run.records, rule) else 0
        run.at_rest = is_lasting(run.records, run.calm, rule)
        if run.at_rest:
            break
    return run


def test_a_swing_is_not_at_rest_where_it_turns():
    """With three steps the detected amplitude would be eight times the amplitude with a quarter period."""
    records = records_of(swing(amplitude=0.02, decay=1e-3, steps=5000))
    three, quarter = StopRule(9999, 1e-6, 1.0), StopRule(9999, 1e-6, 1.0, lasting=0.25 * PERIOD)
    results = [steps_to_rest(records, rule) for rule in (three, quarter)]
    assert [run.at_rest for run in results] == [True, True]
    amplitudes = [0.02 * (1.0 - 1e-3) ** len(run.records) for run in results]
    fastest = [amplitude * 2.0 * pi / PERIOD for amplitude in amplitudes]
    assert fastest[0] > 4.0 * BOUND
    assert fastest[1] < BOUND / sin(0.25 * pi)


@pytest.mark.parametrize(("ratio", "most"), [(0.987, 1.43), (0.9, 1.54), (0.74, 1.82)])
def test_speed_at_rest_of_an_oscillation_slower_than_estimated(ratio, most):
    """The ratios of exact to estimated frequency are for caps of 60, 120 and 148 degrees."""
    records = records_of(swing(amplitude=0.02, decay=1e-4, steps=40000))
    run = steps_to_rest(records, StopRule(99999, 1e-6, 1.0, lasting=0.25 * ratio * PERIOD))
    fastest = 0.02 * (1.0 - 1e-4) ** len(run.records) * 2.0 * pi / PERIOD
    assert run.at_rest
    assert fastest == pytest.approx(most * BOUND, rel=0.04)  # in whole steps, of which a quarter has 15


def test_a_body_that_stops_is_at_rest_after_three_steps_and_only_confirmed_by_more():
    records = records_of([1.0] * 7 + [0.0] * 40)
    three = steps_to_rest(records, StopRule(99, 1e-6, 1.0))
    longer = steps_to_rest(records, StopRule(99, 1e-6, 1.0, lasting=15.0))
    assert (len(three.records), len(longer.records)) == (7 + CALM_STEPS, 7 + 15)
    assert three.time_at_rest == longer.time_at_rest == 10.0


def test_no_time_at_rest_without_rest():
    assert np.isnan(Run(records_of([1.0, 0.0])).time_at_rest)


def test_the_slowest_swing_of_half_a_ball_is_that_of_the_ball():
    half = cap_frequency(0.5 * pi, 1e-9, 8930.0, 0.5)
    ball = rayleigh_frequency(2, (1.5e-9 / pi) ** (1.0 / 3.0), 8930.0, 0.5)
    assert half == pytest.approx(ball, rel=1e-12)


def test_the_slowest_swing_of_a_cap():
    """Reference frequencies: 1 mm^3 of real solder at 60 degrees; published values at 120 and 148 degrees."""
    assert cap_frequency(pi / 3.0, 1e-9, 8930.0, 0.4985) / (2.0 * pi) == pytest.approx(108.7, rel=0.02)
    periods = {120: 2.69e-3, 148: 3.7e-3}
    results = [2.0 * pi / cap_frequency(np.radians(angle), 1e-9, 8930.0, 4.985) / periods[angle] for angle in periods]
    assert results == pytest.approx([0.9, 0.74], abs=0.02)


def test_the_slowest_swing_of_a_film():
    """The Rayleigh quotient of an elliptic film is 12 gamma angle / (rho a^3), a the base radius."""
    angle, radius = 0.01, 1e-3
    film = cap_frequency(angle, pi * radius**3 * angle / 4.0, 8930.0, 0.5)
    assert film**2 == pytest.approx(12.0 * angle * 0.5 / (8930.0 * radius**3), rel=1e-3)


def relaxed_ball(solder, shells):
    """Return the particles of a ball at rest."""
    still = solder.model_copy(update={"numerics": SolderNumerics(time_step_limit=100.0)})
    effects = {effect.name: effect.name == "surface_tension" for effect in LIQUID_EFFECTS}
    flow = start_flow(sphere_cloud(solder.volume, shells), still, effects, ())
    run_to_rest(flow, stop_rule(flow.body.cloud, still, effects))
    return replace(flow.body.cloud, points=flow.body.points, triangles=flow.body.triangles)


def test_a_drop_of_real_solder_that_swings_is_not_found_at_rest_where_it_turns():
    """A ball of 147 particles at 2.5 times the speed limit of rest is calm for some steps."""
    solder = Solder(volume=1e-9, numerics=SolderNumerics(scheme="ispg", time_step_limit=100.0, max_steps=16))
    effects = {effect.name: effect.name in ("inertia", "viscosity", "surface_tension") for effect in LIQUID_EFFECTS}
    cloud = relaxed_ball(solder, 3)
    rule = stop_rule(cloud, solder, effects, None)

    def pushed():
        flow = start_flow(cloud, solder, effects, ())
        speed = 2.5 * BOUND * cloud.spacing / rule.calm_time
        flow.body.velocity = speed / 0.62e-3 * cloud.points * np.array([1.0, -1.0, 0.0])
        return flow

    assert run_to_rest(pushed(), replace(rule, lasting=0.0)).at_rest
    with pytest.raises(NotAtRest, match=r"the limit is 0.0001 for 0.00115 s"):
        run_to_rest(pushed(), rule)
