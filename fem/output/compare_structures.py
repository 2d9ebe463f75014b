"""Comparison of the histories of two solvers on one structure."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from reflowshock.fem.output.compare import relative_error

COMPARED = ("displacement", "strain")

Arrays = Mapping[str, NDArray]


def solver_differences(ours: Arrays, reference: Arrays) -> dict[str, float]:
    """Compare two histories at the sample times of the one with fewer samples.

    Args:
        ours: Arrays of a ``history.npz`` file.
        reference: Arrays of the other solver's ``history.npz`` file.

    Returns:
        Relative L2 norms of the difference over time and components: ``displacement_difference@<point>`` and
        ``strain_difference@<point>`` for each point; the same names without a point for all points combined, where
        points with small values have little weight.

    Raises:
        ValueError: The histories have different watch points or end at different times.
    """
    names = [str(name) for name in reference["watch"]]
    ends = float(ours["time"][-1]), float(reference["time"][-1])
    if list(ours["watch"]) != names or not np.isclose(*ends, rtol=1e-9):
        raise ValueError(
            f"histories cannot be compared: one has the watch points {', '.join(ours['watch'])} up to {ends[0]:.6e} s,"
            f" the other {', '.join(names)} up to {ends[1]:.6e} s"
        )
    times = min(ours["time"], reference["time"], key=len)
    result: dict[str, float] = {}
    for quantity in COMPARED if names else ():
        pairs = {
            name: tuple(_at_times(times, arrays["time"], arrays[f"{quantity}@{name}"]) for arrays in (ours, reference))
            for name in names
        }
        result |= {f"{quantity}_difference@{name}": relative_error(*pair) for name, pair in pairs.items()}
        together = (np.stack(values) for values in zip(*pairs.values(), strict=True))
        result[f"{quantity}_difference"] = relative_error(*together)
    return result


def _at_times(
    times: NDArray[np.float64], sampled: NDArray[np.float64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Interpolate values, shape (len(sampled), k), to other times by cubic splines, unless the times agree."""
    if len(times) == len(sampled) and np.allclose(times, sampled, rtol=1e-9):
        return values
    return CubicSpline(sampled, values)(times)
