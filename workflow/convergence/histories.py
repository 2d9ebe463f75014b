"""Histories of runs at the same times, so that runs of any time step and mesh can be compared."""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Arrays = Mapping[str, NDArray]


def at_same_times(history: Arrays, names: Iterable[str], duration: float, count: int) -> NDArray[np.float64]:
    """Interpolate arrays of a history at evenly spaced times.

    Args:
        history: of a run; ``time`` (s,) [s].
        names: of arrays (s, ...).
        duration: of the motion [s]; runs end there but for a rounding of their steps.
        count: of the times.

    Returns:
        All values, one array after the other, each in the order of times.
    """
    times = common_times(duration, count)
    return np.concatenate([CubicSpline(history["time"], history[name])(times).ravel() for name in names])


def common_times(duration: float, count: int) -> NDArray[np.float64]:
    """Return evenly spaced times (count,) [s] from zero to the end of the motion."""
    return np.linspace(0.0, duration, count)
