"""The course of a drop shock: from its parameters to the acceleration of the table. Loads no MPI: plans read it."""

from dataclasses import dataclass
from pathlib import Path

from reflowshock.effect import Decision
from reflowshock.fem.estimates.drop_effects import WeightEffect
from reflowshock.fem.loads.pulse import STANDARD_GRAVITY, HalfSine, Pulse, Tabulated, service_condition
from reflowshock.fem.loads.pulse_table import read_pulse
from reflowshock.fem.problem.shock import Shock


@dataclass(frozen=True, slots=True)
class ShockPulse:
    """The course of the shock, and whether weight acts beside it.

    Attributes:
        pulse: Upward acceleration of the table [m/s^2].
        source: Where it comes from, in words.
        gravity: Whether weight acts, and why.
    """

    pulse: Pulse
    source: str
    gravity: Decision


def shock_pulse(shock: Shock) -> ShockPulse:
    """Return the pulse of a shock.

    Raises:
        PulseError: A table cannot be read.
    """
    pulse, source = input_pulse(shock)
    return ShockPulse(pulse, source, WeightEffect.beside(shock.gravity, pulse.peak, STANDARD_GRAVITY))


def input_pulse(shock: Shock) -> tuple[HalfSine | Tabulated, str]:
    """Return the acceleration of the drop table [m/s^2], and where it comes from; errors as ``shock_pulse``."""
    if shock.table is not None:
        return read_pulse(Path(shock.table), "acceleration", shock.table_column), f"table {Path(shock.table).name}"
    if shock.service_condition is not None:
        return service_condition(shock.service_condition), f"JEDEC service condition {shock.service_condition}"
    if shock.peak_acceleration is None or shock.pulse_duration is None:
        raise ValueError("a shock needs peak_acceleration and pulse_duration, a service_condition, or a table")
    return HalfSine(shock.peak_acceleration, shock.pulse_duration), "half sine"
