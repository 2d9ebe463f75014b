"""Pulses: the value of a load over time, with exact first and second integrals."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

STANDARD_GRAVITY = 9.80665

# JESD22-B104C and JESD22-B110A, table 1: peak acceleration [G] and duration [ms] of the half sine; B is also the pulse
# of JESD22-B111. The velocity changes of that table, 2 A tau / pi, agree (e.g. 1500 G, 0.5 ms: 4.68 m/s).
SERVICE_CONDITIONS: dict[str, tuple[float, float]] = {
    "A": (500.0, 1.0),
    "B": (1500.0, 0.5),
    "C": (100.0, 2.0),
    "D": (200.0, 1.5),
    "E": (340.0, 1.2),
    "F": (900.0, 0.7),
    "G": (2000.0, 0.4),
    "H": (2900.0, 0.3),
}


class Pulse(Protocol):
    """Value of a load over time, with its integrals from time zero."""

    def value(self, time: float) -> float:
        """Return the value at a time [s]."""

    def integral(self, time: float) -> float:
        """Return the integral of the value from zero to a time [s]."""

    def double_integral(self, time: float) -> float:
        """Return the integral of ``integral`` from zero to a time [s]."""


@dataclass(frozen=True, slots=True)
class HalfSine:
    """Half sine: A sin(pi t / tau) up to the time tau, then zero.

    Attributes:
        peak: Amplitude A, in the unit of the load.
        duration: Duration tau [s].
    """

    peak: float
    duration: float

    def value(self, time: float) -> float:
        """Return the value at a time [s]."""
        return float(self.peak * np.sin(np.pi * time / self.duration)) if 0.0 < time < self.duration else 0.0

    def integral(self, time: float) -> float:
        """Return the integral up to a time [s]; 2 A tau / pi from tau on."""
        angle = np.pi * min(max(time, 0.0), self.duration) / self.duration
        return float(self.peak * self.duration / np.pi * (1.0 - np.cos(angle)))

    def double_integral(self, time: float) -> float:
        """Return the second integral up to a time [s]."""
        inside = min(max(time, 0.0), self.duration)
        scale = self.duration / np.pi
        within = self.peak * scale * (inside - scale * np.sin(inside / scale))
        return float(within + self.integral(time) * max(time - self.duration, 0.0))


@dataclass(frozen=True, slots=True)
class Haversine:
    """Haversine: A sin^2(pi t / tau) up to the time tau, then zero; it starts and ends with zero slope.

    Attributes:
        peak: Amplitude A, in the unit of the load.
        duration: Duration tau [s].
    """

    peak: float
    duration: float

    def value(self, time: float) -> float:
        """Return the value at a time [s]."""
        return float(self.peak * np.sin(np.pi * time / self.duration) ** 2) if 0.0 < time < self.duration else 0.0

    def integral(self, time: float) -> float:
        """Return the integral up to a time [s]; A tau / 2 from tau on."""
        inside, rate = min(max(time, 0.0), self.duration), 2.0 * np.pi / self.duration
        return float(0.5 * self.peak * (inside - np.sin(rate * inside) / rate))

    def double_integral(self, time: float) -> float:
        """Return the second integral up to a time [s]."""
        inside, rate = min(max(time, 0.0), self.duration), 2.0 * np.pi / self.duration
        within = 0.5 * self.peak * (0.5 * inside**2 - (1.0 - np.cos(rate * inside)) / rate**2)
        return float(within + self.integral(time) * max(time - self.duration, 0.0))


@dataclass(frozen=True, slots=True)
class Constant:
    """Constant value from time zero up to a duration [s]."""

    peak: float
    duration: float = np.inf

    def value(self, time: float) -> float:
        """Return the value at a time [s]; unlike the other pulses it acts at time zero."""
        return self.peak if 0.0 <= time < self.duration else 0.0

    def integral(self, time: float) -> float:
        """Return the integral up to a time [s]."""
        return self.peak * min(max(time, 0.0), self.duration)

    def double_integral(self, time: float) -> float:
        """Return the second integral up to a time [s]."""
        inside = min(max(time, 0.0), self.duration)
        return 0.5 * self.peak * inside**2 + self.peak * inside * max(time - inside, 0.0)


@dataclass(frozen=True, slots=True)
class Tabulated:
    """Tabulated values, linear in between, zero before the first and after the last time.

    Attributes:
        times: Increasing times from zero or later, shape (n,) [s].
        values: Values in the unit of the load, shape (n,).
    """

    times: NDArray[np.float64]
    values: NDArray[np.float64]
    _integrals: NDArray[np.float64] = field(init=False)
    _doubles: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        """Integrate up to each time."""
        width, low, high = np.diff(self.times), self.values[:-1], self.values[1:]
        integrals = np.concatenate([[0.0], np.cumsum(0.5 * width * (low + high))])
        within = integrals[:-1] * width + width**2 * (2.0 * low + high) / 6.0
        object.__setattr__(self, "_integrals", integrals)
        object.__setattr__(self, "_doubles", np.concatenate([[0.0], np.cumsum(within)]))

    @property
    def duration(self) -> float:
        """Last time of the table [s]."""
        return float(self.times[-1])

    @property
    def peak(self) -> float:
        """Largest absolute value, in the unit of the load."""
        return float(np.abs(self.values).max())

    def value(self, time: float) -> float:
        """Return the value at a time [s]."""
        return float(np.interp(time, self.times, self.values, left=0.0, right=0.0))

    def integral(self, time: float) -> float:
        """Return the integral up to a time [s]."""
        row, past = self._row(time)
        return float(self._integrals[row] + 0.5 * past * (self.values[row] + self.value(self.times[row] + past)))

    def double_integral(self, time: float) -> float:
        """Return the second integral up to a time [s]."""
        row, past = self._row(time)
        last = self.value(self.times[row] + past)
        inside = self._integrals[row] * past + past**2 * (2.0 * self.values[row] + last) / 6.0
        beyond = self.integral(time) * max(time - float(self.times[-1]), 0.0)
        return float(self._doubles[row] + inside + beyond)

    def _row(self, time: float) -> tuple[int, float]:
        """Return the row of the latest tabulated time up to a time [s], and the time since then inside the table."""
        inside = min(max(time, float(self.times[0])), float(self.times[-1]))
        row = int(np.searchsorted(self.times, inside, side="right")) - 1
        return row, inside - float(self.times[row])


def service_condition(name: str) -> HalfSine:
    """Return the half-sine acceleration pulse of a JEDEC service condition, peak [m/s^2] and duration [s].

    Args:
        name: Letter "A" to "H", a key of ``SERVICE_CONDITIONS``.
    """
    peak, milliseconds = SERVICE_CONDITIONS[name]
    return HalfSine(peak * STANDARD_GRAVITY, milliseconds * 1e-3)
