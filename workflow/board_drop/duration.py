"""Duration of a drop: as the case sets it, or at most one period of the board after the pulse."""

import math
from typing import TYPE_CHECKING

from reflowshock.workflow.board_drop.fittings import spans

if TYPE_CHECKING:
    from reflowshock.workflow.package.case import BoardDropCase


def longest_duration(case: "BoardDropCase") -> float:
    """Return the longest duration of a shock [s]; if it is ``auto``, one period of the board after the pulse.

    The board is taken as a pinned beam; screws shorten the real period.

    Raises:
        PulseError: The table of the pulse cannot be read.
    """
    from reflowshock.fem.loads.shock_pulse import input_pulse

    if case.shock.duration != "auto":
        return case.shock.duration
    pulse, _ = input_pulse(case.shock)
    return pulse.duration + math.tau / first_mode(case)[1]


def first_mode(case: "BoardDropCase") -> tuple[float, float]:
    """Return length [m] and angular frequency [rad/s] of the board as a beam pinned at its holes.

    Fitted masses are placed at the middle, where they lower the frequency most.
    """
    board, axis = case.board, bending_axis(case)
    length, young = spans(board)[axis], case.materials.board.engineering_constants.young[axis]
    density = case.materials.board.density + 2.0 * fitted_mass(case) / (board.length * board.width * board.thickness)
    stiffness = young * board.thickness * board.thickness / 12.0 / density
    return length, (math.pi / length) ** 2 * math.sqrt(stiffness)


def bending_axis(case: "BoardDropCase") -> int:
    """Return the axis that the first mode bends along, 0 for x or 1 for y: the holes are farther apart along it."""
    young = case.materials.board.engineering_constants.young
    return max((0, 1), key=lambda axis: (spans(case.board)[axis], young[axis]))


def fitted_mass(case: "BoardDropCase") -> float:
    """Return an upper bound of the lumped masses and further packages on the whole board [kg].

    Mirror images are included.
    """
    images = 4.0 if case.board.symmetry == "quarter" else 1.0
    roles = case.materials
    packages = sum(
        item.rows * item.columns * item.post**2 * item.standoff * roles.solder.density
        + math.prod(item.substrate) * roles.substrate.density
        + math.prod(item.die) * roles.die.density
        for item in case.packages.values()
    )
    return images * (packages + sum(item.mass for item in case.masses.values()))
