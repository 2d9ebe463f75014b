"""Time shares of windows, with a clock set by the test."""

import time

import pytest

from reflowshock.fem.coupling.stopwatch import Stopwatch
from reflowshock.fem.parallel.exchange import MessageClock


class TwoRanks:
    """Communicator of two ranks: the calling rank and another one with a prescribed record."""

    def __init__(self, other: dict) -> None:
        self.other = other

    def allgather(self, record: dict) -> list[dict]:
        return [record, self.other]


def at(monkeypatch, second: float) -> None:
    """Set both clocks of the stopwatch to a second."""
    monkeypatch.setattr(time, "perf_counter", lambda: second)
    monkeypatch.setattr(time, "process_time", lambda: 0.5 * second)


def test_waiting_is_separated_from_work(monkeypatch):
    sums, coupling = MessageClock(1.0, 1.0), MessageClock(1.0, 1.0)
    stopwatch = Stopwatch({"macro": MessageClock(), "meso": sums}, [coupling])
    for begin in (0.0, 100.0):
        at(monkeypatch, begin)
        stopwatch.start()
        at(monkeypatch, begin + 4.0)
        coupling.count(begin + 1.0, begin + 1.5, begin + 3.5)
        stopwatch.lap("macro")
        at(monkeypatch, begin + 10.0)
        sums.count(begin + 8.0, begin + 8.0, begin + 9.0)
        stopwatch.lap("meso")
        sums.count(begin + 10.0, begin + 10.0, begin + 10.0 + 50.0)  # sampling time, outside windows
    assert stopwatch.turns == {"macro": 8.0, "meso": 12.0}
    other = {"turns": {"macro": 20.0}, "sum_waiting": {"macro": 0.0}, "coupling_packing": 0.5, "coupling_waiting": 0.5}
    other["core_seconds"] = 15.0
    summary = stopwatch.summary(TwoRanks(other), 2)
    assert summary["ranks"][0]["coupling_packing"] == pytest.approx(2.0)
    assert summary["ranks"][0]["sum_packing"]["meso"] == pytest.approx(2.0)
    assert summary["window_seconds"] == pytest.approx(10.0)
    assert summary["window_core_seconds"] == pytest.approx((10.0 + 15.0) / 2)
    assert summary["busy_shares"] == pytest.approx([0.7, 0.975])
    assert summary["busy_share"] == pytest.approx(1.0 - 6.5 / 40.0)
    assert summary["coupling_overhead"] == pytest.approx(0.05)
