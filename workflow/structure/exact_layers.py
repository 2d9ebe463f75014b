"""Plane waves in a layered bar: exact solution by tracing all rays, and its values in a run (Graff 1975, 2.2)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from reflowshock.workflow.structure.exact_bar import peak

MIN_AMPLITUDE = 1e-9  # over the incident velocity: weaker rays are dropped
TIME_RESOLUTION = 1e-9  # over the duration: closer arrivals are merged
PEAK_WINDOW = 0.25  # half width of the search for a peak about its exact time, over the pulse duration

Arrivals = list[tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Layers:
    """Stack of layers with a pressure at the lower end and a free upper end.

    Attributes:
        lengths: Thicknesses, bottom first [m].
        moduli: Moduli of uniaxial strain C_33 [Pa].
        densities: Densities [kg/m^3].
    """

    lengths: tuple[float, ...]
    moduli: tuple[float, ...]
    densities: tuple[float, ...]

    @property
    def speeds(self) -> tuple[float, ...]:
        """Wave speeds c = sqrt(C_33 / rho) [m/s]."""
        return tuple(float(np.sqrt(m / d)) for m, d in zip(self.moduli, self.densities, strict=True))

    @property
    def impedances(self) -> tuple[float, ...]:
        """Impedances Z = rho c [kg/(m^2 s)]."""
        return tuple(d * c for d, c in zip(self.densities, self.speeds, strict=True))

    def travel(self, low: float, high: float) -> float:
        """Return the travel time of a wave between two heights without reflection [s]."""
        ends = np.concatenate([[0.0], np.cumsum(self.lengths)])
        inside = np.clip([low, high], ends[:-1, None], ends[1:, None])
        return float(np.sum((inside[:, 1] - inside[:, 0]) / np.array(self.speeds)))

    def arrivals(self, height: float, duration: float) -> Arrivals:
        """Trace a front of unit velocity that starts at the lower end at time zero.

        An interface transmits the velocity 2 Z1 / (Z1 + Z2) and reflects (Z1 - Z2) / (Z1 + Z2); free ends reflect all
        of it (Graff 1975, 2.2; Achenbach 1973).

        Args:
            height: Height at which rays are recorded [m].
            duration: End of the tracing [s].

        Returns:
            Time [s] and amplitude of every ray that passes the height.
        """
        layer, offset = self._layer_at(height)
        passing: Arrivals = []
        waiting = {(0, 0, True): 1.0}  # (rounded time, entered layer, upwards) -> amplitude
        queue = [(0, 0, True)]
        tick = TIME_RESOLUTION * duration
        while queue:
            key = heappop(queue)
            amplitude, (ticks, here, upwards) = waiting.pop(key), key
            if layer == here:
                distance = offset if upwards else self.lengths[here] - offset
                passing.append((ticks * tick + distance / self.speeds[here], amplitude))
            leaving = ticks + round(self.lengths[here] / self.speeds[here] / tick)
            if leaving * tick > duration:
                continue
            for entered, direction, share in self._split(here, upwards):
                ray, passed = (leaving, entered, direction), amplitude * share
                if ray in waiting:
                    waiting[ray] += passed
                elif abs(passed) > MIN_AMPLITUDE:
                    waiting[ray] = passed
                    heappush(queue, ray)
        return passing

    def _layer_at(self, height: float) -> tuple[int, float]:
        """Return the layer that contains a height, and the height above its lower end [m]."""
        bottoms = np.concatenate([[0.0], np.cumsum(self.lengths)[:-1]])
        layer = int(np.searchsorted(bottoms, height, side="right")) - 1
        return layer, height - float(bottoms[layer])

    def _split(self, layer: int, upwards: bool) -> list[tuple[int, bool, float]]:
        """Split a ray at the end of a layer into parts: entered layer, whether upwards, share of the amplitude."""
        beyond = layer + (1 if upwards else -1)
        if not 0 <= beyond < len(self.lengths):
            return [(layer, not upwards, 1.0)]
        incident, other = self.impedances[layer], self.impedances[beyond]
        total = incident + other
        return [(beyond, upwards, 2.0 * incident / total), (layer, not upwards, (incident - other) / total)]

    def velocity(
        self, height: float, time: NDArray[np.float64], pressure: Callable[[float], float]
    ) -> NDArray[np.float64]:
        """Return the exact velocity at a height, shape (n,) [m/s].

        Args:
            height: Height above the loaded end [m].
            time: Times, shape (n,) [s].
            pressure: Pressure [Pa] as a function of time [s], zero before time zero.
        """
        total = np.zeros(len(time))
        for start, amplitude in self.arrivals(height, float(time[-1])):
            total += amplitude * np.array([pressure(t) if t >= 0.0 else 0.0 for t in time - start])
        return total / self.impedances[0]


@dataclass(frozen=True, slots=True)
class Pulse:
    """Pressure on the lower end: its value [Pa] as a function of time [s], and its duration [s]."""

    value: Callable[[float], float]
    duration: float


def measure(
    layers: Layers, pulse: Pulse, heights: Mapping[str, float], history: Mapping[str, NDArray[np.float64]]
) -> dict[str, float]:
    """Measure wave speed and amplitudes from the velocities at two points of the lowest layer and one of the top layer.

    Amplitudes are magnitudes over the incident one, since a thin layer reflects two waves of opposite signs. Their
    errors are also relative to the incident amplitude, since the reflected one may vanish.

    Args:
        layers: Layers of the bar.
        pulse: Pressure on the lower end.
        heights: Heights of the points ``near``, ``far`` and ``beyond`` [m].
        history: ``time``, shape (n,) [s], and the velocity at each point, shape (n,) [m/s].

    Returns:
        ``wave_speed`` [m/s], ``transmitted_velocity`` and ``reflected_velocity``, each with ``_exact`` and ``_error``,
        and ``wave_error``.
    """
    time = history["time"]
    exact = {name: layers.velocity(height, time, pulse.value) for name, height in heights.items()}
    incident = float(np.abs(exact["near"]).max())
    near, far = (
        peak(
            time, history[name], layers.travel(0.0, heights[name]) + 0.5 * pulse.duration, PEAK_WINDOW * pulse.duration
        )
        for name in ("near", "far")
    )
    speed = (heights["far"] - heights["near"]) / (far[0] - near[0])
    result = {"wave_speed": speed, "wave_speed_exact": layers.speeds[0]}
    result["wave_speed_error"] = speed / layers.speeds[0] - 1.0
    for name, (point, start) in passage_times(layers, heights).items():
        here = (time >= start) & (time <= start + pulse.duration)
        computed, expected = (_largest(values[point][here]) / incident for values in (history, exact))
        result |= {name: computed, f"{name}_exact": expected, f"{name}_error": computed - expected}
    return result | {"wave_error": wave_error(layers, pulse, heights, history)}


def wave_error(
    layers: Layers, pulse: Pulse, heights: Mapping[str, float], history: Mapping[str, NDArray[np.float64]]
) -> float:
    """Return the relative L2 error of the velocities over all times and points, against the exact solution.

    Args:
        layers: Layers of the bar.
        pulse: Pressure on the lower end.
        heights: Heights of the points by name [m].
        history: ``time``, shape (n,) [s], and the velocity at each point, shape (n,) [m/s].
    """
    exact = np.stack([layers.velocity(height, history["time"], pulse.value) for height in heights.values()])
    computed = np.stack([history[name] for name in heights])
    return float(np.linalg.norm(computed - exact) / np.linalg.norm(exact))


def passage_times(layers: Layers, heights: Mapping[str, float]) -> dict[str, tuple[str, float]]:
    """Return when the transmitted and the reflected wave pass the points at which they are compared.

    Args:
        layers: Layers of the bar.
        heights: Heights of the points ``far`` and ``beyond`` [m].

    Returns:
        ``transmitted_velocity`` and ``reflected_velocity`` -> name of the point and arrival time of the wave there [s].
    """
    first = layers.lengths[0]
    return {
        "transmitted_velocity": ("beyond", layers.travel(0.0, heights["beyond"])),
        "reflected_velocity": ("far", layers.travel(0.0, first) + layers.travel(heights["far"], first)),
    }


def _largest(values: NDArray[np.float64]) -> float:
    """Return the largest magnitude, or nan for an empty array (the run ends before the wave arrives)."""
    return float(np.abs(values).max()) if len(values) else float("nan")
