"""Plane waves in two joined bars: exact speeds and amplitudes, and what a run has of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MARGIN = 0.25  # of the pulse: how far from its exact time a peak is looked for


@dataclass(frozen=True, slots=True)
class Bars:
    """Two bars along z, the lower one loaded at z = 0 by a half-sine pressure.

    Attributes:
        lengths: of both [m].
        moduli: of uniaxial strain, C_33 [Pa].
        densities: [kg/m^3].
        pulse: duration of the pressure [s].
    """

    lengths: tuple[float, float]
    moduli: tuple[float, float]
    densities: tuple[float, float]
    pulse: float

    @property
    def speeds(self) -> tuple[float, float]:
        """Wave speeds c = sqrt(C_33 / rho) [m/s]."""
        lower, upper = (float(np.sqrt(m / d)) for m, d in zip(self.moduli, self.densities, strict=True))
        return lower, upper

    @property
    def impedances(self) -> tuple[float, float]:
        """Impedances Z = rho c [kg/(m^2 s)]."""
        lower, upper = (d * c for d, c in zip(self.densities, self.speeds, strict=True))
        return lower, upper

    @property
    def transmitted(self) -> float:
        """Velocity that passes the joint over the incident one, 2 Z1 / (Z1 + Z2) (Graff 1975, 2.2; Achenbach 1973)."""
        lower, upper = self.impedances
        return 2.0 * lower / (lower + upper)

    @property
    def reflected(self) -> float:
        """Velocity that comes back from the joint over the incident one, (Z1 - Z2) / (Z1 + Z2)."""
        lower, upper = self.impedances
        return (lower - upper) / (lower + upper)

    def arrival(self, height: float) -> float:
        """Time [s] at which the middle of the pulse passes a height [m] for the first time."""
        below, above = min(height, self.lengths[0]), max(height - self.lengths[0], 0.0)
        return 0.5 * self.pulse + below / self.speeds[0] + above / self.speeds[1]

    def return_time(self, height: float) -> float:
        """Time [s] at which the middle of the pulse comes back from the joint to a height [m] in the lower bar."""
        return self.arrival(self.lengths[0]) + (self.lengths[0] - height) / self.speeds[0]


def peak(time: NDArray[np.float64], value: NDArray[np.float64], about: float, width: float) -> tuple[float, float]:
    """Find the largest magnitude near a time, between the samples by the parabola through three of them.

    Args:
        time: (s,) [s], evenly spaced.
        value: (s,).
        about: where it is expected [s].
        width: how far from there at most [s].

    Returns:
        Time [s] and value; nan where the samples do not reach so far.
    """
    inside = np.flatnonzero(np.abs(time - about) <= width)
    if about + width > time[-1] or len(inside) < 3:
        return float("nan"), float("nan")
    top = int(inside[np.argmax(np.abs(value[inside]))])
    top = min(max(top, 1), len(time) - 2)
    before, at, after = value[top - 1 : top + 2]
    bend = before - 2.0 * at + after
    shift = 0.5 * (before - after) / bend if bend != 0.0 else 0.0
    return float(time[top] + shift * (time[top + 1] - time[top])), float(at - 0.25 * (before - after) * shift)


def measure(
    bars: Bars, time: NDArray[np.float64], velocity: list[NDArray[np.float64]], heights: list[float]
) -> dict[str, float]:
    """Measure speed and amplitudes in the velocities of two points of the lower bar and one of the upper bar.

    Returns:
        wave_speed [m/s]; transmitted and reflected velocity over the incident one; exact values and errors.
    """
    width = MARGIN * bars.pulse
    near, far, beyond = (peak(time, v, bars.arrival(z), width) for v, z in zip(velocity, heights, strict=True))
    back = peak(time, velocity[1], bars.return_time(heights[1]), width)
    speed = (heights[1] - heights[0]) / (far[0] - near[0])
    passed, returned = beyond[1] / far[1], back[1] / far[1]
    measured = {"wave_speed": speed, "transmitted_velocity": passed, "reflected_velocity": returned}
    exact = {
        "wave_speed": bars.speeds[0],
        "transmitted_velocity": bars.transmitted,
        "reflected_velocity": bars.reflected,
    }
    return with_errors(measured, exact)


def with_errors(measured: dict[str, float], exact: dict[str, float]) -> dict[str, float]:
    """Return what was measured, ``<name>_exact``, and ``<name>_error`` relative to the exact value."""
    errors = {f"{name}_error": value / exact[name] - 1.0 for name, value in measured.items()}
    return measured | {f"{name}_exact": value for name, value in exact.items()} | errors
