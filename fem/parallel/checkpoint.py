"""Checkpoints of a run on all its ranks, in two generations, each file written atomically.

Each rank writes its own files, in a folder named after the inputs and the partition of the run. A run restarts from the
latest window whose files are all intact: bit-identical on the same partition, otherwise from the combined files of all
ranks (``checkpoint_state``), which its first checkpoint then replaces. The second generation covers interrupts between
the files of two ranks, and damaged files. Files contain only data (``data_file``); reading them never executes code.

Damaged or foreign checkpoints are reported, and the run starts from the older generation or from the beginning.
"""

import shutil
from functools import cache
from importlib.metadata import version
from pathlib import Path
from time import monotonic
from typing import Any

from mpi4py import MPI

from reflowshock.data_file import NotData, read_data
from reflowshock.fem.errors import CheckpointError
from reflowshock.fem.parallel import checkpoint_state
from reflowshock.fem.parallel.checkpoint_files import (
    EXTRA,
    FOLDER_NAME,
    STATE,
    Checkpoint,
    Header,
    digest_of,
    find_checkpoints,
    header_of,
    warn,
    write_state,
)
from reflowshock.fem.parallel.checkpoint_state import ENTRIES, State
from reflowshock.fem.parallel.rank_activity import ACTIVITY
from reflowshock.fem.parallel.waiting import wait_for_all
from reflowshock.sources import MATERIALS, digest_of_sources

LIBRARIES = ("numpy", "scipy", "numba")
GENERATIONS = 2


