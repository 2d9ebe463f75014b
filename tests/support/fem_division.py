"""Divisions of meshes for tests: by the parts of the mesh, or as a naive scheme would."""

from reflowshock.fem.division.divide import held, two_steps
from reflowshock.fem.division.division import Division, Rules
from reflowshock.fem.division.whole import Survey, Whole


def by_patch(whole: Whole, found: Survey, rules: Rules) -> Division:
    """Give the meso model the board's patch and all that is no board."""
    return held(whole, found, rules, whole.mesh.in_parts(lambda name: name != "board"))


def naive(whole: Whole, found: Survey, rules: Rules) -> Division:
    """Take the window from the macro elements alone, whatever touches the cut."""
    macro = whole.mesh.in_parts("board".__eq__)
    return two_steps("held_velocity", rules, (macro, ~macro), (macro, found.step))
