"""Processor seconds of several sides of a comparison, measured in turns to spread the load of the machine evenly."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

ROUNDS = 9
BATCH_SECONDS = 0.1

Batch = Callable[[], float]  # makes some calls and returns the processor seconds of one


def make_batch(work: Callable[[], object], seconds: float = BATCH_SECONDS) -> Batch:
    """Return a function that repeats a work for about ``seconds`` and returns processor seconds per call.

    Args:
        work: Function that works once; it is called twice, to compile it and to choose the number of calls.
        seconds: Processor time of a batch [s].
    """
    work()
    begin = time.process_time()
    work()
    calls = max(1, round(seconds / max(time.process_time() - begin, 1e-7)))

    def run() -> float:
        begin = time.process_time()
        for _ in range(calls):
            work()
        return (time.process_time() - begin) / calls

    return run


def measure_in_turns(batches: dict[str, Batch], rounds: int = ROUNDS) -> dict[str, np.ndarray]:
    """Run the batches of several sides in turns.

    Args:
        batches: Name of a side -> function that works and returns processor seconds per call.
        rounds: Number of turns of each side.

    Returns:
        Name -> processor seconds per call in each round, shape (rounds,).
    """
    rows = [[run() for run in batches.values()] for _ in range(rounds)]
    return dict(zip(batches, np.array(rows).T, strict=True))


def rates(seconds: dict[str, np.ndarray], elements: dict[str, int]) -> dict[str, float]:
    """Return the element updates per second of each side, the median over rounds.

    Args:
        seconds: Name -> processor seconds per call in each round, as ``measure_in_turns`` returns them.
        elements: Name -> number of elements that a call updates.
    """
    return {name: float(elements[name] / np.median(values)) for name, values in seconds.items()}


def speed_ratio(seconds: dict[str, np.ndarray], ours: str, theirs: str) -> float:
    """Return the speed of one side over another, the median over rounds; above 1 if ``ours`` is faster.

    Args:
        seconds: Name -> processor seconds per call in each round, as ``measure_in_turns`` returns them.
        ours: Name of the one side.
        theirs: Name of the other side.
    """
    return float(np.median(seconds[theirs] / seconds[ours]))


def bar(value: float, limit: float, at_least: bool = True) -> dict[str, Any]:
    """Compare a figure with its limit.

    Args:
        value: Measured figure.
        limit: Limit of the figure.
        at_least: Whether the limit is a lower one.

    Returns:
        ``value``, ``limit``, ``holds_if`` ("at least" or "at most"), and ``ok``, whether the limit is satisfied.
    """
    return {
        "value": value,
        "limit": limit,
        "holds_if": "at least" if at_least else "at most",
        "ok": bool(value >= limit if at_least else value <= limit),
    }
