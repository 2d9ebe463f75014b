"""History samples: ranks of all models combine their parts, rank 0 of the run keeps them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fem.communicators import Role
from fem.ledger import Ledger, ledger_sums
from fem.loads import HalfSineDrop
from fem.participant import Participant
from fem.watch import Watch

LEDGER_SIZE = 20
SIDE: dict[Role, float] = {"macro": 1.0, "meso": -1.0, "dns": 0.0}
LAYERS = ("von_mises_board", "von_mises_package", "peel_board", "peel_package")


class History:
    """Samples of the watch points and the ledger, equal on all ranks."""

    def __init__(self, world: MPI.Comm, watches: Mapping[Role, Watch], ledger: Ledger, load: HalfSineDrop) -> None:
        """Start an empty history; ``watches`` are those of the models on this rank."""
        self.joints = next(iter(watches.values())).joints
        self.ledger = ledger
        self._world, self._watches, self._load = world, watches, load
        self._rows: list[dict[str, NDArray[np.float64] | float]] = []

    def sample(self, crew: Mapping[Role, Participant]) -> None:
        """Add a sample; collective over all models.

        Args:
            crew: The models on this rank.

        Raises:
            EnergyError: On every rank, see ``Ledger.judge``.
        """
        sums, maxima = np.zeros(1), np.full(1, -np.inf)
        for role, participant in crew.items():
            time = participant.motion.time
            watched, largest = self._watches[role].sample(participant.motion.displacement)
            sums = sums + np.concatenate([ledger_sums(participant, SIDE[role]), watched])
            maxima = np.maximum(maxima, largest)
        total, largest = np.empty_like(sums), np.empty_like(maxima)
        self._world.Allreduce(sums, total)
        self._world.Allreduce(maxima, largest, MPI.MAX)
        energies = self.ledger.judge(total[:LEDGER_SIZE], time)
        if self._world.rank == 0:
            self._rows.append({**self._row(time, total[LEDGER_SIZE:], largest), **energies})

    def _row(
        self, time: float, watched: NDArray[np.float64], maxima: NDArray[np.float64]
    ) -> dict[str, NDArray[np.float64] | float]:
        row: dict[str, NDArray[np.float64] | float] = {
            "time": time,
            "base_acceleration": self._load.base(time),
            "board_centre": watched[:3],
            "die_centre": watched[3:6],
            "von_mises_max": maxima[:-2],
            "board_strain": max(maxima[-2:]),
        }
        return row | dict(zip(LAYERS, watched[6:].reshape(len(LAYERS), -1), strict=True))

    def arrays(self) -> dict[str, NDArray]:
        """Return all samples as arrays, by name; on rank 0."""
        result: dict[str, NDArray] = {name: np.array([row[name] for row in self._rows]) for name in self._rows[0]}
        return result | {"joints": np.array(self.joints, dtype=str)}

    def write(self, directory: Path) -> None:
        """Write ``history.npz``; on rank 0."""
        np.savez(directory / "history.npz", **self.arrays())
