"""Plane waves in a bar of layers: every ray that a pressure sends through them, and what a run has of it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from reflowshock.workflow.structure.exact_bar import peak

FAINTEST = 1e-9  # of the incident velocity: a weaker ray is not followed
SAME = 1e-9  # of the duration: rays closer than that arrive together
MARGIN = 0.25  # of the pulse: how far from its exact time a peak is looked for

Arrivals = list[tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Layers:
    """Layers upon each other, loaded by a pressure at the lower end, free at the upper one.

    Attributes:
        lengths: of each, bottom first [m].
        moduli: of uniaxial strain, C_33 [Pa].
        densities: [kg/m^3].
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
        """Time [s] that a wave takes from one height [m] to another, straight through."""
        ends = np.concatenate([[0.0], np.cumsum(self.lengths)])
        inside = np.clip([low, high], ends[:-1, None], ends[1:, None])
        return float(np.sum((inside[:, 1] - inside[:, 0]) / np.array(self.speeds)))

    def arrivals(self, height: float, duration: float) -> Arrivals:
        """Follow a front of velocity one that starts at the lower end, until a time [s].

        Velocities pass a joint with 2 Z1 / (Z1 + Z2) and come back with (Z1 - Z2) / (Z1 + Z2); free ends send all back
        (Graff 1975, 2.2; Achenbach 1973).

        Returns:
            Time [s] and amplitude of every ray that passes the height [m].
        """
        layer, offset = self._place(height)
        found: Arrivals = []
        waiting = {(0, 0, True): 1.0}  # (rounded time, layer that is entered, upwards) -> amplitude
        queue = [(0, 0, True)]
        tick = SAME * duration
        while queue:
            key = heappop(queue)
            amplitude, (ticks, here, upwards) = waiting.pop(key), key
            if layer == here:
                way = offset if upwards else self.lengths[here] - offset
                found.append((ticks * tick + way / self.speeds[here], amplitude))
            leaving = ticks + round(self.lengths[here] / self.speeds[here] / tick)
            if leaving * tick > duration:
                continue
            for entered, direction, share in self._split(here, upwards):
                ray, passed = (leaving, entered, direction), amplitude * share
                if ray in waiting:
                    waiting[ray] += passed
                elif abs(passed) > FAINTEST:
                    waiting[ray] = passed
                    heappush(queue, ray)
        return found

    def _place(self, height: float) -> tuple[int, float]:
        """Return the layer of a height [m], and the height above its lower end [m]."""
        bottoms = np.concatenate([[0.0], np.cumsum(self.lengths)[:-1]])
        layer = int(np.searchsorted(bottoms, height, side="right")) - 1
        return layer, height - float(bottoms[layer])

    def _split(self, layer: int, upwards: bool) -> list[tuple[int, bool, float]]:
        """Return what becomes of a ray at the end of a layer: layer that is entered, whether upwards, share."""
        beyond = layer + (1 if upwards else -1)
        if not 0 <= beyond < len(self.lengths):
            return [(layer, not upwards, 1.0)]
        own, other = self.impedances[layer], self.impedances[beyond]
        total = own + other
        return [(beyond, upwards, 2.0 * own / total), (layer, not upwards, (own - other) / total)]

    def velocity(
        self, height: float, time: NDArray[np.float64], pressure: Callable[[float], float]
    ) -> NDArray[np.float64]:
        """Return the velocity (s,) [m/s] at a height [m] and times (s,) [s] under a pressure [Pa] from time zero."""
        total = np.zeros(len(time))
        for start, amplitude in self.arrivals(height, float(time[-1])):
            total += amplitude * np.array([pressure(t) if t >= 0.0 else 0.0 for t in time - start])
        return total / self.impedances[0]


@dataclass(frozen=True, slots=True)
class Pulse:
    """The pressure on the lower end: its value [Pa] at a time [s], and its duration [s]."""

    value: Callable[[float], float]
    duration: float


def measure(
    layers: Layers, pulse: Pulse, heights: Mapping[str, float], history: Mapping[str, NDArray[np.float64]]
) -> dict[str, float]:
    """Measure speed and amplitudes in the velocities of two points of the lowest layer and one of the uppermost.

    Amplitudes are magnitudes (a thin layer sends back two of opposite signs) over the incident one, and so are their
    errors: what comes back may be nothing.

    Args:
        layers: the bar.
        pulse: the pressure.
        heights: of ``near``, ``far`` and ``beyond`` [m].
        history: ``time`` (s,) [s], and velocities (s,) [m/s] at the points.

    Returns:
        wave_speed [m/s], transmitted and reflected velocity, exact values, errors; and the ``wave_error``.
    """
    time = history["time"]
    exact = {name: layers.velocity(height, time, pulse.value) for name, height in heights.items()}
    incident = float(np.abs(exact["near"]).max())
    near, far = (
        peak(time, history[name], layers.travel(0.0, heights[name]) + 0.5 * pulse.duration, MARGIN * pulse.duration)
        for name in ("near", "far")
    )
    speed = (heights["far"] - heights["near"]) / (far[0] - near[0])
    result = {"wave_speed": speed, "wave_speed_exact": layers.speeds[0]}
    result["wave_speed_error"] = speed / layers.speeds[0] - 1.0
    for name, (point, start) in passes(layers, heights).items():
        here = (time >= start) & (time <= start + pulse.duration)
        found, right = (_largest(values[point][here]) / incident for values in (history, exact))
        result |= {name: found, f"{name}_exact": right, f"{name}_error": found - right}
    return result | {"wave_error": wave_error(layers, pulse, heights, history)}


def wave_error(
    layers: Layers, pulse: Pulse, heights: Mapping[str, float], history: Mapping[str, NDArray[np.float64]]
) -> float:
    """Return the relative L2 norm, over time and points, of the velocities' difference from the exact ones.

    Args:
        layers: the bar.
        pulse: the pressure.
        heights: of points by name [m].
        history: ``time`` (s,) [s], and velocities (s,) [m/s] at the points.
    """
    exact = np.stack([layers.velocity(height, history["time"], pulse.value) for height in heights.values()])
    found = np.stack([history[name] for name in heights])
    return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))


def passes(layers: Layers, heights: Mapping[str, float]) -> dict[str, tuple[str, float]]:
    """Return at which point, and from when on [s], each of the compared waves passes."""
    first = layers.lengths[0]
    return {
        "transmitted_velocity": ("beyond", layers.travel(0.0, heights["beyond"])),
        "reflected_velocity": ("far", layers.travel(0.0, first) + layers.travel(heights["far"], first)),
    }


def _largest(values: NDArray[np.float64]) -> float:
    """Return the largest magnitude; nan where the run has ended before."""
    return float(np.abs(values).max()) if len(values) else float("nan")
