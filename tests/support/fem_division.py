"""Divisions of meshes for tests: by the parts of the mesh, or as a naive scheme would."""

from reflowshock.fem.division.decide import in_two_steps, plan_windows
from reflowshock.fem.division.divide import held_velocity_division
from reflowshock.fem.division.division import Division, Rules
from reflowshock.fem.division.whole import Survey, Whole


def by_patch(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Assign the board patch and everything except the board to the meso model."""
    return held_velocity_division(whole, survey, rules, whole.mesh.in_parts(lambda name: name != "board"))


def naive(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Take the window from the macro elements alone, ignoring elements at the cut."""
    macro = whole.mesh.in_parts("board".__eq__)
    return in_two_steps("held_velocity", macro, ~macro, plan_windows(rules, macro, survey.step))
