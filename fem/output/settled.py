"""When a shock is over: its joints' largest stress has passed, and half a swing of the board brought no larger one.

Solder that has yielded hardens with every swing, and its von Mises stress with it: only peel stress is looked at then.
"""

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.output.ranking import ENDS, PEEL, PLASTIC_WORK, VON_MISES, Arrays, Measure, ranking_measure

HISTORIES = tuple(f"{measure.history}_{end}" for measure in (PEEL, VON_MISES, PLASTIC_WORK) for end in ENDS)
WATCHED = ("time", "board_centre", *HISTORIES)  # plastic work only where solder may yield
SAME = 0.99  # of the largest stress: what reaches it later is not a higher peak
SMALL = 0.1  # of the largest deflection: a return to zero from less is no swing


def is_settled(history: Arrays) -> bool:
    """Whether the largest stress of all joints is older than half a swing of the board.

    Half a swing is the time from the start until the board's centre first returns through its place: at least half of
    the first mode's period, since the pulse takes its time.

    Args:
        history: ``WATCHED``: ``time (k,)`` [s], ``board_centre (k, 3)`` [m], stresses ``(k, joints)`` [Pa].
    """
    time, half = history["time"], half_swing(history["time"], history["board_centre"][:, 2])
    if half is None or not PEEL.worse(history).size:
        return False
    latest = max(float(time[_first_largest(measure.worse(history))]) for measure in judged(history))
    return bool(time[-1] - latest >= half)


def judged(history: Arrays) -> tuple[Measure, ...]:
    """Return the measures whose peaks are to pass."""
    return (PEEL,) if ranking_measure(history) is PLASTIC_WORK else (PEEL, VON_MISES)


def half_swing(time: NDArray[np.float64], deflection: NDArray[np.float64]) -> float | None:
    """Return when a deflection ``(k,)`` first changes its sign, None where it has not yet."""
    reached = np.maximum.accumulate(np.abs(deflection))
    swung = (deflection[:-1] * deflection[1:] < 0.0) & (reached[:-1] >= SMALL * reached[-1])
    return float(time[1:][swung][0]) if swung.any() else None


def _first_largest(stress: NDArray[np.float64]) -> int:
    """Return the sample at which the largest stress of all joints first reaches its peak, but for a hundredth."""
    largest = stress.max(axis=1)
    return int(np.argmax(largest >= SAME * largest.max()))