class Checkpoints:
    """Checkpoint files of one run.

    Attributes:
        continued: Window from which the run was restarted, None if it started from the beginning.
        moved: Whether the run was restarted from another partition.
    """

    def __init__(self, comm: MPI.Comm, folder: Path | None, inputs: object, interval: float) -> None:
        """Identify the run that the files belong to; collective.

        Args:
            comm: Communicator of all ranks of the run.
            folder: Folder of the files on all ranks, None for a run without checkpoints.
            inputs: Everything that the run depends on except its ranks, as plain data with a complete ``repr``, equal
                on all ranks.
            interval: Wall-clock time between two checkpoints [s].
        """
        self._comm, self._folder, self._interval = comm, folder, interval
        self._latest: Checkpoint | None = None
        self.continued: int | None = None
        self.moved = False
        self._owner = digest_of(repr(inputs).encode() + _code())
        self._run_folder, self._first = Path(), set[str]()
        self._extras: dict[str, None] = {}  # ordered names
        self._written, self._generation = monotonic(), 0

    @property
    def latest(self) -> Checkpoint | None:
        """Latest checkpoint of this run or of its restart, None before the first."""
        return self._latest

    @latest.setter
    def latest(self, checkpoint: Checkpoint) -> None:
        self._latest, ACTIVITY.checkpoint = checkpoint, str(checkpoint)

    def read(self, like: State) -> dict[str, Any] | None:
        """Return this rank's values of the latest intact checkpoint, None without one; collective.

        Args:
            like: State with which this rank would start from the beginning, with its models and other parts by name.

        Raises:
            CheckpointError: The files lack nodes or cells of this rank; on this rank.
        """
        if self._folder is None:
            return None
        self._run_folder = self._folder / f"{self._owner[:12]}-{self._partition_digest(like)[:12]}"
        if self._comm.rank == 0:
            self._run_folder.mkdir(parents=True, exist_ok=True)
        is_root = self._comm.rank == 0
        candidates = find_checkpoints(self._folder, self._owner, self._run_folder) if is_root else []
        for checkpoint in self._comm.bcast(candidates):
            if self._is_intact(checkpoint):
                self.latest, self.continued, self.moved = checkpoint, checkpoint.window, not checkpoint.preferred
                self._generation = (checkpoint.generation + 1) % GENERATIONS
                header = None if self.moved else header_of(checkpoint.paths[self._comm.rank])
                self._extras = dict.fromkeys(header.extras) if header else {}
                return checkpoint_state.values(self._part(checkpoint.paths, like))
        return None

    def _is_intact(self, checkpoint: Checkpoint) -> bool:
        """Return whether all files of a checkpoint are intact, and warn of damaged ones; collective."""
        checked_here = range(self._comm.rank, checkpoint.ranks, self._comm.size)
        faults = self._comm.allgather(
            [fault for rank in checked_here for fault in _faults_of(checkpoint.folder, rank, checkpoint.generation)]
        )
        if self._comm.rank == 0:
            for fault in (fault for rank_faults in faults for fault in rank_faults):
                warn(f"{fault}: the run restarts from an older checkpoint or from the beginning")
        return not any(faults)

    def is_due(self) -> bool:
        """Return whether the interval has passed on rank 0; collective."""
        if self._folder is None:
            return False
        ACTIVITY.wait_for("the decision of rank 0 whether a checkpoint is due")
        wait_for_all(self._comm)
        due = bool(self._comm.bcast(monotonic() - self._written >= self._interval))
        ACTIVITY.go_on()
        return due

    def write(self, window: int, time: float, state: State) -> None:
        """Write this rank's state at a window and a time [s], replacing the older generation; collective."""
        if self._folder is None:
            return
        header = Header(self._owner, self._comm.size, window, time, tuple(self._extras))
        write_state(self._run_folder / STATE.format(rank=self._comm.rank, generation=self._generation), header, state)
        wait_for_all(self._comm)  # no rank may overwrite its older file before all have the newer one
        self.latest = Checkpoint(window, True, self._run_folder, self._generation, self._comm.size, time)
        if self._comm.rank == 0:
            _remove_others(self._run_folder)
        self._generation = (self._generation + 1) % GENERATIONS
        self._written = monotonic()

    def store(self, name: str, state: State) -> None:
        """Store an additional state of this rank under a name for the rest of the run; call it after ``read``."""
        if self._folder is not None:
            path = self._run_folder / EXTRA.format(name=name, rank=self._comm.rank)
            write_state(path, Header(self._owner, self._comm.size), state)
            self._extras[name] = None

    def stored(self, name: str, like: State) -> dict[str, Any]:
        """Return the values stored under a name before the restart; call it before the next ``write``.

        Args:
            name: Name of the additional state.
            like: State of the same nodes and cells.
        """
        assert self.latest is not None
        paths = [self.latest.folder / EXTRA.format(name=name, rank=rank) for rank in range(self.latest.ranks)]
        state = self._part(paths, like)
        if self.moved:
            self.store(name, state)
        return checkpoint_state.values(state)

    def _part(self, paths: list[Path], like: State) -> State:
        """Return this rank's part of the states in the files of all ranks, or its own file on the same partition.

        Raises:
            CheckpointError: The files lack nodes or cells of this rank.
        """
        if not self.moved:
            return _read_state(paths[self._comm.rank])
        state = checkpoint_state.blank(like)
        for path in paths:
            if path.exists():  # a rank without this model has no file
                checkpoint_state.take(state, _read_state(path), self._first)
        if not checkpoint_state.is_complete(state):
            raise CheckpointError(f"the checkpoint files in {paths[0].parent} lack nodes or cells of this run")
        return state

    def _partition_digest(self, like: State) -> str:
        """Return a digest of the partition, and set the parts of which this rank is the first carrier; collective."""
        by_rank = self._comm.allgather((checkpoint_state.layout(like), list(like)))
        on_lower_ranks = {name for _, names in by_rank[: self._comm.rank] for name in names}
        self._first = like.keys() - on_lower_ranks
        return digest_of(repr(by_rank).encode())


def _read_state(path: Path) -> Any:
    """Read the state of a file.

    Raises:
        NotData: The file is truncated, changed or not a state.
    """
    return read_data(path, ENTRIES)


def _faults_of(folder: Path, rank: int, generation: int) -> list[str]:
    """Return the faults of the files of a rank, its state and its additional states; empty if all are intact."""
    path = folder / STATE.format(rank=rank, generation=generation)
    header, faults = header_of(path), []
    names = header.extras if header else ()
    for file in (path, *(folder / EXTRA.format(name=name, rank=rank) for name in names)):
        try:
            _read_state(file)
        except NotData as error:
            faults.append(str(error))
    return faults


def _remove_others(run_folder: Path) -> None:
    """Remove the checkpoint folders of other inputs and partitions next to the folder of a run."""
    for folder in run_folder.parent.iterdir():
        if folder != run_folder and FOLDER_NAME.fullmatch(folder.name):
            shutil.rmtree(folder)


@cache
def _code() -> bytes:
    """Return a digest of this package's source and of the libraries, since other code may change the results."""
    libraries = " ".join(version(name) for name in LIBRARIES)
    return libraries.encode() + digest_of_sources(Path(__file__).parents[1], MATERIALS)
