"""History samples: ranks of all models combine their parts, rank 0 of the run keeps them."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fem.communicators import Role
from fem.ledger import Ledger, ledger_sums
from fem.participant import Participant
from fem.watch import Watch

SIDE: dict[Role, float] = {"macro": 1.0, "meso": -1.0, "dns": 0.0, "structure": 0.0}
Signal = Callable[[float], float]


class History:
    """Samples of the watch points, the ledger and given functions of time, equal on all ranks."""

    def __init__(
        self, world: MPI.Comm, watches: Mapping[Role, Watch], ledger: Ledger, signals: Mapping[str, Signal]
    ) -> None:
        """Start an empty history; ``watches`` are those of the models on this rank."""
        self.ledger = ledger
        self._world, self._watches, self._signals = world, watches, signals
        self._watch = next(iter(watches.values()))
        self._rows: list[dict[str, NDArray[np.float64] | float]] = []

    def sample(self, crew: Mapping[Role, Participant]) -> None:
        """Add a sample; collective over all models.

        Args:
            crew: The models on this rank.

        Raises:
            EnergyError: On every rank, see ``Ledger.judge``.
        """
        ledgers, sums, maxima = [], [], []
        for role, participant in crew.items():
            time = participant.motion.time
            watched, largest = self._watches[role].sample(participant.motion)
            ledgers.append(ledger_sums(participant, SIDE[role]))
            sums.append(watched)
            maxima.append(largest)
        energies = self.ledger.judge(self._combine(np.sum(ledgers, axis=0)), time)
        total, most = self._combine(np.sum(sums, axis=0)), self._combine(np.max(maxima, axis=0), MPI.MAX)
        if self._world.rank == 0:
            signals = {name: signal(time) for name, signal in self._signals.items()}
            self._rows.append({"time": time, **signals, **self._watch.row(total, most), **energies})

    def _combine(self, part: NDArray[np.float64], operation: MPI.Op = MPI.SUM) -> NDArray[np.float64]:
        result = np.empty_like(part)
        self._world.Allreduce(part, result, operation)
        return result

    def arrays(self) -> dict[str, NDArray]:
        """Return all samples as arrays, by name; on rank 0."""
        result: dict[str, NDArray] = {name: np.array([row[name] for row in self._rows]) for name in self._rows[0]}
        return result | self._watch.labels

    def write(self, directory: Path) -> None:
        """Write ``history.npz``; on rank 0."""
        np.savez(directory / "history.npz", **self.arrays())
