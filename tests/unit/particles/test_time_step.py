import pytest

from reflowshock.particles.steps.time_step import StepCollapsed, TimeStep


def test_a_flow_that_no_step_can_follow_is_an_error():
    """Speed grows as the step shrinks: an unstable scheme."""
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
