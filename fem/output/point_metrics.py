"""Metrics of watch points, strain gauges and supports from a history, and of natural modes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.stress import principal_strains, von_mises
from reflowshock.fem.mesh.point_table import PointTable
from reflowshock.fem.output.acceleration import apply_low_pass, is_sampled
from reflowshock.fem.output.result import quantity
from reflowshock.fem.output.structure_modes import ModeTable
from reflowshock.fem.problem.filters import LowPass


def point_metrics(arrays: Mapping[str, NDArray]) -> dict[str, Any]:
    """Return the peaks at watch points and supports as metrics, each as ``{"value": ..., "unit": ...}``.

    Args:
        arrays: Arrays of ``history.npz``: ``watch`` and ``supports`` (names); ``displacement@<name>``, shape (k, 3)
            [m], ``strain@<name>`` and ``stress@<name>`` [Pa], shape (k, 6), of each watch point; ``reaction@<name>``,
            shape (k, 3) [N], of each support.

    Returns:
        For each watch point ``peak_displacement@<name>``, ``displacement_range@<name>`` [m], ``peak_strain@<name>``,
        ``peak_von_mises@<name>`` [Pa] and, with plasticity, ``peak_plastic_strain@<name>``; for each support
        ``peak_reaction@<name>`` [N]. Empty without watch points and supports.
    """
    metrics: dict[str, Any] = {}
    for name in arrays["watch"]:
        displacement, stress = arrays[f"displacement@{name}"], arrays[f"stress@{name}"]
        metrics |= {
            f"peak_displacement@{name}": quantity(float(np.linalg.norm(displacement, axis=1).max()), "m"),
            f"displacement_range@{name}": quantity(float(np.ptp(displacement, axis=0).max()), "m"),
            f"peak_strain@{name}": quantity(float(np.abs(principal_strains(arrays[f"strain@{name}"])).max())),
            f"peak_von_mises@{name}": quantity(float(von_mises(stress).max()), "Pa"),
        }
        if f"plastic_strain@{name}" in arrays:
            metrics[f"peak_plastic_strain@{name}"] = quantity(float(arrays[f"plastic_strain@{name}"].max()))
    for name in arrays["supports"]:
        reaction = np.linalg.norm(arrays[f"reaction@{name}"], axis=1)
        metrics[f"peak_reaction@{name}"] = quantity(float(reaction.max()), "N")
    return metrics


def gauge_lengths(table: PointTable) -> dict[str, float]:
    """Return the length of each strain gauge by name [m].

    Args:
        table: Watch points with their strain gauges; the result is empty without gauges.
    """
    return dict(zip(table.gauges.names, table.gauges.length.tolist(), strict=True))


def _strain_rate(time: NDArray[np.float64], strain: NDArray[np.float64], low_pass: LowPass) -> NDArray[np.float64]:
    """Return the rate of a filtered strain, shape (n,) [1/s], at equally spaced times, shape (n,) [s]."""
    step = float(time[-1] - time[0]) / (len(time) - 1)
    return np.gradient(apply_low_pass(strain, step, low_pass), step)


def gauge_metrics(arrays: Mapping[str, NDArray], low_pass: LowPass) -> dict[str, Any]:
    """Return the peak magnitudes of strain gauges as metrics, each as ``{"value": ..., "unit": ...}``.

    Args:
        arrays: Arrays of ``history.npz``: ``time`` [s], ``gauges`` (names) and ``gauge@<name>`` (strain).
        low_pass: Filter of the strain before its rate is computed.

    Returns:
        ``peak_strain@<name>`` and, if samples are dense enough for the filter, ``peak_strain_rate@<name>`` [1/s].
    """
    metrics: dict[str, Any] = {}
    sampled = is_sampled(arrays["time"], low_pass)
    for name in arrays["gauges"]:
        strain = arrays[f"gauge@{name}"]
        metrics[f"peak_strain@{name}"] = quantity(float(np.abs(strain).max()))
        if sampled:
            rate = _strain_rate(arrays["time"], strain, low_pass)
            metrics[f"peak_strain_rate@{name}"] = quantity(float(np.abs(rate).max()), "1/s")
    return metrics


def mode_metrics(modes: ModeTable | None) -> dict[str, Any]:
    """Return the four lowest natural frequencies as metrics.

    Args:
        modes: Table of modes, None if no modes were computed.

    Returns:
        ``first_frequency`` to ``fourth_frequency``, each as ``{"value": ..., "unit": "Hz"}``; fewer if there are fewer
        modes, empty for None.
    """
    frequencies = [] if modes is None else modes.frequency.tolist()
    names = ("first", "second", "third", "fourth")
    return {f"{name}_frequency": quantity(value, "Hz") for name, value in zip(names, frequencies, strict=False)}
