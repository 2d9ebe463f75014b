"""How far the board of a drop will about deflect, from its parameters alone, and what small kinematics leave out."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from reflowshock.fem.estimates.effects import STIFFENING_OF_BOARD, called_for, effect, stiffened

if TYPE_CHECKING:
    from reflowshock.workflow.package.case import BoardDropCase

SHARE = 4.0 / math.pi  # of the base's acceleration in the first mode of a pinned beam, at its middle
SAMPLES, SAMPLES_A_PERIOD = 1000, 100
MOST_PERIODS = 1000  # that are looked at: no pulse of a drop lasts longer


class Deflection(NamedTuple):
    """Largest deflection of a board's middle [m], of its slope, and the angular frequency of the mode [rad/s]."""

    largest: float
    slope: float
    omega: float


def expected_deflection(case: "BoardDropCase") -> Deflection:
    """Return how far the board deflects at small rotations; PulseError where a table of its pulse cannot be read.

    The board is a beam between its holes in its first mode, q'' + omega^2 q = 4/pi a(t): w = q sin(pi x/L).
    Width, package and later modes are left out.
    """
    from reflowshock.fem.loads.shock_pulse import shock_pulse

    board, (young_x, young_y, _) = case.board, case.materials.board.engineering_constants.young
    holes = board.holes
    spans = ((board.length - 2.0 * holes.inset_x, young_x), (board.width - 2.0 * holes.inset_y, young_y))
    length, young = max(spans)
    stiffness = young * board.thickness * board.thickness / 12.0 / case.materials.board.density
    omega = (math.pi / length) ** 2 * math.sqrt(stiffness)
    deflection = first_mode_peak(omega, shock_pulse(case.shock).pulse.integral, case.shock.duration)
    return Deflection(deflection, math.pi / length * deflection, omega)


def first_mode_peak(omega: float, velocity: Callable[[float], float], duration: float) -> float:
    """Return the largest |q| [m] of q'' + omega^2 q = 4/pi a(t) from rest, by Duhamel's integral.

    Args:
        omega: angular frequency [rad/s].
        velocity: integral of a from 0 to a time [m/s].
        duration: of what is looked at [s].
    """
    duration = min(duration, MOST_PERIODS * math.tau / omega)
    count = max(SAMPLES, math.ceil(SAMPLES_A_PERIOD * omega * duration / math.tau))
    ends = np.linspace(0.0, duration, count + 1)
    middle = 0.5 * (ends[1:] + ends[:-1])
    pushes = SHARE * np.diff([velocity(moment) for moment in ends])
    swing = np.sin(omega * middle) * np.cumsum(pushes * np.cos(omega * middle))
    swing -= np.cos(omega * middle) * np.cumsum(pushes * np.sin(omega * middle))
    return float(np.abs(swing).max()) / omega


def decide_kinematics(case: "BoardDropCase") -> tuple[Literal["small", "finite"], str]:
    """Return the kinematics that the deflection of the board calls for, and why; errors as ``expected_deflection``."""
    return called_for(expected_deflection(case).largest / case.board.thickness)


def decided(case: "BoardDropCase") -> "BoardDropCase":
    """Return the case with kinematics that are small or finite, as its board's deflection calls for.

    Raises:
        PulseError: the table of the pulse cannot be read.
    """
    if case.shock.numerics.kinematics != "auto":
        return case
    numerics = case.shock.numerics.model_copy(update={"kinematics": decide_kinematics(case)[0]})
    return case.model_copy(update={"shock": case.shock.model_copy(update={"numerics": numerics})})


def kinematics_effect(case: "BoardDropCase") -> dict:
    """Return whether rotations are finite, why, and what small ones would leave out, as an effect of a plan."""
    from reflowshock.fem.materials.kinematics import finite_rotation

    expected, kinematics = expected_deflection(case), case.shock.numerics.kinematics
    ratio = expected.largest / case.board.thickness
    wanted, reason = called_for(ratio)
    taken = wanted if kinematics == "auto" else kinematics
    finite, why = finite_rotation("shock.numerics", taken, 0.5 * expected.slope**2)
    if kinematics == "auto":
        why = f"shock.numerics.kinematics = auto: {reason}"
    elif not finite:
        why += "" if wanted == "small" else "; auto would choose finite"
    why = f"the board is expected to deflect by about {ratio:.3g} times its thickness; {why}"
    return {"finite_rotation": effect(finite, why, stiffened(ratio, STIFFENING_OF_BOARD))}


def weight_effect(case: "BoardDropCase") -> dict:
    """Return whether weight acts in the shock, why, and how far alone it bends the board, as an effect of a plan.

    It lasts, and a pulse does not: a board that is slow against the pulse feels it more than g over the peak says.
    """
    from reflowshock.fem.loads.pulse import STANDARD_GRAVITY
    from reflowshock.fem.loads.shock_pulse import shock_pulse

    expected = expected_deflection(case)
    alone = first_mode_peak(expected.omega, lambda time: STANDARD_GRAVITY * time, case.shock.duration)
    influence = min(1.0, alone / expected.largest) if expected.largest > 0.0 else 1.0
    return {"gravity_in_the_shock": shock_pulse(case.shock).gravity | {"influence": influence}}
