"""Checkpoints of a run on all its ranks: two generations, each written at once or not at all.

Every rank has files of its own, in a folder for the inputs and the division into ranks that the run has. A run
continues from the latest window of which all files are whole: to the same bits where the division is its own, else with
what the files of all ranks together say (``portable``); its first own checkpoint then replaces those. The other
generation is there for a kill between two ranks' files, and for files that are broken. All are data (``data_file``):
nothing in them is executed, whoever has written them.

A broken or foreign checkpoint is reported, and the run begins anew or from the older generation.
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
from reflowshock.fem.parallel import portable
from reflowshock.fem.parallel.checkpoint_files import (
    FOLDER_NAME,
    KEPT,
    STATE,
    Checkpoint,
    Header,
    digest_of,
    find_checkpoints,
    header_of,
    warn,
    write_state,
)
from reflowshock.fem.parallel.portable import ENTRIES, State
from reflowshock.fem.parallel.whereabouts import HERE
from reflowshock.sources import MATERIALS, digest_of_sources

LIBRARIES = ("numpy", "scipy", "numba")
GENERATIONS = 2


class Checkpoints:
    """The checkpoint files of one run.

    Attributes:
        continued: Window from which the run continued, None where it began anew.
        moved: Whether the run continued from another division into ranks.
    """

    def __init__(self, comm: MPI.Comm, folder: Path | None, inputs: object, interval: float) -> None:
        """Name what the files belong to; collective.

        Args:
            comm: All ranks of the run.
            folder: Where the files are, for all ranks; None for a run without checkpoints.
            inputs: All that the run depends on but its ranks; plain data whose ``repr`` tells all of it, equal on all.
            interval: Wall time between two checkpoints [s].
        """
        self._comm, self._folder, self._interval = comm, folder, interval
        self._latest: Checkpoint | None = None
        self.continued: int | None = None
        self.moved = False
        self._owner = digest_of(repr(inputs).encode() + _code())
        self._own, self._first = Path(), set[str]()
        self._kept: dict[str, None] = {}  # names, in order
        self._written, self._generation = monotonic(), 0

    @property
    def latest(self) -> Checkpoint | None:
        """Return the latest checkpoint, of this run or from which it continued; None where there is none."""
        return self._latest

    @latest.setter
    def latest(self, checkpoint: Checkpoint) -> None:
        self._latest, HERE.checkpoint = checkpoint, str(checkpoint)

    def read(self, like: State) -> dict[str, Any] | None:
        """Return this rank's values at the latest window of which all files are whole, None where there is none.

        Collective.

        Args:
            like: The state with which this rank would begin anew: its models, and what else there is, by name.

        Raises:
            CheckpointError: The files lack what this rank has; on that rank.
        """
        if self._folder is None:
            return None
        self._own = self._folder / f"{self._owner[:12]}-{self._division(like)[:12]}"
        if self._comm.rank == 0:
            self._own.mkdir(parents=True, exist_ok=True)
        found = find_checkpoints(self._folder, self._owner, self._own) if self._comm.rank == 0 else []
        for checkpoint in self._comm.bcast(found):
            if self._is_whole(checkpoint):
                self.latest, self.continued, self.moved = checkpoint, checkpoint.window, not checkpoint.preferred
                self._generation = (checkpoint.generation + 1) % GENERATIONS
                header = None if self.moved else header_of(checkpoint.paths[self._comm.rank])
                self._kept = dict.fromkeys(header.kept) if header else {}
                return portable.values(self._part(checkpoint.paths, like))
        return None

    def _is_whole(self, checkpoint: Checkpoint) -> bool:
        """Return whether all files of a checkpoint are whole; warn of those that are not; collective."""
        mine = range(self._comm.rank, checkpoint.ranks, self._comm.size)
        faults = self._comm.allgather(
            [fault for rank in mine for fault in faults_of(checkpoint.folder, rank, checkpoint.generation)]
        )
        if self._comm.rank == 0:
            for fault in (fault for some in faults for fault in some):
                warn(f"{fault}: the run continues from an older checkpoint, or starts anew")
        return not any(faults)

    def is_due(self) -> bool:
        """Return whether the interval has passed on rank 0; collective."""
        if self._folder is None:
            return False
        HERE.wait_for("rank 0 to say whether a checkpoint is due")
        due = bool(self._comm.bcast(monotonic() - self._written >= self._interval))
        HERE.go_on()
        return due

    def write(self, window: int, time: float, state: State) -> None:
        """Write this rank's state at a window and a time [s] over the older generation; after ``read``; collective."""
        if self._folder is None:
            return
        header = Header(self._owner, self._comm.size, window, time, tuple(self._kept))
        write_state(self._own / STATE.format(rank=self._comm.rank, generation=self._generation), header, state)
        self._comm.Barrier()  # no rank may overwrite its older file before all have the newer one
        self.latest = Checkpoint(window, True, self._own, self._generation, self._comm.size, time)
        if self._comm.rank == 0:
            remove_others(self._own)
        self._generation = (self._generation + 1) % GENERATIONS
        self._written = monotonic()

    def keep(self, name: str, state: State) -> None:
        """Keep something for the rest of the run, beside the state; of this rank; after ``read``."""
        if self._folder is not None:
            path = self._own / KEPT.format(name=name, rank=self._comm.rank)
            write_state(path, Header(self._owner, self._comm.size), state)
            self._kept[name] = None

    def kept(self, name: str, like: State) -> dict[str, Any]:
        """Return the values of what was kept before the window from which the run continues; before the next ``write``.

        Args:
            name: Of what was kept.
            like: A state of the same nodes and cells.
        """
        assert self.latest is not None
        paths = [self.latest.folder / KEPT.format(name=name, rank=rank) for rank in range(self.latest.ranks)]
        state = self._part(paths, like)
        if self.moved:
            self.keep(name, state)
        return portable.values(state)

    def _part(self, paths: list[Path], like: State) -> State:
        """Return this rank's part of the states in the files of all ranks: its own file's in its own division.

        Raises:
            CheckpointError: The files lack what this rank has.
        """
        if not self.moved:
            return read_state(paths[self._comm.rank])
        state = portable.blank(like)
        for path in paths:
            if path.exists():  # of a rank that did not carry this model there is none
                portable.take(state, read_state(path), self._first)
        if not portable.is_complete(state):
            raise CheckpointError(f"the files of {paths[0].parent} lack nodes or cells of this run")
        return state

    def _division(self, like: State) -> str:
        """Return a digest of who has which nodes and cells; find what this rank is the first to carry; collective."""
        everyone = self._comm.allgather((portable.place(like), list(like)))
        before = {name for _, names in everyone[: self._comm.rank] for name in names}
        self._first = like.keys() - before
        return digest_of(repr(everyone).encode())


def read_state(path: Path) -> Any:
    """Return the state in a file.

    Raises:
        NotData: The file is broken off, changed or no state.
    """
    return read_data(path, ENTRIES)


def faults_of(folder: Path, rank: int, generation: int) -> list[str]:
    """Say what is wrong with the files of a rank: its state and what it had kept until then; empty if all are whole."""
    path = folder / STATE.format(rank=rank, generation=generation)
    header, faults = header_of(path), []
    names = header.kept if header else ()
    for file in (path, *(folder / KEPT.format(name=name, rank=rank) for name in names)):
        try:
            read_state(file)
        except NotData as error:
            faults.append(str(error))
    return faults


def remove_others(own: Path) -> None:
    """Remove the folders of other inputs and divisions beside a run's own."""
    for folder in own.parent.iterdir():
        if folder != own and FOLDER_NAME.fullmatch(folder.name):
            shutil.rmtree(folder)


@cache
def _code() -> bytes:
    """Return a digest of this package's source and of the libraries: other code may continue a state differently."""
    libraries = " ".join(version(name) for name in LIBRARIES)
    return libraries.encode() + digest_of_sources(Path(__file__).parents[1], MATERIALS)
