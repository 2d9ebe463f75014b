"""Divisions of meshes for tests: by the parts of the mesh, or as a naive scheme would."""

from reflowshock.fem.division.decide import in_two_steps, plan_windows
from reflowshock.fem.division.divide import held_velocity_division
from reflowshock.fem.division.division import Division, Rules
from reflowshock.fem.division.whole import Survey, Whole


def by_patch(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Divide a mesh by its parts: everything except the part ``board`` belongs to the meso model.

    Args:
        whole: Joined mesh of board, package and joints.
        survey: Critical steps and masses of the elements.
        rules: Settings of the division.

    Returns:
        Cells of both models and their time steps.
    """
    return held_velocity_division(whole, survey, rules, whole.mesh.in_parts(lambda name: name != "board"))


def naive(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Divide a mesh by its parts with a window that follows from the macro elements alone.

    Args:
        whole: Joined mesh of board, package and joints.
        survey: Critical steps and masses of the elements.
        rules: Settings of the division.

    Returns:
        Cells of both models and their time steps; the window ignores the elements at the cut.
    """
    macro = whole.mesh.in_parts("board".__eq__)
    return in_two_steps("held_velocity", macro, ~macro, plan_windows(rules, macro, survey.step))
