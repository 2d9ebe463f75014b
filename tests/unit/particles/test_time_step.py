from math import ceil

import pytest

from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.steps.time_step import StepCollapsed, TimeStep, largest_step, most_steps


def test_a_flow_that_no_step_can_follow_is_an_error():
    """In an unstable scheme the speed grows as the step decreases."""
    step = TimeStep(largest=1e-6, spacing=1e-4, size=1e-6)
    with pytest.raises(StepCollapsed, match="unstable"):
        while not step.accepts(speed=1e-3 / step.size):
            pass


def test_a_cut_step_keeps_particles_within_a_quarter_of_the_spacing():
    step = TimeStep(largest=1e-3, spacing=1e-4, size=1e-3)
    while not step.accepts(speed=1.0):
        pass
    assert step.size <= 0.25e-4
    assert step.binding == "displacement"


def test_a_step_that_raises_the_energy_is_halved_but_not_for_ever():
    step = TimeStep(largest=1.0, spacing=1.0, size=1.0)
    step.cut_for_energy()
    assert (step.size, step.binding) == (0.5, "energy")
    with pytest.raises(StepCollapsed, match="the energy still rises"):
        for _ in range(40):
            step.cut_for_energy()


def test_a_step_at_its_bound_goes_on_as_far_as_the_spacing_allows_and_the_next_one_has_the_bound_again():
    step = TimeStep(largest=1.0, spacing=0.1, size=1.0)
    assert step.steps_within_reach(speed=1e-4) == pytest.approx(0.9 * 0.25 * 0.1 / 1e-4)
    assert step.steps_within_reach(speed=0.0) > 1e100
    step.prolong(200.0)
    assert (step.size, step.binding) == (200.0, "steady motion")
    step.grow(speed=0.0)
    assert (step.size, step.binding) == (1.0, "capillary multiple")
    step.cut_for_energy()
    assert step.steps_within_reach(speed=1e-4) == 1.0


def test_ispg_may_take_as_many_steps_as_its_slowest_swing_needs_to_die_away():
    """For published values an oscillation decays with 5 mu / (rho R^2) at 30 steps per period: 3501 steps."""
    numerics = SolderNumerics(scheme="ispg", time_step_limit=100.0)
    solder = Solder(volume=1e-9, surface_tension=4.985, viscosity=0.227, numerics=numerics)
    size, bound = largest_step(solder, 1e-4)
    assert bound == "swing"
    assert size == pytest.approx(1.43e-3 / 30.0, rel=0.02)
    assert (most_steps(solder, 1e-4) - 1000) * size == pytest.approx(
        40.0 * 8930.0 * 6.2e-4**2 / (5.0 * 0.227), rel=0.01
    )


@pytest.mark.parametrize(
    ("settings", "steps"), [({}, 1000), ({"max_steps": 7}, 7), ({"scheme": "ispg", "max_steps": 7}, 7)]
)
def test_the_case_says_how_many_steps_else_a_thousand(settings, steps):
    assert most_steps(Solder(volume=1e-9, numerics=SolderNumerics(**settings)), 1e-4) == steps


def test_ispg_takes_no_more_steps_than_the_process():
    """Without viscosity an oscillation never decays."""
    solder = Solder(volume=1e-9, viscosity=1e-9, process_time=0.1, numerics=SolderNumerics(scheme="ispg"))
    assert most_steps(solder, 1e-4) == 1000 + ceil(0.1 / largest_step(solder, 1e-4)[0])
