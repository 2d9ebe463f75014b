"""End criterion of a shock: the largest joint stress has passed, and no later swing of the board is larger.

Of a damped board, the two latest swings, an oscillation, must have stayed below ``DECAYED`` times the largest stress:
modes of different frequencies may add up later, but mass-proportional damping reduces all of them at the same rate, so
that a larger stress would have to outgrow two swings in spite of it. An undamped board never settles in this sense; its
shock ends half an oscillation after the largest stress.

The von Mises stress of yielded solder grows with every oscillation by hardening, so only peel stress is used then.
"""

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.output.ranking import ENDS, PEEL, PLASTIC_WORK, VON_MISES, Arrays, Measure, ranking_measure

HISTORIES = tuple(f"{measure.history}_{end}" for measure in (PEEL, VON_MISES, PLASTIC_WORK) for end in ENDS)
WATCHED = ("time", "board_centre", *HISTORIES)  # plastic work exists only if solder may yield
SAME = 0.99  # fraction of the largest stress that counts as having reached the peak
DECAYED = 0.9  # fraction of the largest stress that later swings of a damped board must not exceed
LATER_SWINGS = 2.0
SMALL = 0.1  # fraction of the largest deflection below which a zero crossing does not count


def is_settled(history: Arrays, damped: bool = False) -> bool:
    """Return whether the largest stress of all joints has passed, and enough swings of the board after it.

    Then a run may end early: half an oscillation after the largest stress, and, if the board is damped, when stresses
    in the two latest swings are at most 0.9 times the largest. A swing, half an oscillation, is the time from the start
    to the first zero crossing of the board centre. It is at least half the period of the first mode, since it includes
    the pulse.

    Args:
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``board_centre``, shape (k, 3) [m], and for the
            ends ``board`` and ``package`` the stresses, shape (k, joints) [Pa], and plastic work of the joints if
            solder may yield.
        damped: Whether the board is damped.
    """
    end = needed_end(history)
    if end is None or history["time"][-1] < end:
        return False
    return not damped or latest_swings(history) <= DECAYED


def needed_end(history: Arrays) -> float | None:
    """Return the time half an oscillation of the board after the largest joint stress [s], when a run may end early.

    Args:
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``board_centre``, shape (k, 3) [m], and stresses
            of the joints at the ends ``board`` and ``package``, shape (k, joints) [Pa].

    Returns:
        Time [s]; None before the board has first returned to its position at the start, or without joints.
    """
    time, half = history["time"], half_oscillation(history["time"], history["board_centre"][:, 2])
    if half is None or not PEEL.worse(history).size:
        return None
    return half + max(float(time[_peak_sample(measure.worse(history))]) for measure in settling_measures(history))


def latest_swings(history: Arrays) -> float:
    """Return the largest joint stress in the two latest swings (half oscillations of the board) over its maximum.

    Args:
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``board_centre``, shape (k, 3) [m], and stresses
            of the joints at the ends ``board`` and ``package``, shape (k, joints) [Pa].

    Returns:
        Ratio from 0 to 1, the largest over the measures of stress; 1 also before the board has first returned.
    """
    time, half = history["time"], half_oscillation(history["time"], history["board_centre"][:, 2])
    if half is None:
        return 1.0
    latest = time > time[-1] - LATER_SWINGS * half
    stresses = [measure.worse(history).max(axis=1) for measure in settling_measures(history)]
    return max(float(stress[latest].max() / stress.max()) for stress in stresses)


def settling_measures(history: Arrays) -> tuple[Measure, ...]:
    """Return the measures of the joints whose peaks must have passed before a run may end early.

    They are peel stress and, unless solder has yielded, von Mises stress.

    Args:
        history: Arrays of ``history.npz``: ``peel_<end>`` [Pa] and, with plasticity, ``plastic_work_<end>`` for the
            ends ``board`` and ``package``, each of shape (times, joints).

    Returns:
        Measures whose methods return histories and peaks on the worse pad from such arrays.
    """
    return (PEEL,) if ranking_measure(history) is PLASTIC_WORK else (PEEL, VON_MISES)


def half_oscillation(time: NDArray[np.float64], deflection: NDArray[np.float64]) -> float | None:
    """Return the time of the first sign change of a deflection [s], or None if its sign has not changed yet.

    Sign changes of deflections that are small compared to the largest one of the record do not count.

    Args:
        time: Sample times, shape (k,) [s].
        deflection: Deflection of the board centre, shape (k,) [m].
    """
    reached = np.maximum.accumulate(np.abs(deflection))
    crossings = (deflection[:-1] * deflection[1:] < 0.0) & (reached[:-1] >= SMALL * reached[-1])
    return float(time[1:][crossings][0]) if crossings.any() else None


def _peak_sample(stress: NDArray[np.float64]) -> int:
    """Return the first sample at which the largest stress of all joints reaches ``SAME`` times its peak."""
    largest = stress.max(axis=1)
    return int(np.argmax(largest >= SAME * largest.max()))
