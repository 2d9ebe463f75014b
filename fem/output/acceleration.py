"""Filtered accelerations of watch points from displacement histories, and their peaks.

The second difference of the displacements at three samples is the triangle-weighted mean of the acceleration between
them, so frequencies above the sampling rate cause no aliasing. Frequencies below a tenth of the sampling rate lose less
than 4 % of their amplitude.
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

TABLE = (0.0, 0.0, -1.0)  # direction of the drop table's acceleration, with the package facing down
RATE = 10.0  # required samples per period of the filter's corner frequency


@dataclass(frozen=True, slots=True)
class Acceleration:
    """Acceleration history at a point along one direction, as an accelerometer would measure it.

    Attributes:
        time: Sample times, shape (n,) [s].
        raw: Unfiltered acceleration, shape (n,) [m/s^2].
        filtered: Filtered acceleration, shape (n,) [m/s^2].
    """

    time: NDArray[np.float64]
    raw: NDArray[np.float64]
    filtered: NDArray[np.float64]

    @property
    def peaks(self) -> tuple[int, int]:
        """Samples of the largest magnitude, and of the largest later value of opposite sign."""
        first = int(np.argmax(np.abs(self.filtered)))
        opposite = -np.sign(self.filtered[first]) * self.filtered[first:]
        return first, first + int(np.argmax(opposite))

    def peaks_in_g(self, name: str) -> dict[str, float]:
        """Return the magnitudes of both peaks [G] as metrics; the second is zero if the sign does not change."""
        first, second = self.peaks
        largest, opposite = abs(self.filtered[first]), -np.sign(self.filtered[first]) * self.filtered[second]
        return {
            f"peak_acceleration@{name}": float(largest) / STANDARD_GRAVITY,
            f"second_peak_acceleration@{name}": max(float(opposite), 0.0) / STANDARD_GRAVITY,
        }


def apply_low_pass(values: NDArray[np.float64], step: float, low_pass: LowPass) -> NDArray[np.float64]:
    """Return samples filtered forwards and backwards, so that the phase is unchanged, shape (n,).

    The record is extended at both ends by its mirror image at the end point, over two periods of the corner frequency.

    Args:
        values: Samples at equal steps, shape (n,).
        step: Sampling step [s].
        low_pass: Filter with its order and corner frequency.

    Raises:
        ValueError: The step is above half a period of the corner frequency.
    """
    from scipy.signal import butter, sosfiltfilt

    order, corner = low_pass.passes
    if 2.0 * corner * step >= 1.0:
        raise ValueError(f"{1.0 / step:.4g} samples per second are too few for a filter with {low_pass.label}")
    sections = butter(order, corner, fs=1.0 / step, output="sos")
    return sosfiltfilt(sections, values, padlen=min(len(values) - 1, math.ceil(2.0 / (corner * step))))


def is_sampled(time: NDArray[np.float64], low_pass: LowPass) -> bool:
    """Return whether equal sample times are dense and long enough to apply a low-pass filter.

    There must be at least ``RATE`` samples in a period of the corner frequency, and more than ``RATE`` in all.

    Args:
        time: Sample times, shape (n,) [s].
        low_pass: Filter with its corner frequency [Hz].
    """
    step = float(time[-1] - time[0]) / max(len(time) - 1, 1)
    return len(time) > RATE and step * RATE * low_pass.frequency <= 1.0 + 1e-9


def acceleration(time: NDArray[np.float64], displacement: NDArray[np.float64], low_pass: LowPass) -> Acceleration:
    """Return the raw and filtered acceleration [m/s^2] at a point along one direction, by second differences.

    Args:
        time: Equally spaced sample times, shape (n,) [s].
        displacement: Absolute displacement along the direction, shape (n,) [m].
        low_pass: Filter of the acceleration.

    Returns:
        Acceleration at the n - 2 inner times.

    Raises:
        ValueError: The samples are too sparse for the filter.
    """
    step = float(time[-1] - time[0]) / (len(time) - 1)
    raw = np.diff(displacement, n=2) / step**2
    return Acceleration(time[1:-1], raw, apply_low_pass(raw, step, low_pass))


def peaks_of(accelerations: Mapping[str, Acceleration], low_pass: LowPass) -> dict[str, dict[str, Any]]:
    """Return the peaks of named accelerations and their filter as metrics.

    Args:
        accelerations: Name of a point -> its acceleration; if empty, so is the result.
        low_pass: Filter of the accelerations, for its label.

    Returns:
        ``peak_acceleration@<name>`` and ``second_peak_acceleration@<name>`` (largest later peak of opposite sign) [G],
        and ``acceleration_filter`` (text), each as ``{"value": ..., "unit": ...}``.
    """
    peaks = {
        metric: {"value": value, "unit": "G"}
        for name, history in accelerations.items()
        for metric, value in history.peaks_in_g(name).items()
    }
    return peaks | {"acceleration_filter": {"value": low_pass.label, "unit": ""}} if accelerations else {}


def _base_displacement(
    time: NDArray[np.float64], problem: StructureProblem, pulses: Mapping[str, Pulse]
) -> NDArray[np.float64]:
    """Return the displacement of the supports, shape (n, 3) [m], at times, shape (n,) [s]."""
    moved = np.zeros((len(time), 3))
    for name, load in problem.loads.items():
        if isinstance(load, InputG):
            along = np.array(load.direction) / np.linalg.norm(load.direction)
            moved += np.outer([pulses[name].double_integral(instant) for instant in time], along)
    return moved


def watch_accelerations(
    arrays: Mapping[str, NDArray], problem: StructureProblem, pulses: Mapping[str, Pulse]
) -> dict[str, Acceleration]:
    """Return the absolute acceleration of each watch point of a structure; empty if samples are too sparse.

    It acts along the direction of the watch point, else of the first input acceleration, else along the axis with the
    largest range of displacement.

    Args:
        arrays: Arrays of the history by name: ``time``, shape (n,) [s], and ``displacement@<name>``, shape (n, 3) [m].
        problem: Input of the structure, with watch points, loads and filter.
        pulses: Name of a load -> its pulse over time.

    Returns:
        Name of a watch point -> raw and filtered acceleration [m/s^2].
    """
    time, low_pass = arrays["time"], problem.dynamics.filter
    if not is_sampled(time, low_pass):
        return {}
    base = _base_displacement(time, problem, pulses)
    shaken = [np.array(load.direction) for load in problem.loads.values() if isinstance(load, InputG)]
    accelerations = {}
    for name, point in problem.watch.items():
        absolute = base + arrays[f"displacement@{name}"]
        direction = np.array(point.direction) if point.direction else shaken[0] if shaken else None
        if direction is None:
            along = np.eye(3)[np.ptp(absolute, axis=0).argmax()]
        else:
            along = direction / np.linalg.norm(direction)
        accelerations[name] = acceleration(time, absolute @ along, low_pass)
    return accelerations


def drop_accelerations(
    arrays: Mapping[str, NDArray], pulse: Pulse, low_pass: LowPass, watch: Mapping[str, WatchPoint]
) -> dict[str, Acceleration]:
    """Return the absolute accelerations of package centre and watch points in a drop; empty if samples are too sparse.

    Args:
        arrays: Arrays of the history by name: ``time``, shape (n,) [s], ``die_centre`` and ``displacement@<name>``,
            shape (n, 3) [m]; displacements are relative to the drop table.
        pulse: Acceleration of the drop table [m/s^2].
        low_pass: Filter of the accelerations.
        watch: Name -> watch point; one without a direction uses the direction of the table's motion.

    Returns:
        ``package`` (if the die moves) or name of a watch point -> raw and filtered acceleration [m/s^2].
    """
    time = arrays["time"]
    if not is_sampled(time, low_pass):
        return {}
    table = np.outer([pulse.double_integral(instant) for instant in time], TABLE)
    displacements = {"package": arrays["die_centre"]} if arrays["die_centre"].any() else {}
    displacements |= {name: arrays[f"displacement@{name}"] for name in watch}
    accelerations = {}
    for name, displacement in displacements.items():
        along = np.array((watch[name].direction if name in watch else None) or TABLE)
        accelerations[name] = acceleration(time, (table + displacement) @ along / np.linalg.norm(along), low_pass)
    return accelerations
