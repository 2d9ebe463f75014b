"""Histories of the modes of a shock: reading, joint stress, peaks, warnings."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.output.ranking import PEEL, VON_MISES, Measure, rank_joints
from reflowshock.fem.output.settled import is_settled, settling_measures

Arrays = Mapping[str, NDArray]

MODES = ("two_scale", "dns")


def read_modes(shock: Path, modes: tuple[str, ...] = MODES) -> tuple[dict[str, dict], dict[str, dict]]:
    """Read histories and results of the modes that were run.

    Args:
        shock: Folder of the shock, with a folder for each mode.
        modes: Names of the modes to read, in the order of the results.

    Returns:
        Mode -> arrays of ``history.npz``, and mode -> content of ``result.json``; modes without a history are left out.
    """
    histories, results = {}, {}
    for mode in modes:
        folder = shock / mode
        if (folder / "history.npz").exists():
            with np.load(folder / "history.npz") as arrays:
                histories[mode] = dict(arrays)
            results[mode] = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return histories, results


def joint_stress(history: Arrays, joint: str, measure: Measure = VON_MISES) -> NDArray[np.float64]:
    """Return a stress of a joint over time, at each time the larger value of both pads, shape (k,) [Pa].

    Args:
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity.
        joint: Name of a joint in the history.
        measure: Stress measure, such as von Mises or peel stress.
    """
    return measure.worse(history)[:, list(map(str, history["joints"])).index(joint)]


def peel_peaks(history: Arrays) -> dict[str, float]:
    """Return the peak peel stress [Pa] by joint, the critical joint first.

    Args:
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity.
    """
    peaks = PEEL.peaks(history)
    return {str(history["joints"][column]): float(peaks[column]) for column in rank_joints(history)}


ROUNDING = 1e-6


def unsettled(history: Arrays, longest: float) -> str:
    """Return a warning if a shock of automatic duration ended at its longest time [s] unsettled; else empty.

    Args:
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity.
        longest: Longest automatic duration [s].
    """
    if is_settled(history) or history["time"][-1] < longest * (1.0 - ROUNDING):
        return ""
    return (
        f"The run ended at the longest automatic duration ({1e3 * longest:.3g} ms) before half a swing of the board had"
        " passed since the largest stress: give a longer shock.duration."
    )


def late_peak(history: Arrays) -> str:
    """Return a warning if a joint stress peaks in the last fiftieth of the run, so that a longer run may exceed it.

    Args:
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity.

    Returns:
        Sentence on the peel stress or, unless solder has yielded, the von Mises stress; empty if neither peaks late.
    """
    names = {PEEL: "peel", VON_MISES: "von Mises"}
    largest = {names[measure]: measure.worse(history).max(axis=1) for measure in settling_measures(history)}
    late = [name for name, stress in largest.items() if peaks_late(stress)]
    if not late:
        return ""
    end = 1e3 * history["time"][-1]
    return (
        f"The {' and '.join(late)} stress is still rising when the simulated time ends ({end:.3g} ms): "
        "a longer shock.duration gives a higher peak."
    )


def peaks_late(values: NDArray) -> bool:
    """Return whether a history is largest in the last fiftieth of the run, so that a longer run may exceed it.

    Args:
        values: Samples in time, shape (times,).
    """
    return bool(np.argmax(values) >= len(values) - max(2, len(values) // 50))
