"""Timing of windows: turns of each model on each rank, with the shares of packing and waiting."""

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from mpi4py import MPI

from reflowshock.fem.estimates.placement import Role
from reflowshock.fem.parallel.exchange import MessageClock


class Stopwatch:
    """Stopwatch for the turns of the models in a window.

    Attributes:
        turns: Time of each model on this rank [s].
        core_seconds: Processor time of all turns, busy waiting included [s].
    """

    def __init__(self, sums: Mapping[Role, MessageClock], coupling: Sequence[MessageClock] = ()) -> None:
        """Start at zero.

        Args:
            sums: Clock of the sums over shared nodes for each model of this rank.
            coupling: Clocks of the channels between the models.
        """
        self.turns: dict[Role, float] = dict.fromkeys(sums, 0.0)
        self._sums, self._coupling = sums, coupling
        self.core_seconds = self._begin = self._core_begin = 0.0
        self._counted = [(clock, MessageClock()) for clock in [*sums.values(), *coupling]]

    def start(self) -> None:
        """Begin a window; messages since the previous one belong to samples and are not counted."""
        for clock, counted in self._counted:
            clock.packing, clock.waiting = counted.packing, counted.waiting
        self._begin, self._core_begin = time.perf_counter(), time.process_time()

    def lap(self, role: Role) -> None:
        """Add the time since the start or the last lap to a model."""
        end, core_end = time.perf_counter(), time.process_time()
        self.turns[role] += end - self._begin
        self.core_seconds += core_end - self._core_begin
        self._begin, self._core_begin = end, core_end
        for clock, counted in self._counted:
            counted.packing, counted.waiting = clock.packing, clock.waiting

    def summary(self, world: MPI.Comm, windows: int) -> dict[str, Any]:
        """Return window times and their shares on each rank and in total; collective.

        ``coupling_overhead`` is the share of time for coupling, packing and messages on the rank that others wait for,
        which is the rank with the smallest share. Time spent waiting for the other model or within a model counts in
        ``busy_share``.
        """
        ranks = world.allgather(self._record())
        total = np.array([sum(item["turns"].values()) for item in ranks])
        waiting = np.array([sum(item["sum_waiting"].values()) + item["coupling_waiting"] for item in ranks])
        coupling = np.array([item["coupling_packing"] + item["coupling_waiting"] for item in ranks])
        total = np.maximum(total, np.finfo(float).tiny)  # a run that had no window to do
        return {
            "window_seconds": float(total.max()) / max(windows, 1),
            "window_core_seconds": sum(item["core_seconds"] for item in ranks) / max(windows, 1),
            "busy_share": float(1.0 - waiting.sum() / total.sum()),
            "busy_shares": (1.0 - waiting / total).tolist(),
            "coupling_overhead": float((coupling / total).min()),
            "ranks": ranks,
        }

    def _record(self) -> dict[str, Any]:
        """Return the times of this rank [s]."""
        self.start()
        return {
            "turns": self.turns,
            "core_seconds": self.core_seconds,
            "sum_packing": {role: clock.packing for role, clock in self._sums.items()},
            "sum_waiting": {role: clock.waiting for role, clock in self._sums.items()},
            "coupling_packing": sum(clock.packing for clock in self._coupling),
            "coupling_waiting": sum(clock.waiting for clock in self._coupling),
        }
