"""Processor seconds of several sides of a comparison, measured in turns to spread the load of the machine evenly."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

ROUNDS = 9
BATCH_SECONDS = 0.1

Batch = Callable[[], float]  # makes some calls and returns the processor seconds of one


def make_batch(work: Callable[[], object], seconds: float = BATCH_SECONDS) -> Batch:
    """Return a batch of calls that takes about ``seconds``, compiled and warm."""
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
    """Return the processor seconds of a call of each side, one value per round."""
    rows = [[run() for run in batches.values()] for _ in range(rounds)]
    return dict(zip(batches, np.array(rows).T, strict=True))


def rates(seconds: dict[str, np.ndarray], elements: dict[str, int]) -> dict[str, float]:
    """Return the median element updates per second of each side."""
    return {name: float(elements[name] / np.median(values)) for name, values in seconds.items()}


def speed_ratio(seconds: dict[str, np.ndarray], ours: str, theirs: str) -> float:
    """Return the speed of one side over another, the median over rounds."""
    return float(np.median(seconds[theirs] / seconds[ours]))


def bar(value: float, limit: float, at_least: bool = True) -> dict[str, Any]:
    """Return a figure with its limit and whether it is satisfied."""
    return {
        "value": value,
        "limit": limit,
        "holds_if": "at least" if at_least else "at most",
        "ok": bool(value >= limit if at_least else value <= limit),
    }
