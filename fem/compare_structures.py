"""Compare the histories of two solvers on one structure. Plain NumPy and SciPy."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fem.compare import relative_error

COMPARED = ("displacement", "strain")


def compare_structures(explicit: Path, implicit: Path) -> dict[str, float]:
    """Compare two ``history.npz`` at the sample times of the one that has fewer.

    Returns:
        ``displacement_error@<point>`` and ``strain_error@<point>``: relative L2 norms of the difference over time and
        components, relative to the implicit solver.

    Raises:
        ValueError: The files have different watch points or end at different times.
    """
    with np.load(explicit) as first, np.load(implicit) as second:
        ours, reference = dict(first), dict(second)
    ends = float(ours["time"][-1]), float(reference["time"][-1])
    if list(ours["watch"]) != list(reference["watch"]) or not np.isclose(*ends, rtol=1e-9):
        raise ValueError(
            f"{explicit} and {implicit} cannot be compared: watch points {', '.join(ours['watch'])} to {ends[0]:.6e} s"
            f" and {', '.join(reference['watch'])} to {ends[1]:.6e} s"
        )
    times = min(ours["time"], reference["time"], key=len)
    result = {}
    for name in ours["watch"]:
        for quantity in COMPARED:
            key = f"{quantity}@{name}"
            values, exact = (at_times(times, arrays["time"], arrays[key]) for arrays in (ours, reference))
            result[f"{quantity}_error@{name}"] = relative_error(values, exact)
    return result


def at_times(times: NDArray[np.float64], own: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values ``(len(own), k)`` at other times: as they are where the times agree, else by cubic splines."""
    if len(times) == len(own) and np.allclose(times, own, rtol=1e-9):
        return values
    return CubicSpline(own, values)(times)
