"""History samples: ranks of all models combine their parts, rank 0 of the run keeps them."""

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
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.portable import Log, Same, State
from reflowshock.fem.parallel.whereabouts import HERE


class Watch(Protocol):
    """Watch points of one rank: parts of sums and maxima that the ranks of all models combine.

    Attributes:
        labels: Name -> what belongs to a history but does not change with time.
    """

    labels: dict[str, NDArray]

    def sample(self, motion: Motion) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return this rank's parts of the sums and of the maxima, of equal lengths in all models of a run."""

    def row(self, sums: NDArray[np.float64], maxima: NDArray[np.float64]) -> dict[str, NDArray[np.float64] | float]:
        """Return the values of a sample by name, from the combined parts."""


SIDE: dict[Role, float] = {"macro": 1.0, "meso": -1.0, "dns": 0.0, "structure": 0.0}
Signal = Callable[[float], float]


class History:
    """Samples of the watch points, the energy balance and given functions of time, equal on all ranks."""

    def __init__(
        self, world: MPI.Comm, watches: Mapping[Role, Watch], balance: EnergyBalance, signals: Mapping[str, Signal]
    ) -> None:
        """Start an empty history; ``watches`` are those of the models on this rank."""
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
        """Judge the energies without a sample, and return them; collective over all models; errors as ``sample``."""
        parts = [energy_sums(participant, SIDE[role]) for role, participant in participants.items()]
        time = next(iter(participants.values())).motion.time
        return self.balance.judge(self._combine(np.sum(parts, axis=0)), time)

    def state(self) -> State:
        """Return energy balance and samples, for a checkpoint."""
        return {"balance": Same(fields_of(self.balance)), "rows": Log(columns(self._rows))}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from the values of what ``state`` returned."""
        self.balance, self._rows = EnergyBalance(**state["balance"]), rows(state["rows"])

    def _combine(self, part: NDArray[np.float64], operation: MPI.Op = MPI.SUM) -> NDArray[np.float64]:
        result = np.empty_like(part)
        HERE.wait_for("the sums of a sample, with all ranks")
        self._world.Allreduce(part, result, operation)
        HERE.go_on()
        return result

    def arrays(self, names: Collection[str] | None = None) -> dict[str, NDArray]:
        """Return all samples as arrays, by name, or those of these names that there are; on rank 0."""
        if names is not None:
            return columns([{name: row[name] for name in names if name in row} for row in self._rows])
        return columns(self._rows) | self._watch.labels

    def write(self, directory: Path) -> None:
        """Write ``history.npz``; on rank 0."""
        np.savez(directory / "history.npz", **self.arrays())
