"""A knob by itself: its rungs are compared with its own finest one, so that no other error is in theirs."""

from dataclasses import replace

from reflowshock.workflow.convergence.series import Knob, Rung


def apart(knob: Knob, finest: float) -> tuple[Knob, Rung]:
    """Return a knob whose rungs are compared with that of a finer value, and this rung.

    Args:
        knob: without that value.
        finest: finer than all of its values.
    """
    reference = replace(knob.at(finest), value=None)

    def at(value: float) -> Rung:
        return replace(knob.at(value), against=reference.name)

    return replace(knob, at=at), reference
