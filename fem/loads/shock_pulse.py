"""Acceleration pulse of a drop shock from its parameters; imports no MPI because plans use it."""

from dataclasses import dataclass
from pathlib import Path

from reflowshock.effect import Decision
from reflowshock.fem.estimates.drop_effects import WeightEffect
from reflowshock.fem.loads.pulse import STANDARD_GRAVITY, HalfSine, Pulse, Tabulated, service_condition
from reflowshock.fem.loads.pulse_table import read_pulse
from reflowshock.fem.problem.shock import Shock


@dataclass(frozen=True, slots=True)
class ShockPulse:
    """Pulse of the shock, and the decision on gravity.

    Attributes:
        pulse: Upward acceleration of the drop table [m/s^2].
        source: Source of the pulse as text.
        gravity: Decision on gravity during the shock.
    """

    pulse: Pulse
    source: str
    gravity: Decision


def shock_pulse(shock: Shock) -> ShockPulse:
    """Return the acceleration pulse of a shock, its source as text, and the decision on gravity.

    Args:
        shock: Parameters of the shock: a table file, a JEDEC service condition, or peak and duration of a half sine.

    Returns:
        Pulse as a function of time, text on its source, and whether gravity acts during the shock, with the reason.

    Raises:
        PulseError: The table of the pulse cannot be read.
        ValueError: The shock has none of the three.
    """
    pulse, source = input_pulse(shock)
    return ShockPulse(pulse, source, WeightEffect.by_peak(shock.gravity, pulse.peak, STANDARD_GRAVITY))


def input_pulse(shock: Shock) -> tuple[HalfSine | Tabulated, str]:
    """Return the upward acceleration pulse of the drop table [m/s^2], and its source as text.

    Args:
        shock: Parameters of the shock: a table file, else a JEDEC service condition, else peak and duration of a half
            sine.

    Raises:
        PulseError: The table of the pulse cannot be read.
        ValueError: The shock has none of the three.
    """
    if shock.table is not None:
        return read_pulse(Path(shock.table), "acceleration", shock.table_column), f"table {Path(shock.table).name}"
    if shock.service_condition is not None:
        return service_condition(shock.service_condition), f"JEDEC service condition {shock.service_condition}"
    if shock.peak_acceleration is None or shock.pulse_duration is None:
        raise ValueError("a shock needs peak_acceleration and pulse_duration, a service_condition, or a table")
    return HalfSine(shock.peak_acceleration, shock.pulse_duration), "half sine"
