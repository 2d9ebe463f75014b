"""Plane waves in two joined bars: exact speed and amplitudes (Graff 1975, 2.2), and their values in a run."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

PEAK_WINDOW = 0.25  # half width of the search for a peak about its exact time, over the pulse duration


@dataclass(frozen=True, slots=True)
class Bars:
    """Two bars along z with a half-sine pressure at z = 0.

    Attributes:
        lengths: Lengths of the lower and the upper bar [m].
        moduli: Moduli of uniaxial strain C_33 [Pa].
        densities: Densities [kg/m^3].
        pulse: Duration of the pressure [s].
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
        """Transmitted over incident velocity at the joint, 2 Z1 / (Z1 + Z2) (Graff 1975, 2.2; Achenbach 1973)."""
        lower, upper = self.impedances
        return 2.0 * lower / (lower + upper)

    @property
    def reflected(self) -> float:
        """Reflected over incident velocity at the joint, (Z1 - Z2) / (Z1 + Z2)."""
        lower, upper = self.impedances
        return (lower - upper) / (lower + upper)

    def arrival(self, height: float) -> float:
        """Return the time at which the middle of the pulse first passes a height [s].

        Args:
            height: Height above the loaded end [m].
        """
        below, above = min(height, self.lengths[0]), max(height - self.lengths[0], 0.0)
        return 0.5 * self.pulse + below / self.speeds[0] + above / self.speeds[1]

    def return_time(self, height: float) -> float:
        """Return the time at which the middle of the reflected pulse passes a height in the lower bar [s].

        Args:
            height: Height above the loaded end [m].
        """
        return self.arrival(self.lengths[0]) + (self.lengths[0] - height) / self.speeds[0]


def peak(time: NDArray[np.float64], value: NDArray[np.float64], about: float, width: float) -> tuple[float, float]:
    """Find the peak of a sampled signal, the value of largest magnitude, within a window of time.

    The peak is interpolated by a parabola through the largest sample and its neighbours.

    Args:
        time: Evenly spaced times, shape (n,) [s].
        value: Samples of the signal, shape (n,), in any unit.
        about: Centre of the window [s].
        width: Half width of the window [s].

    Returns:
        Time [s] of the peak, and the signed value there; both nan if the samples end before the window.
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
    """Measure wave speed and amplitudes from the velocities at three points.

    Args:
        bars: Bars with their exact solution.
        time: Evenly spaced times, shape (n,) [s].
        velocity: Velocities at two points of the lower bar and one of the upper bar, each of shape (n,) [m/s].
        heights: Heights of the points [m].

    Returns:
        ``wave_speed`` [m/s], ``transmitted_velocity`` and ``reflected_velocity`` over the incident velocity, each with
        ``_exact`` and ``_error``.
    """
    width = PEAK_WINDOW * bars.pulse
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
    """Return measured values with their exact values ``<name>_exact`` and relative errors ``<name>_error``.

    Args:
        measured: Measured values by name.
        exact: Exact values by the same names.

    Returns:
        Name -> measured value, ``<name>_exact`` -> exact value, ``<name>_error`` -> relative error.
    """
    errors = {f"{name}_error": value / exact[name] - 1.0 for name, value in measured.items()}
    return measured | {f"{name}_exact": value for name, value in exact.items()} | errors
