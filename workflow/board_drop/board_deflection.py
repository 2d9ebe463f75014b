"""How far the board of a drop will about deflect, from its parameters alone, and what small kinematics leave out."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from reflowshock.effect import Decision
from reflowshock.fem.estimates.drop_effects import Deflection, called_for
from reflowshock.fem.materials.kinematics import Kinematics
from reflowshock.workflow.board_drop.duration import first_mode, longest_duration

if TYPE_CHECKING:
    from reflowshock.fem.materials.parameters import Material
    from reflowshock.fem.problem.shock import Shock
    from reflowshock.workflow.package.case import BoardDropCase

SHARE = 4.0 / math.pi  # of the base's acceleration in the first mode of a pinned beam, at its middle
SAMPLES, SAMPLES_A_PERIOD = 1000, 100
MOST_PERIODS = 1000  # that are looked at: no pulse of a drop lasts longer


def expected_deflection(case: "BoardDropCase") -> Deflection:
    """Return how far the board deflects at small rotations; PulseError where a table of its pulse cannot be read.

    The board is a beam between its holes in its first mode, q'' + omega^2 q = 4/pi a(t): w = q sin(pi x/L).
    Width, package and later modes are left out.
    """
    from reflowshock.fem.loads.shock_pulse import shock_pulse

    length, omega = first_mode(case)
    deflection = first_mode_peak(omega, shock_pulse(case.shock).pulse.integral, longest_duration(case))
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


def decide_kinematics(case: "BoardDropCase") -> tuple[Kinematics, str]:
    """Return the kinematics that the deflection of the board calls for, and why; errors as ``expected_deflection``."""
    return called_for(expected_deflection(case).largest / case.board.thickness, case.cooled)


def decided(case: "BoardDropCase") -> "BoardDropCase":
    """Return the case with the kinematics and the duration that its scene calls for.

    Raises:
        PulseError: the table of the pulse cannot be read.
    """
    update: dict[str, Any] = {"duration": longest_duration(case)}
    if case.shock.numerics.kinematics == "auto":
        update["numerics"] = case.shock.numerics.model_copy(update={"kinematics": decide_kinematics(case)[0]})
    return case.model_copy(update={"shock": case.shock.model_copy(update=update)})


@dataclass(frozen=True)
class DropScene:
    """A case as effects see it, a ``Drop``; PulseError where a table of its pulse cannot be read."""

    case: "BoardDropCase"

    @property
    def shock(self) -> "Shock":
        """Its parameters."""
        return self.case.shock

    @property
    def materials(self) -> "Mapping[str, Material]":
        """Role -> material."""
        return self.case.materials.by_role

    @property
    def thickness(self) -> float:
        """Of the board [m]."""
        return self.case.board.thickness

    @property
    def symmetry(self) -> Literal["full", "quarter"]:
        """Of the model."""
        return self.case.board.symmetry

    @property
    def weight(self) -> Decision:
        """Whether weight acts, from g over the peak acceleration."""
        from reflowshock.fem.loads.shock_pulse import shock_pulse

        return shock_pulse(self.case.shock).gravity

    @property
    def cooled(self) -> bool:
        """Whether the shock begins with the stress of cooling."""
        return self.case.cooled

    @property
    def duration(self) -> float:
        """How long it is followed, at most [s]."""
        return longest_duration(self.case)

    @cached_property
    def expected(self) -> Deflection:
        """How the shock bends the board."""
        return expected_deflection(self.case)

    @property
    def bent_by_weight(self) -> float:
        """Deflection of the board [m] by weight alone."""
        from reflowshock.fem.loads.pulse import STANDARD_GRAVITY

        return first_mode_peak(self.expected.omega, lambda time: STANDARD_GRAVITY * time, self.duration)
