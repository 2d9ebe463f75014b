"""History of a run: samples reduced over the ranks of all models and stored on rank 0."""

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.data_file import columns, fields_of, rows
from reflowshock.fem.dynamics.energy_balance import EnergyBalance, energy_sums
from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.dynamics.participant import Participant
from reflowshock.fem.parallel.checkpoint_state import Log, Same, State
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.rank_activity import ACTIVITY
from reflowshock.fem.parallel.waiting import wait_for_all


class Watch(Protocol):
    """Watch points of one rank, as contributions to sums and maxima over the ranks of all models.

    Attributes:
        labels: Time-independent arrays of the history by name.
    """

    labels: dict[str, NDArray]

    def sample(self, motion: Motion) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return this rank's contributions to sums and to maxima, with the same lengths in all models of a run."""

    def row(self, sums: NDArray[np.float64], maxima: NDArray[np.float64]) -> dict[str, NDArray[np.float64] | float]:
        """Return the values of a sample by name, from the reduced sums and maxima."""


SIDE: dict[Role, float] = {"macro": 1.0, "meso": -1.0, "dns": 0.0, "structure": 0.0}
Signal = Callable[[float], float]


class History:
    """Samples of the watch points, the energy balance and functions of time (signals)."""

    def __init__(
        self, world: MPI.Comm, watches: Mapping[Role, Watch], balance: EnergyBalance, signals: Mapping[str, Signal]
    ) -> None:
        """Start an empty history; ``watches`` holds the watch points of the models on this rank."""
        self.balance = balance
        self._world, self._watches, self._signals = world, watches, signals
        self._watch = next(iter(watches.values()))
        self._rows: list[dict[str, NDArray[np.float64] | float]] = []

    def sample(self, participants: Mapping[Role, Participant]) -> None:
        """Add a sample; collective over all models.

        Args:
            participants: The models on this rank.

        Raises:
            EnergyError: On every rank, see ``EnergyBalance.judge``.
        """
        energies = self.check(participants)
        sums, maxima = [], []
        for role, participant in participants.items():
            time = participant.motion.time
            watched, largest = self._watches[role].sample(participant.motion)
            sums.append(watched)
            maxima.append(largest)
        total, most = self._combine(np.sum(sums, axis=0)), self._combine(np.max(maxima, axis=0), MPI.MAX)
        if self._world.rank == 0:
            signals = {name: signal(time) for name, signal in self._signals.items()}
            self._rows.append({"time": time, **signals, **self._watch.row(total, most), **energies})

    def check(self, participants: Mapping[Role, Participant]) -> dict[str, float]:
        """Check the energies without adding a sample, and return them [J]; collective.

        Raises:
            EnergyError: The energy balance is violated; on every rank.
        """
        parts = [energy_sums(participant, SIDE[role]) for role, participant in participants.items()]
        time = next(iter(participants.values())).motion.time
        return self.balance.judge(self._combine(np.sum(parts, axis=0)), time)

    def state(self) -> State:
        """Return the energy balance and the samples, for a checkpoint."""
        return {"balance": Same(fields_of(self.balance)), "rows": Log(columns(self._rows))}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore the values that ``state`` returned."""
        self.balance, self._rows = EnergyBalance(**state["balance"]), rows(state["rows"])

    def _combine(self, part: NDArray[np.float64], operation: MPI.Op = MPI.SUM) -> NDArray[np.float64]:
        result = np.empty_like(part)
        ACTIVITY.wait_for("the sums of a sample, with all ranks")
        wait_for_all(self._world)
        self._world.Allreduce(part, result, operation)
        ACTIVITY.go_on()
        return result

    def arrays(self, names: Collection[str] | None = None) -> dict[str, NDArray]:
        """Return the samples as arrays by name, all or only the existing ones among ``names``; on rank 0."""
        if names is not None:
            return columns([{name: row[name] for name in names if name in row} for row in self._rows])
        return columns(self._rows) | self._watch.labels

    def write(self, directory: Path) -> None:
        """Write ``history.npz``; on rank 0."""
        np.savez(directory / "history.npz", **self.arrays())
