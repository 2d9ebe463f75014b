"""Accelerations of watch points from their histories, filtered, and their peaks. Plain NumPy and SciPy.

A second difference of the displacements at three samples is the mean of the acceleration between them, weighted with a
triangle: it folds nothing of what is faster than the samples into them. What is slower than a tenth of their rate loses
less than 4 %.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.loads.pulse import STANDARD_GRAVITY, Pulse
from reflowshock.fem.problem.filters import LowPass
from reflowshock.fem.problem.fittings import WatchPoint
from reflowshock.fem.problem.load_kinds import InputG
from reflowshock.fem.problem.structure import StructureProblem

TABLE = (0.0, 0.0, -1.0)  # direction in which the table of a drop is accelerated: the package faces down
RATE = 10.0  # samples in a period of the filter's corner that are needed


@dataclass(frozen=True, slots=True)
class Acceleration:
    """What an accelerometer at a point would read.

    Attributes:
        time: ``(n,)`` [s].
        raw: ``(n,)`` [m/s^2].
        filtered: ``(n,)`` [m/s^2].
    """

    time: NDArray[np.float64]
    raw: NDArray[np.float64]
    filtered: NDArray[np.float64]

    @property
    def peaks(self) -> tuple[int, int]:
        """Return the places of the largest value, and of the largest of opposite sign after it."""
        first = int(np.argmax(np.abs(self.filtered)))
        opposite = -np.sign(self.filtered[first]) * self.filtered[first:]
        return first, first + int(np.argmax(opposite))

    def peaks_in_g(self, name: str) -> dict[str, float]:
        """Return the magnitudes of both peaks [G] as metrics; the second is zero where the sign never changes."""
        first, second = self.peaks
        largest, opposite = abs(self.filtered[first]), -np.sign(self.filtered[first]) * self.filtered[second]
        return {
            f"peak_acceleration@{name}": float(largest) / STANDARD_GRAVITY,
            f"second_peak_acceleration@{name}": max(float(opposite), 0.0) / STANDARD_GRAVITY,
        }


def low_passed(values: NDArray[np.float64], step: float, low_pass: LowPass) -> NDArray[np.float64]:
    """Filter samples ``(n,)`` at equal steps [s] forwards and backwards.

    Beyond its ends the record goes on as its mirror image at the end points, over two periods of the corner.

    Raises:
        ValueError: There are fewer than two samples in a period of the filter's corner.
    """
    from scipy.signal import butter, sosfiltfilt

    order, corner = low_pass.passes
    if 2.0 * corner * step >= 1.0:
        raise ValueError(f"{1.0 / step:.4g} samples a second are too few for a filter with {low_pass.label}")
    sections = butter(order, corner, fs=1.0 / step, output="sos")
    return sosfiltfilt(sections, values, padlen=min(len(values) - 1, math.ceil(2.0 / (corner * step))))


def is_sampled(time: NDArray[np.float64], low_pass: LowPass) -> bool:
    """Return whether samples at times ``(n,)`` [s] are close enough, and last long enough, for a filter."""
    step = float(time[-1] - time[0]) / max(len(time) - 1, 1)
    return len(time) > RATE and step * RATE * low_pass.frequency <= 1.0 + 1e-9


def acceleration(time: NDArray[np.float64], displacement: NDArray[np.float64], low_pass: LowPass) -> Acceleration:
    """Return the acceleration of absolute displacements ``(n,)`` [m] at equal steps ``time (n,)`` [s], from rest."""
    step = float(time[-1] - time[0]) / (len(time) - 1)
    raw = np.diff(displacement, n=2) / step**2
    return Acceleration(time[1:-1], raw, low_passed(raw, step, low_pass))


def peaks_of(found: Mapping[str, Acceleration], low_pass: LowPass) -> dict[str, dict[str, Any]]:
    """Return the peaks [G] of some accelerations as metrics, with their filter; nothing of none."""
    peaks = {
        metric: {"value": value, "unit": "G"}
        for name, course in found.items()
        for metric, value in course.peaks_in_g(name).items()
    }
    return peaks | {"acceleration_filter": {"value": low_pass.label, "unit": ""}} if found else {}


def base_displacement(
    time: NDArray[np.float64], problem: StructureProblem, pulses: Mapping[str, Pulse]
) -> NDArray[np.float64]:
    """Return where the supports are ``(n, 3)`` [m] at some times ``(n,)`` [s]."""
    moved = np.zeros((len(time), 3))
    for name, load in problem.loads.items():
        if isinstance(load, InputG):
            along = np.array(load.direction) / np.linalg.norm(load.direction)
            moved += np.outer([pulses[name].double_integral(one) for one in time], along)
    return moved


def watch_accelerations(
    arrays: Mapping[str, NDArray], problem: StructureProblem, pulses: Mapping[str, Pulse]
) -> dict[str, Acceleration]:
    """Return the acceleration of each watch point in space, none where samples are too far apart for the filter.

    Args:
        arrays: Of a history.
        problem: The structure.
        pulses: Of its loads.
    """
    time, low_pass = arrays["time"], problem.dynamics.filter
    if not is_sampled(time, low_pass):
        return {}
    base = base_displacement(time, problem, pulses)
    shaken = [np.array(load.direction) for load in problem.loads.values() if isinstance(load, InputG)]
    found = {}
    for name, point in problem.watch.items():
        place = base + arrays[f"displacement@{name}"]
        given = np.array(point.direction) if point.direction else shaken[0] if shaken else None
        along = np.eye(3)[np.ptp(place, axis=0).argmax()] if given is None else given / np.linalg.norm(given)
        found[name] = acceleration(time, place @ along, low_pass)
    return found


def drop_accelerations(
    arrays: Mapping[str, NDArray], pulse: Pulse, low_pass: LowPass, watch: Mapping[str, WatchPoint]
) -> dict[str, Acceleration]:
    """Return that of the package's centre and of each watch point in space, none where samples are too far apart.

    Args:
        arrays: Of the history of a drop: displacements relative to the table, along z against its acceleration.
        pulse: Acceleration of the table [m/s^2].
        low_pass: The filter.
        watch: Points whose accelerometer may have a direction, else that of the table's motion.
    """
    time = arrays["time"]
    if not is_sampled(time, low_pass):
        return {}
    table = np.outer([pulse.double_integral(one) for one in time], TABLE)
    places = {"package": arrays["die_centre"]} if arrays["die_centre"].any() else {}
    places |= {name: arrays[f"displacement@{name}"] for name in watch}
    found = {}
    for name, place in places.items():
        along = np.array((watch[name].direction if name in watch else None) or TABLE)
        found[name] = acceleration(time, (table + place) @ along / np.linalg.norm(along), low_pass)
    return found
