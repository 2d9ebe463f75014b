"""History samples: ranks of all models combine their parts, rank 0 of the run keeps them."""

from pathlib import Path

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fem.ledger import Ledger, ledger_sums
from fem.loads import HalfSineDrop
from fem.participant import Participant
from fem.watch import Watch

LEDGER_SIZE = 20
LAYERS = ("von_mises_board", "von_mises_package", "peel_board", "peel_package")


class History:
    """Samples of the watch points and the ledger, equal on all ranks."""

    def __init__(self, world: MPI.Comm, watch: Watch, ledger: Ledger, load: HalfSineDrop) -> None:
        """Start an empty history."""
        self.joints = watch.joints
        self.ledger = ledger
        self._world, self._watch, self._load = world, watch, load
        self._rows: list[dict[str, NDArray[np.float64] | float]] = []

    def sample(self, participant: Participant, sign: float) -> None:
        """Add a sample; collective over all models.

        Args:
            participant: The model on this rank.
            sign: Side of the cut, see ``ledger.ledger_sums``.

        Raises:
            EnergyError: On every rank, see ``Ledger.judge``.
        """
        motion = participant.motion
        watched, maxima = self._watch.sample(motion.displacement)
        sums = np.concatenate([ledger_sums(participant, sign), watched])
        total, largest = np.empty_like(sums), np.empty_like(maxima)
        self._world.Allreduce(sums, total)
        self._world.Allreduce(maxima, largest, MPI.MAX)
        energies = self.ledger.judge(total[:LEDGER_SIZE], motion.time)
        if self._world.rank == 0:
            self._rows.append({**self._row(motion.time, total[LEDGER_SIZE:], largest), **energies})

    def _row(
        self, time: float, watched: NDArray[np.float64], maxima: NDArray[np.float64]
    ) -> dict[str, NDArray[np.float64] | float]:
        high, low = maxima[-2], -maxima[-1]
        row: dict[str, NDArray[np.float64] | float] = {
            "time": time,
            "base_acceleration": self._load.base(time),
            "board_centre": watched[:3],
            "die_centre": watched[3:6],
            "von_mises_max": maxima[:-2],
            "board_strain": high if high >= -low else low,
        }
        return row | dict(zip(LAYERS, watched[6:].reshape(len(LAYERS), -1), strict=True))

    def arrays(self) -> dict[str, NDArray]:
        """Return all samples as arrays, by name; on rank 0."""
        result: dict[str, NDArray] = {name: np.array([row[name] for row in self._rows]) for name in self._rows[0]}
        return result | {"joints": np.array(self.joints, dtype=str)}

    def write(self, directory: Path) -> None:
        """Write ``history.npz``; on rank 0."""
        np.savez(directory / "history.npz", **self.arrays())
