"""Detection of planted faults in elements, steps and coupling by the limits of the hard cases."""

import pytest

from reflowshock.cases.hard.collector import HARD
from reflowshock.cases.hard.hard_case import HardCase, read_hard_cases
from reflowshock.cases.hard.trials import motion
from reflowshock.cases.hard.verdict import attempt
from reflowshock.fem.coupling import held_velocity
from reflowshock.fem.division import whole
from reflowshock.fem.forces.force_assembled import AssembledElements
from reflowshock.fem.forces.force_nonlinear import NonlinearElements


def hard_case(name: str, tried: str) -> HardCase:
    """Return the first hard case in a file whose trial begins with a text."""
    return next(case for case in read_hard_cases(HARD / f"{name}.toml") if case.tried.startswith(tried))


def flipped(add):
    """Return the method of a force term with the opposite sign."""

    def wrong(self, displacement, force):
        contribution = 0.0 * force
        add(self, displacement, contribution)
        force -= contribution

    return wrong


def caught(case: HardCase) -> bool:
    """Return whether a hard case misses its limits."""
    return not attempt(case).ok


def test_flipped_force_of_tetrahedra_is_caught(monkeypatch):
    case = hard_case("elements_free_flight", "element tetrahedron, critical step element")
    monkeypatch.setattr(AssembledElements, "add", flipped(AssembledElements.add))
    assert caught(case)


def test_flipped_force_of_elements_that_yield_is_caught(monkeypatch):
    case = hard_case("elements_impact", "element one_point, kinematics finite, speed 60 m/s")
    monkeypatch.setattr(NonlinearElements, "add", flipped(NonlinearElements.add))
    assert caught(case)


def test_doubled_step_is_caught(monkeypatch):
    case = hard_case("elements_free_flight", "element incompatible_modes, critical step element")
    right = motion.damped_critical_step
    monkeypatch.setattr(motion, "damped_critical_step", lambda *values: 2.0 * right(*values))
    assert caught(case)


def test_doubled_window_is_caught(monkeypatch):
    case = hard_case("coupling_growth", "scheme held_velocity, substeps 2")
    right = whole.critical_steps
    monkeypatch.setattr(whole, "critical_steps", lambda *values: 2.0 * right(*values))
    assert caught(case)


@pytest.mark.parametrize("name", ["coupling_growth", "coupling_reflection", "coupling_free_fall"])
def test_flipped_force_of_the_coupling_is_caught(monkeypatch, name):
    right = held_velocity.add_rows
    monkeypatch.setattr(held_velocity, "add_rows", lambda rows, values, target: right(rows, -values, target))
    assert caught(hard_case(name, "scheme held_velocity"))
